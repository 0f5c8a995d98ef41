// Times curvature flow and smoothing beside OpenVDB's own on the same grid, in one run.

#include <benchmark/benchmark.h>
#include <openvdb/tools/LevelSetFilter.h>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/curvature_flow/smooth.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"

namespace {

using levelset::NarrowBand;

/// Shrinks a ball from R = 32 to R = 16 voxels.
void BM_HalveABall(benchmark::State& state) {
  const NarrowBand ball = levelset::makeSphere(32, {0.3, 0.2, 0.1}, 1);
  for (auto _ : state) benchmark::DoNotOptimize(levelset::curvatureFlow(ball, 192));
}
void BM_HalveABallOpenVdb(benchmark::State& state) {
  const NarrowBand ball = levelset::makeSphere(32, {0.3, 0.2, 0.1}, 1);
  for (auto _ : state) {
    auto grid = levelset::vdb(ball).deepCopy();
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    // Each step covers 1/6 voxels² of our time.
    for (int i = 0; i < 1152; ++i) filter.meanCurvature();
  }
}

void BM_Gaussian(benchmark::State& state) {
  const NarrowBand ball =
      levelset::makeSphere(1, Imath::V3d(0), 2.0 / static_cast<double>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(
        levelset::smooth(ball, levelset::SmoothKind::Gaussian, ball.voxelSize()));
}
/// Runs the filter of `vdb_tool -gauss`.
void BM_GaussianOpenVdb(benchmark::State& state) {
  const NarrowBand ball =
      levelset::makeSphere(1, Imath::V3d(0), 2.0 / static_cast<double>(state.range(0)));
  for (auto _ : state) {
    auto grid = levelset::vdb(ball).deepCopy();
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    filter.gaussian(1);
  }
}

BENCHMARK(BM_HalveABall)->Iterations(1)->Unit(benchmark::kSecond)->MeasureProcessCPUTime();
BENCHMARK(BM_HalveABallOpenVdb)->Iterations(1)->Unit(benchmark::kSecond)->MeasureProcessCPUTime();
BENCHMARK(BM_Gaussian)->Arg(512)->Iterations(1)->Unit(benchmark::kSecond)->MeasureProcessCPUTime();
BENCHMARK(BM_GaussianOpenVdb)
    ->Arg(512)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
