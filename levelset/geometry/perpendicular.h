#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>

namespace levelset {

/// Returns a unit vector that is perpendicular to a unit vector.
[[nodiscard]] inline Imath::V3d anyPerpendicular(const Imath::V3d& unit) {
  const Imath::V3d axis = std::abs(unit.x) < 0.6 ? Imath::V3d(1, 0, 0) : Imath::V3d(0, 1, 0);
  return (axis - unit * unit.dot(axis)).normalized();
}

/// Returns two unit vectors that are perpendicular to a unit normal and to each other. With the
/// normal last, they are right-handed.
[[nodiscard]] inline std::array<Imath::V3d, 2> tangents(const Imath::V3d& normal) {
  const Imath::V3d u = anyPerpendicular(normal);
  return {u, normal.cross(u)};
}

}  // namespace levelset
