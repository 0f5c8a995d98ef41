// Segmented fields beside separate bands of the same partition: memory and CPU time.
//
//   segmented_bench [VOXELS…]   VOXELS: grid points along the object, by default 64 128 256
//
// Prints a line of CSV for each scene and resolution. The separate bands are those of the visible
// parts: each solid minus all later ones, without the void's complement. The memory of the operands
// counts for neither.

#include <fmt/core.h>
#include <sys/resource.h>

#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"

namespace {

using namespace levelset;
using Imath::V3d;

double cpuSeconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

/// Least CPU time of three runs.
double secondsOf(const std::function<void()>& work) {
  double least = 1e300;
  for (int run = 0; run < 3; ++run) {
    const double start = cpuSeconds();
    work();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

/// Five slabs that touch, off the grid.
std::vector<NarrowBand> slabs(double voxel) {
  std::vector<NarrowBand> solids;
  for (int k = 0; k < 5; ++k)
    solids.push_back(makeBox(V3d(0.2, 1, 1), V3d(0.2 * k + 0.1031, 0.5017, 0.5023), voxel));
  return solids;
}

/// Five balls that overlap in a cluster.
std::vector<NarrowBand> balls(double voxel) {
  std::vector<NarrowBand> solids;
  for (const V3d& at : {V3d(0.3, 0.3, 0.3), V3d(0.7, 0.3, 0.35), V3d(0.3, 0.7, 0.4),
                        V3d(0.7, 0.7, 0.45), V3d(0.5, 0.5, 0.7)})
    solids.push_back(makeSphere(0.3, at, voxel));
  return solids;
}

/// Five layers, as of tissue.
std::vector<NarrowBand> layers(double voxel) {
  std::vector<NarrowBand> solids;
  for (int k = 0; k < 5; ++k)
    solids.push_back(makeSphere(0.5 - 0.08 * k, V3d(0.501, 0.503, 0.507), voxel));
  return solids;
}

void compare(const char* name, const std::vector<NarrowBand>& solids, int voxels) {
  std::size_t separateBytes = 0;
  const double separateSeconds = secondsOf([&] {
    separateBytes = solids.back().memoryUse();
    for (std::size_t k = 0; k + 1 < solids.size(); ++k)
      separateBytes +=
          combine(CsgOperation::Difference,
                  std::vector<NarrowBand>(solids.begin() + std::ptrdiff_t(k), solids.end()))
              .band.memoryUse();
  });
  SegmentSolidsResult result;
  const double seconds = secondsOf([&] { result = segmentSolids(solids); });
  SegmentedMesh mesh;
  const double meshSeconds = secondsOf([&] { mesh = segmentedToMesh(result.field); });
  fmt::print("{},{},{},{},{:.3f},{:.3f},{:.3f},{:.2f},{},{},{:.3f},{}\n", name, voxels,
             separateBytes, result.field.memoryUse(),
             double(result.field.memoryUse()) / double(separateBytes), separateSeconds, seconds,
             seconds / separateSeconds, result.field.activeVoxelCount(), result.field.extraCount(),
             meshSeconds, mesh.mesh.triangles.size());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  if (sizes.empty()) sizes = {64, 128, 256};
  fmt::print(
      "scene,voxels,separate_bytes,bytes,memory_ratio,separate_seconds,seconds,time_ratio,"
      "active_voxels,extras,mesh_seconds,triangles\n");
  for (const int voxels : sizes) {
    compare("slabs", slabs(1.0 / voxels), voxels);
    compare("balls", balls(1.0 / voxels), voxels);
    compare("layers", layers(1.0 / voxels), voxels);
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "segmented_bench: {}\n", error.what());
  return 1;
}
