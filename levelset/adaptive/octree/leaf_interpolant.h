#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>

namespace levelset {

/// Interpolant in a cell of an octree, from figures at its eight corners. Positions have
/// coordinates in [0, 1]. Bit 0 of the number of a corner is its coordinate along x, bit 1 along y,
/// bit 2 along z.
///
/// Tricubic means Adini's element [Adini61] in three dimensions: a cubic Hermite polynomial on each
/// edge, blended linearly between the four edges of a direction. It reproduces polynomials of
/// degree three. The interpolant on a face depends on its four corners only, and is the same for
/// the parts of a divided face.
struct LeafInterpolant {
  std::array<double, 8> values;
  bool isTricubic = false;
  std::array<std::array<double, 8>, 3> slopes;  ///< derivatives along the axes, for one edge length

  [[nodiscard]] double value(const Imath::V3d& at) const;
  /// Derivatives along the axes, for one edge length.
  [[nodiscard]] Imath::V3d slope(const Imath::V3d& at) const;
};

}  // namespace levelset
