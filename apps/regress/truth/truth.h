#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>
#include <optional>

#include "levelset/csg/csg.h"

/// Exact answers, computed by formulas of their own.
namespace regress {

/// Signed distance, negative inside, world units.
using Distance = std::function<double(const Imath::V3d&)>;

/// A solid that is known exactly.
struct Truth {
  Distance distance;
  std::optional<double> volume = {}, area = {};
  Imath::V3d centre = {};  ///< of a ball that holds the solid …
  double reach = 1;        ///< … and its radius: rays are shot through it
  /// Places at which the band is compared; all of them when empty.
  std::function<bool(const Imath::V3d&)> compared = {};
};

[[nodiscard]] Truth ball(const Imath::V3d& centre, double radius);
/// `rounding` ≥ 0 moves the surface of the box outwards by it.
[[nodiscard]] Truth box(const Imath::V3d& centre, const Imath::V3d& size, double rounding = 0);
[[nodiscard]] Truth torus(const Imath::V3d& centre, const Imath::V3d& axis, double radius,
                          double tube);
[[nodiscard]] Truth cylinder(const Imath::V3d& centre, const Imath::V3d& axis, double radius,
                             double height);
[[nodiscard]] Truth capsule(const Imath::V3d& from, const Imath::V3d& to, double radius);

/// The same solid moved by a rotation and a translation (row vectors).
[[nodiscard]] Truth moved(const Truth& solid, const Imath::M44d& matrix);

/// Two balls whose surfaces meet in a circle.
[[nodiscard]] Truth twoBalls(levelset::CsgOperation operation, const Imath::V3d& centreA,
                             double radiusA, const Imath::V3d& centreB, double radiusB);

/// The union of two balls as a ball of radius `fillet` leaves it that rolls around the seam.
[[nodiscard]] Truth filletedBalls(const Imath::V3d& centreA, double radiusA,
                                  const Imath::V3d& centreB, double radiusB, double fillet);

/// Balls that do not meet.
[[nodiscard]] Truth apart(const Truth& a, const Truth& b);

/// A rotation that is aligned with no axis or diagonal of the grid, about the origin.
[[nodiscard]] Imath::M44d skewRotation();

}  // namespace regress
