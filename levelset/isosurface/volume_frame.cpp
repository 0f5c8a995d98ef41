#include "levelset/isosurface/volume_frame.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace levelset {

VolumeFrame::VolumeFrame(const VolumeGrid& grid, double voxelSize, double halfWidth) {
  const Imath::M44d& map = grid.indexToWorld;
  const Imath::Box3d bounds = grid.bounds();
  for (int axis = 0; axis < 3; ++axis) {
    const double farthest =
        std::max(std::abs(bounds.min[axis]), std::abs(bounds.max[axis])) / voxelSize + halfWidth;
    if (!(farthest < kIndexLimit))
      throw ResourceLimit(
          fmt::format("at voxel size {} the grid index {:.3g} of the volume exceeds 32 bits; use a "
                      "larger --voxel",
                      voxelSize, farthest));
    // A multiple of 8, so that blocks relative to the base are blocks of the grid.
    base[axis] = 8 * static_cast<int>(std::floor(bounds.center()[axis] / voxelSize / 8));
  }
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) axes(row, column) = map[row][column] / voxelSize;
  toIndex = axes.inverse(0.0);
  for (int axis = 0; axis < 3; ++axis) origin[axis] = map[3][axis] / voxelSize - base[axis];
}

}  // namespace levelset
