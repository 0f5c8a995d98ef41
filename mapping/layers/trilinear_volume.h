#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>

namespace mapping {

/// Sign of the Jacobian determinant of a trilinear map from the unit cube of u, v, w to world
/// positions, as shares of the cube.
struct VolumeSign {
  double negative = 0;  ///< share where the determinant is proven not to be positive
  /// Share left undecided at `mostPieces`: pieces where the determinant changes sign or touches
  /// zero.
  double undecided = 0;
  double least = 0;    ///< least determinant found at a corner of a piece, world units³
  Imath::V3d at{0};    ///< position of the least value in the unit cube
  bool folds = false;  ///< true: a determinant found is negative, or zero within rounding errors
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
