#include "levelset/volumes/filters/resample_volume.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/volumes/filters/filtered_volume.h"

namespace levelset {

using Imath::V3d;

VolumeGrid resampledGrid(const VolumeGrid& grid, double spacing) {
  constexpr double kLargest = 1e30;
  if (!(spacing > 0 && spacing <= kLargest))
    throw UsageError(fmt::format("the voxel size is {}; give a positive length of at most {:.0e}",
                                 spacing, kLargest));
  const Imath::Box3d bounds = grid.bounds();
  VolumeGrid result;
  V3d first;
  for (int axis = 0; axis < 3; ++axis) {
    // A bound at a multiple is not moved to the next one by rounding.
    constexpr double kRounding = 1e-9;
    first[axis] = std::floor(bounds.min[axis] / spacing + kRounding);
    const double last = std::ceil(bounds.max[axis] / spacing - kRounding);
    constexpr double kMost = 2147483647;
    if (!(last - first[axis] < kMost) || !(std::abs(first[axis]) < 1e15))
      throw ResourceLimit(
          fmt::format("the voxel size {:.6g} is too small for a volume {:.6g} wide and {:.6g} from "
                      "the origin; use larger voxels",
                      spacing, bounds.max[axis] - bounds.min[axis], bounds.min[axis]));
    result.size[axis] = static_cast<int>(last - first[axis]) + 1;
  }
  result.indexToWorld.setScale(V3d(spacing));
  for (int axis = 0; axis < 3; ++axis) result.indexToWorld[3][axis] = first[axis] * spacing;
  return result;
}

Volume resampled(const Volume& volume, double spacing, const ResampleVolumeOptions& options) {
  const VolumeGrid grid = resampledGrid(volume.grid(), spacing);
  const double points = static_cast<double>(grid.size.x) * grid.size.y * grid.size.z;
  requireMemory(points * sizeof(float), memoryLimit(options.maxMemory));
  const FilteredVolume filtered(volume, options.filter);
  const Imath::M44d toSource = grid.indexToWorld * volume.grid().indexToWorld.inverse();
  std::vector<float> values(grid.pointCount());
  ProgressGate gate(options.progress, static_cast<std::size_t>(grid.size.z));
  tbb::parallel_for(0, grid.size.z, [&](int k) {
    std::size_t at = static_cast<std::size_t>(k) * static_cast<std::size_t>(grid.size.y) *
                     static_cast<std::size_t>(grid.size.x);
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        values[at++] = static_cast<float>(filtered.value(V3d(i, j, k) * toSource));
    gate.advance(1);
  });
  return {grid, std::move(values)};
}

}  // namespace levelset
