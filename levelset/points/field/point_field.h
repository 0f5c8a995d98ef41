#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/points/field/oriented_points.h"

namespace levelset::points {

/// Function of space near the points. Its zero set is the surface, it is negative inside, and its
/// slope is about 1. Takes a position relative to OrientedPoints::centre and its closest points,
/// the nearest one first and the farthest one last. Several threads may call it at once.
struct PointField {
  std::function<double(const Imath::V3d&, const std::vector<FoundItem>&)> value;
  std::size_t neighbours;  ///< number of closest points that `value` takes
  /// Distance from the points up to which the field is good, in units of about a spacing.
  double reach = 1;
  std::size_t centres = 0;  ///< of rbfField(): points that the function interpolates
};

/// Weight of a point at a squared distance, in fractions of the squared cut-off [Sigg06, 4.10].
[[nodiscard]] inline double pointWeight(double squared) {
  const double t = squared < 1 ? 1 - squared : 0;
  return t * t * t;
}

/// Distance to a quadratic height function that is fitted to the closest points and their normals.
/// The weights depend smoothly on the position, so the field is smooth.
/// @param neighbours  number of points that are fitted
[[nodiscard]] PointField movingLeastSquares(const OrientedPoints& points, std::size_t neighbours);

}  // namespace levelset::points
