#include "levelset/adaptive/field_distance.h"

#include <algorithm>
#include <cmath>

namespace levelset {

FieldDistance::FieldDistance(const AdaptiveField& field)
    : field_(field), samplers_([field] { return AdaptiveSampler(field); }) {}

double FieldDistance::at(const Imath::V3d& position, const Known& /*known*/) const {
  const AdaptiveSampler& sampler = samplers_.local();
  const double value = sampler.value(position);
  const double width = field_.halfWidth();
  if (std::abs(value) <= width) return value;
  // The values at the corners are exact, and a distance changes by at most the length of a step. So
  // the interpolant is off by at most the radius of the leaf.
  return std::copysign(std::max(width, std::abs(value) - sampler.leafRadius(position)), value);
}

}  // namespace levelset
