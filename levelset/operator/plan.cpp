#include "levelset/operator/plan.h"

#include <algorithm>

namespace levelset {

double ValuePlan::longestSide() const {
  const Imath::V3d size = bounds.size();
  return std::max({size.x, size.y, size.z});
}

double ValuePlan::activeVoxels() const {
  if (!(voxelSize > 0)) return 0;
  const double inLayers = area / (voxelSize * voxelSize) * 2 * halfWidth;
  if (bounds.isEmpty()) return inLayers;
  // Nearby parts of the surface may share active voxels. The number of grid points in the bounds,
  // extended by the half width, is a limit.
  double all = 1;
  for (int axis = 0; axis < 3; ++axis)
    all *= (bounds.max[axis] - bounds.min[axis]) / voxelSize + 2 * halfWidth + 1;
  return std::min(inLayers, all);
}

double ValuePlan::layer() const {
  return voxelSize > 0 ? area / (voxelSize * voxelSize) : 0;
}

Imath::Box3d grown(Imath::Box3d box, double by) {
  box.min -= Imath::V3d(by);
  box.max += Imath::V3d(by);
  return box;
}

}  // namespace levelset
