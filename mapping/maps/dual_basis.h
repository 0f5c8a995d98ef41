#pragma once

#include <Imath/ImathVec.h>

#include <array>

namespace mapping {

/// The vectors that are 1 along one of three and 0 along the others; not finite where the three lie
/// in a plane.
[[nodiscard]] inline std::array<Imath::V3d, 3> dualBasis(const Imath::V3d& a, const Imath::V3d& b,
                                                         const Imath::V3d& c) {
  const double volume = a.dot(b.cross(c));
  return {b.cross(c) / volume, c.cross(a) / volume, a.cross(b) / volume};
}

}  // namespace mapping
