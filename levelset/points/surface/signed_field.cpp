#include "levelset/points/surface/signed_field.h"

#include <algorithm>
#include <cmath>

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

/// Distance within which the side of the surface is that of a winding number, in fractions of the
/// distance to the closest point. A winding number changes by at most 1/2 for each of these
/// distances, so it needs 1 − exp(−2 d) of them to change by d. 0 if the side is not certain.
double sameSide(double winding) {
  constexpr double kDefinite = 0.25, kSafety = 0.8;
  const double margin = std::abs(winding - 0.5);
  return margin < kDefinite ? 0 : kSafety * (1 - std::exp(-2 * margin));
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
  if (!((at - memory.at).length() < memory.sameSide * closest)) {
    memory.winding = winding_.at(at);
    memory.sameSide = sameSide(memory.winding);
    memory.at = at;
  }
  return (1 - 2 * memory.winding) * closest;
}

double SignedField::value(const V3d& at, const std::vector<FoundItem>& found,
                          FieldMemory& memory) const {
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
  if (share == 0) return near_.value(at, found);
  if (share == 1) return far(at, closest, memory);
  return (1 - share) * near_.value(at, found) + share * far(at, closest, memory);
}

std::optional<double> SignedField::commonValue(const V3d& centre, double radius,
                                               const std::vector<FoundItem>& found,
                                               FieldMemory& memory, double bound) const {
  // No point may be near. Where the winding number is certain in the complete ball, and the field
  // agrees with it, the ball lies on one side of the surface.
  const double closest = std::sqrt(found.front().squared), least = closest - radius;
  if (!(least > bound)) return std::nullopt;
  const double farValue = far(centre, closest, memory);
  const double moved = (centre - memory.at).length() + radius;
  if (!(moved < memory.sameSide * least)) return std::nullopt;
  // Least values in the ball: of the far field as in sameSide(), of the near field by its slope.
  const double margin = std::abs(memory.winding - 0.5) + 0.5 * std::log(1 - moved / least);
  if (!(2 * margin * least > bound)) return std::nullopt;
  constexpr double kMostSlope = 2;
  const double result = value(centre, found, memory);
  if (!(result * farValue > 0) || !(std::abs(result) - kMostSlope * radius > bound))
    return std::nullopt;
  return result;
}

void SignedField::values(const CubePositions& at, CubeValues& values, FieldMemory& memory,
                         double bound) const {
  const V3d centre = (at.front() + at.back()) / 2;
  const double radius = (at.back() - at.front()).length() / 2;
  const auto& found = memory.cell.move(points_, centre, radius, near_.neighbours);
  if (const auto common = commonValue(centre, radius, found, memory, bound)) {
    values.fill(*common);
    return;
  }
  for (std::size_t begin = 0; begin < at.size(); begin += 8) {
    const V3d &low = at[begin], &high = at[begin + 7], middle = (low + high) / 2;
    const double reach = (high - low).length() / 2;
    const auto common =
        commonValue(middle, reach, memory.cell.moveInside(middle, reach), memory, bound);
    for (std::size_t n = begin; n < begin + 8; ++n) {
      if (common) {
        values[n] = *common;
        continue;
      }
      memory.cell.closest(at[n], memory.found);
      values[n] = value(at[n], memory.found, memory);
    }
  }
}

}  // namespace levelset::points
