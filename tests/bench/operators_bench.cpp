// Times operators beside OpenVDB's own on the same grid, in one run. Items are active voxels of the
// input.

#include <benchmark/benchmark.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <array>

#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/offset/offset.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"

namespace {

using levelset::NarrowBand;

/// Ball with a diameter of range(0) voxels.
NarrowBand ball(const benchmark::State& state, double shift = 0) {
  return levelset::makeSphere(1, Imath::V3d(shift, 0, 0),
                              2.0 / static_cast<double>(state.range(0)));
}

void countVoxels(benchmark::State& state, const NarrowBand& band) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(band.activeVoxelCount()));
}

void BM_Union(benchmark::State& state) {
  const NarrowBand a = ball(state), b = ball(state, 0.5);
  for (auto _ : state) benchmark::DoNotOptimize(levelset::unite(a, b));
  countVoxels(state, a);
}
/// Runs the default of vdb_tool: CSG, then a rebuild of the band.
void BM_UnionOpenVdb(benchmark::State& state) {
  const NarrowBand a = ball(state), b = ball(state, 0.5);
  for (auto _ : state) {
    auto result = openvdb::tools::csgUnionCopy(levelset::vdb(a), levelset::vdb(b));
    benchmark::DoNotOptimize(openvdb::tools::levelSetRebuild(*result, 0.f, 3.f));
  }
  countVoxels(state, a);
}

void BM_Offset10(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state) benchmark::DoNotOptimize(levelset::offset(a, 10 * a.voxelSize()));
  countVoxels(state, a);
}
void BM_Offset10OpenVdb(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state) {
    auto grid = levelset::vdb(a).deepCopy();
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    filter.offset(static_cast<float>(-10 * a.voxelSize()));
  }
  countVoxels(state, a);
}

void BM_Redistance(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state) benchmark::DoNotOptimize(levelset::redistance(a));
  countVoxels(state, a);
}
void BM_RedistanceOpenVdb(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(openvdb::tools::levelSetRebuild(levelset::vdb(a), 0.f, 3.f));
  countVoxels(state, a);
}

/// Widens the band by eight voxels on each side. Items are active voxels of the result, because
/// OpenVDB's dilation extends less far along diagonals.
void BM_Widen8(benchmark::State& state) {
  const NarrowBand a = ball(state);
  std::int64_t voxels = 0;
  for (auto _ : state)
    voxels +=
        static_cast<std::int64_t>(levelset::redistance(a, {.halfWidth = 11}).activeVoxelCount());
  state.SetItemsProcessed(voxels);
}
void goEight(benchmark::State& state, const levelset::ArrivalOptions& options) {
  const NarrowBand a = ball(state);
  std::int64_t voxels = 0;
  for (auto _ : state)
    voxels += static_cast<std::int64_t>(
        levelset::frontDistance(a, 11 * a.voxelSize(), options).band.activeVoxelCount());
  state.SetItemsProcessed(voxels);
}
void BM_Sweep8(benchmark::State& state) {
  goEight(state, {});
}
void BM_Sweep8FirstOrder(benchmark::State& state) {
  goEight(state, {.order = 1});
}
void BM_March8(benchmark::State& state) {
  goEight(state, {.method = levelset::FrontMethod::Marching});
}
void BM_Sweep8OpenVdb(benchmark::State& state) {
  const NarrowBand a = ball(state);
  std::int64_t voxels = 0;
  for (auto _ : state)
    voxels += static_cast<std::int64_t>(
        openvdb::tools::dilateSdf(levelset::vdb(a), 8)->activeVoxelCount());
  state.SetItemsProcessed(voxels);
}

void BM_Mesh(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state) benchmark::DoNotOptimize(levelset::bandToMesh(a));
  countVoxels(state, a);
}
void BM_MeshOpenVdb(benchmark::State& state) {
  const NarrowBand a = ball(state);
  for (auto _ : state) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(levelset::vdb(a), points, quads);
    benchmark::DoNotOptimize(points.data());
  }
  countVoxels(state, a);
}

#define LEVELSMITH_BENCH(name)                                                                 \
  BENCHMARK(name)->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime(); \
  BENCHMARK(name##OpenVdb)                                                                     \
      ->Arg(256)                                                                               \
      ->Arg(512)                                                                               \
      ->Unit(benchmark::kMillisecond)                                                          \
      ->MeasureProcessCPUTime()

#define LEVELSMITH_BENCH_SWEEP(name) \
  BENCHMARK(name)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()
LEVELSMITH_BENCH_SWEEP(BM_Widen8);
LEVELSMITH_BENCH_SWEEP(BM_Sweep8);
LEVELSMITH_BENCH_SWEEP(BM_Sweep8FirstOrder);
LEVELSMITH_BENCH_SWEEP(BM_March8);
LEVELSMITH_BENCH_SWEEP(BM_Sweep8OpenVdb);

LEVELSMITH_BENCH(BM_Union);
LEVELSMITH_BENCH(BM_Redistance);
LEVELSMITH_BENCH(BM_Mesh);
// vdb_tool's sphere of dim=256 has 3 voxels of band on each side.
BENCHMARK(BM_Offset10)->Arg(250)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(BM_Offset10OpenVdb)->Arg(250)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
