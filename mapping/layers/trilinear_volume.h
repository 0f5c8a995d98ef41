#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>

namespace mapping {

/// Where the Jacobian determinant of a trilinear map is positive, as shares of the unit cube.
struct VolumeSign {
  double negative = 0;   ///< it is proven not to be positive
  double undecided = 0;  ///< pieces that hold the change of sign, or touch zero
  double least = 0;      ///< the least value met, world units³ per unit cube
  Imath::V3d at{0};      ///< where, in the unit cube
  bool folds = false;    ///< a value met is negative, or cannot be told from zero by rounding
  std::size_t pieces = 0;
};

/// The determinant is a polynomial of degree two in each of u, v and w: it stays between the least
/// and the largest of its 27 Bernstein coefficients, and the cube is halved until these have one
/// sign or `mostPieces` are spent.
/// @param corners   of the image; bits 0, 1, 2 of the index tell the upper end of u, v, w
/// @param rounding  how far the corners may be off, world units
/// @param hand      −1 for a map that mirrors: the determinant is multiplied by it
[[nodiscard]] VolumeSign signOfTrilinear(const std::array<Imath::V3d, 8>& corners, double rounding,
                                         double hand, std::size_t mostPieces = 512);

}  // namespace mapping
