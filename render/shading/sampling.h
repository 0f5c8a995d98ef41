#pragma once

// Private to render: directions of rays from random points in the unit square.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {

/// Completes the unit vector n to an orthonormal frame (s, t, n) [Duff17].
inline void tangentFrame(const Imath::V3d& n, Imath::V3d& s, Imath::V3d& t) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1 / (sign + n.z), b = n.x * n.y * a;
  s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  t = {b, sign + n.y * n.y * a, -n.y};
}

/// Cosine-weighted random direction in the hemisphere around `axis`. @param u  random point in [0,
/// 1)²
[[nodiscard]] inline Imath::V3d cosineDirection(const Imath::V3d& axis, const Imath::V2d& u) {
  Imath::V3d s, t;
  tangentFrame(axis, s, t);
  const double r = std::sqrt(u.x), angle = 2 * std::numbers::pi * u.y;
  return s * (r * std::cos(angle)) + t * (r * std::sin(angle)) + axis * std::sqrt(1 - u.x);
}

/// Uniformly distributed random direction in a cone around `axis`. @param u  random point in [0,
/// 1)²
[[nodiscard]] inline Imath::V3d coneDirection(const Imath::V3d& axis, double halfAngle,
                                              const Imath::V2d& u) {
  Imath::V3d s, t;
  tangentFrame(axis, s, t);
  const double cosine = 1 - u.x * (1 - std::cos(halfAngle));
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double angle = 2 * std::numbers::pi * u.y;
  return s * (sine * std::cos(angle)) + t * (sine * std::sin(angle)) + axis * cosine;
}

}  // namespace render
