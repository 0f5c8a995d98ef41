#include "levelset/points/surface/signed_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset::points {
namespace {

using Imath::V3d;

/// Distances from the closest point, in spacings, between which the near field is blended with the
/// far field.
constexpr double kNearEnd = 1.2, kFarStart = 2.2;
constexpr double kFewNeighbours = 17;

/// 0 up to 0, 1 from 1 on, with a continuous slope.
double smoothStep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

SignedField::SignedField(const OrientedPoints& points, PointField near)
    : points_(points),
      near_(std::move(near)),
      // Users ask for many neighbours where noise is larger than the spacing.
      reach_(
          std::max(near_.reach, std::sqrt(static_cast<double>(near_.neighbours) / kFewNeighbours))),
      winding_(points) {}

double SignedField::far(const V3d& at, double closest, FieldMemory& memory) const {
  // The winding number changes by at most 1/2 for each `closest`. So the sign of a definite one
  // holds in its neighbourhood.
  constexpr double kDefinite = 0.25, kSameSide = 0.3;
  if (std::abs(memory.winding - 0.5) < kDefinite ||
      !((at - memory.at).length() < kSameSide * closest)) {
    memory.winding = winding_.at(at);
    memory.at = at;
  }
  return (1 - 2 * memory.winding) * closest;
}

double SignedField::value(const V3d& at, FieldMemory& memory) const {
  std::vector<FoundItem>& found = memory.found;
  if (!memory.isNear) {
    // Far from the points, the closest one suffices. Neighbouring points have similar spacings.
    const FoundItem first = points_.search.closest(at, std::numeric_limits<double>::infinity());
    const double distance = std::sqrt(first.squared);
    if (distance > 2 * kFarStart * reach_ * points_.spacings[first.index])
      return far(at, distance, memory);
  }
  points_.search.closest(at, near_.neighbours, found);
  const double closest = std::sqrt(found.front().squared);
  double spacing = 0, weights = 0;
  for (const FoundItem& f : found) {
    const double weight = pointWeight(f.squared / found.back().squared);
    weights += weight;
    spacing += weight * points_.spacings[f.index];
  }
  spacing = weights > 0 ? spacing / weights : points_.spacings[found.front().index];
  const double share =
      smoothStep((closest / (reach_ * spacing) - kNearEnd) / (kFarStart - kNearEnd));
  memory.isNear = share < 1;
  if (share == 0) return near_.value(at, found);
  if (share == 1) return far(at, closest, memory);
  return (1 - share) * near_.value(at, found) + share * far(at, closest, memory);
}

}  // namespace levelset::points
