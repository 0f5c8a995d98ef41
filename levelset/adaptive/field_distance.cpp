#include "levelset/adaptive/field_distance.h"

#include <algorithm>
#include <cmath>

namespace levelset {

FieldDistance::FieldDistance(const AdaptiveField& field)
    : field_(field), samplers_([field] { return AdaptiveSampler(field); }) {}

double FieldDistance::at(const Imath::V3d& position, const Known& /*known*/) const {
  const AdaptiveSampler& sampler = samplers_.local();
  const Imath::Box3d root = field_.box();
  Imath::V3d inside = position;
  for (int axis = 0; axis < 3; ++axis)
    inside[axis] = std::clamp(position[axis], root.min[axis], root.max[axis]);
  double value = sampler.value(inside);
  const double width = field_.halfWidth();
  if (std::abs(value) > width) {
    // A distance changes by at most the length of a step, so the interpolant is off by at most the
    // radius of the leaf, where the corners are exact. Corners on a larger leaf are less exact. The
    // cubic bumps of a tricubic leaf add about one radius.
    const double radii = field_.isTricubic() ? 4 : 3;
    value =
        std::copysign(std::max(width, std::abs(value) - radii * sampler.leafRadius(inside)), value);
  }
  // The surface lies in the root, and the nearest point of a cube sees it at a right angle or less.
  return std::copysign(std::hypot(value, (position - inside).length()), value);
}

}  // namespace levelset
