// Times the operators that have no bound of their own, beside OpenVDB's where it has one, in one
// run. The input is a ball with a diameter of 256 voxels, unless a benchmark states another.

#include <benchmark/benchmark.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/GridOperators.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetMorph.h>

#include <cmath>

#include "levelset/components/components.h"
#include "levelset/csg/blend.h"
#include "levelset/curvature_flow/smooth.h"
#include "levelset/distance/closest_points.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/morph/morph.h"
#include "levelset/offset/morphology.h"
#include "levelset/offset/offset.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace {

using levelset::NarrowBand;
using Filter = openvdb::tools::LevelSetFilter<openvdb::FloatGrid>;

constexpr double kVoxel = 2.0 / 256;

/// Ball of radius 1.
const NarrowBand& ball() {
  static const NarrowBand solid = levelset::makeSphere(1, Imath::V3d(0), kVoxel);
  return solid;
}

template <typename Job>
void time(benchmark::State& state, const Job& job) {
  for (auto _ : state) benchmark::DoNotOptimize(job());
}

template <typename Job>
void timeOpenVdb(benchmark::State& state, const Job& job) {
  for (auto _ : state) {
    auto grid = levelset::vdb(ball()).deepCopy();
    Filter filter(*grid);
    job(filter);
    benchmark::DoNotOptimize(grid.get());
  }
}

void BM_ClosestPoint(benchmark::State& state) {
  time(state, [] { return levelset::closestPoints(ball()); });
}
void BM_ClosestPointOpenVdb(benchmark::State& state) {
  time(state, [] { return openvdb::tools::cpt(levelset::vdb(ball())); });
}

void BM_Open(benchmark::State& state) {
  time(state, [] { return levelset::opening(ball(), 5 * kVoxel); });
}
void BM_OpenOpenVdb(benchmark::State& state) {
  timeOpenVdb(state, [](Filter& filter) {
    filter.offset(static_cast<float>(5 * kVoxel));
    filter.offset(static_cast<float>(-5 * kVoxel));
  });
}

void BM_Close(benchmark::State& state) {
  time(state, [] { return levelset::closing(ball(), 5 * kVoxel); });
}
void BM_CloseOpenVdb(benchmark::State& state) {
  timeOpenVdb(state, [](Filter& filter) {
    filter.offset(static_cast<float>(-5 * kVoxel));
    filter.offset(static_cast<float>(5 * kVoxel));
  });
}

void BM_Shell(benchmark::State& state) {
  time(state, [] { return levelset::shell(ball(), 5 * kVoxel); });
}
void BM_ShellOpenVdb(benchmark::State& state) {
  timeOpenVdb(state, [](Filter& filter) {
    filter.offset(static_cast<float>(5 * kVoxel));
    benchmark::DoNotOptimize(
        openvdb::tools::csgDifferenceCopy(levelset::vdb(ball()), filter.grid()));
  });
}

void BM_OffsetByField(benchmark::State& state) {
  time(state, [] {
    return levelset::offsetBy(ball(),
                              [](const Imath::V3d& p) { return 3 * kVoxel * std::sin(9 * p.x); });
  });
}

void smoothed(benchmark::State& state, levelset::SmoothKind kind) {
  time(state, [=] { return levelset::smooth(ball(), kind, kVoxel); });
}
void BM_Mean(benchmark::State& state) {
  smoothed(state, levelset::SmoothKind::Mean);
}
void BM_MeanOpenVdb(benchmark::State& state) {
  timeOpenVdb(state, [](Filter& filter) { filter.mean(1); });
}
void BM_Median(benchmark::State& state) {
  smoothed(state, levelset::SmoothKind::Median);
}
void BM_MedianOpenVdb(benchmark::State& state) {
  timeOpenVdb(state, [](Filter& filter) { filter.median(1); });
}
void BM_Taubin(benchmark::State& state) {
  smoothed(state, levelset::SmoothKind::Taubin);
}

/// Ball moved by five voxels.
NarrowBand shifted() {
  return levelset::makeSphere(1, Imath::V3d(5 * kVoxel, 0, 0), kVoxel);
}
/// Morphs in twenty steps.
void BM_Morph(benchmark::State& state) {
  const NarrowBand target = shifted();
  time(state, [&] { return levelset::morph(ball(), target, {.steps = 20}); });
}
/// Morphs to time 1, with as many steps as OpenVDB chooses.
void BM_MorphOpenVdb(benchmark::State& state) {
  const NarrowBand target = shifted();
  for (auto _ : state) {
    auto grid = levelset::vdb(ball()).deepCopy();
    openvdb::tools::LevelSetMorphing<openvdb::FloatGrid> morph(*grid, levelset::vdb(target));
    morph.advect(0, 1);
    benchmark::DoNotOptimize(grid.get());
  }
}

void BM_Fillet(benchmark::State& state) {
  const NarrowBand other = levelset::makeSphere(0.5, Imath::V3d(1, 0, 0), kVoxel);
  time(state, [&] {
    return levelset::blend(levelset::CsgOperation::Union, ball(), other, 8 * kVoxel,
                           {.method = levelset::BlendMethod::Fillet});
  });
}
void BM_Blend(benchmark::State& state) {
  const NarrowBand other = levelset::makeSphere(0.5, Imath::V3d(1, 0, 0), kVoxel);
  time(state,
       [&] { return levelset::blend(levelset::CsgOperation::Union, ball(), other, 8 * kVoxel); });
}

void BM_Compare(benchmark::State& state) {
  const NarrowBand other = shifted();
  time(state, [&] { return levelset::compare(ball(), other); });
}

void BM_Measure(benchmark::State& state) {
  time(state, [] { return levelset::measure(ball()); });
}
/// Measures area, volume, mean and Gaussian curvature. OpenVDB has no centroid, inertia or
/// components.
void BM_MeasureOpenVdb(benchmark::State& state) {
  for (auto _ : state) {
    openvdb::tools::LevelSetMeasure<openvdb::FloatGrid> measure(levelset::vdb(ball()));
    benchmark::DoNotOptimize(measure.area());
    benchmark::DoNotOptimize(measure.volume());
    benchmark::DoNotOptimize(measure.totMeanCurvature());
    benchmark::DoNotOptimize(measure.eulerCharacteristic());
  }
}

void BM_Check(benchmark::State& state) {
  time(state, [] { return levelset::check(ball()); });
}
void BM_Resample(benchmark::State& state) {
  time(state, [] { return levelset::resample(ball(), 1.5 * kVoxel); });
}
void BM_KeepLargest(benchmark::State& state) {
  time(state, [] { return levelset::keepLargest(ball(), 1); });
}

#define LEVELSMITH_BENCH(name) \
  BENCHMARK(name)->Iterations(1)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()
#define LEVELSMITH_BENCH_BESIDE(name) \
  LEVELSMITH_BENCH(name);             \
  LEVELSMITH_BENCH(name##OpenVdb)
LEVELSMITH_BENCH_BESIDE(BM_ClosestPoint);
LEVELSMITH_BENCH_BESIDE(BM_Open);
LEVELSMITH_BENCH_BESIDE(BM_Close);
LEVELSMITH_BENCH_BESIDE(BM_Shell);
LEVELSMITH_BENCH(BM_OffsetByField);
LEVELSMITH_BENCH_BESIDE(BM_Mean);
LEVELSMITH_BENCH_BESIDE(BM_Median);
LEVELSMITH_BENCH(BM_Taubin);
LEVELSMITH_BENCH_BESIDE(BM_Morph);
LEVELSMITH_BENCH(BM_Fillet);
LEVELSMITH_BENCH(BM_Blend);
LEVELSMITH_BENCH(BM_Compare);
LEVELSMITH_BENCH_BESIDE(BM_Measure);
LEVELSMITH_BENCH(BM_Check);
LEVELSMITH_BENCH(BM_Resample);
LEVELSMITH_BENCH(BM_KeepLargest);

}  // namespace

int main(int argc, char** argv) {
  (void)ball();  // so that the first benchmark does not include it
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
