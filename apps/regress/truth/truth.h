#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>
#include <optional>

#include "levelset/csg/csg.h"

/// Exact answers of the problems, by formulas that are independent of the operators.
namespace regress {

/// Signed distance, negative inside, world units.
using Distance = std::function<double(const Imath::V3d&)>;

/// Solid with an exact distance.
struct Truth {
  Distance distance;
  std::optional<double> volume = {}, area = {};
  Imath::V3d centre = {};  ///< centre of a ball that holds the solid
  double reach = 1;        ///< radius of that ball, which the measuring rays cross
  /// Returns true at points where the band is compared with the exact distance. Empty: at all
  /// points.
  std::function<bool(const Imath::V3d&)> compared = {};
};

[[nodiscard]] Truth ball(const Imath::V3d& centre, double radius);
/// Box whose surface is offset outwards by `rounding` ≥ 0.
[[nodiscard]] Truth box(const Imath::V3d& centre, const Imath::V3d& size, double rounding = 0);
[[nodiscard]] Truth torus(const Imath::V3d& centre, const Imath::V3d& axis, double radius,
                          double tube);
[[nodiscard]] Truth cylinder(const Imath::V3d& centre, const Imath::V3d& axis, double radius,
                             double height);
[[nodiscard]] Truth capsule(const Imath::V3d& from, const Imath::V3d& to, double radius);

/// Moves a solid by a rotation and a translation (row vectors).
[[nodiscard]] Truth moved(const Truth& solid, const Imath::M44d& matrix);

/// Union, intersection or difference of two balls whose surfaces meet in a circle.
[[nodiscard]] Truth twoBalls(levelset::CsgOperation operation, const Imath::V3d& centreA,
                             double radiusA, const Imath::V3d& centreB, double radiusB);

/// Union of two balls with a fillet, rounded by a ball of radius `fillet` that rolls around the
/// seam.
[[nodiscard]] Truth filletedBalls(const Imath::V3d& centreA, double radiusA,
                                  const Imath::V3d& centreB, double radiusB, double fillet);

/// Union of two solids that do not meet.
[[nodiscard]] Truth apart(const Truth& a, const Truth& b);

/// Rotation about an axis through the origin that is parallel to no axis or diagonal of the grid.
[[nodiscard]] Imath::M44d skewRotation();

}  // namespace regress
