#pragma once

#include <Imath/ImathVec.h>

#include <array>

namespace mapping {

/// Dual basis of three vectors: each result has dot product 1 with one of them and 0 with the
/// others. Not finite if the three vectors lie in a plane.
[[nodiscard]] inline std::array<Imath::V3d, 3> dualBasis(const Imath::V3d& a, const Imath::V3d& b,
                                                         const Imath::V3d& c) {
  const double volume = a.dot(b.cross(c));
  return {b.cross(c) / volume, c.cross(a) / volume, a.cross(b) / volume};
}

}  // namespace mapping
