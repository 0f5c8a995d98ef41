#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>

namespace mapping {

/// Sign of the Jacobian determinant of a trilinear map, as shares of the unit cube.
struct VolumeSign {
  double negative = 0;   ///< share where the determinant is proven not to be positive
  double undecided = 0;  ///< share of the pieces that contain the change of sign, or touch zero
  double least = 0;      ///< least value found, world units³ per unit cube
  Imath::V3d at{0};      ///< position of the least value in the unit cube
  bool folds = false;    ///< a value found is negative, or is zero within rounding errors
  std::size_t pieces = 0;
};

/// Bounds the sign of the determinant. The determinant is a polynomial of degree two in each of u,
/// v and w, so it lies between the least and the largest of its 27 Bernstein coefficients. The cube
/// is halved until the coefficients have one sign or `mostPieces` is exceeded.
/// @param corners   corners of the image; bits 0, 1, 2 of the index select the upper end of u, v, w
/// @param rounding  error bound of the corners, world units
/// @param hand      −1 for a mirroring map; factor of the determinant
[[nodiscard]] VolumeSign signOfTrilinear(const std::array<Imath::V3d, 8>& corners, double rounding,
                                         double hand, std::size_t mostPieces = 512);

}  // namespace mapping
