#pragma once

// Private to the judge: a tricubic spline of a cell in double precision. Crossings of a line with
// its zero set are found by bounds on the slope.

#include <algorithm>
#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/filter.h"

namespace render {

/// Spline coefficients, or values for Filter::Tricubic, that a block of size³ cells reads, from one
/// grid point before the lowest corner of the block on. Reads every value from the tree and not
/// from a padded copy, so that the judge shares no code with the kernel.
template <int size>
struct SplineCoefficients {
  double c[size + 3][size + 3][size + 3];
  bool isTricubic;

  /// @param cell  index coordinates of the lowest corner of the block's first cell
  /// @param filter  Tricubic, BSpline or BSplineQi
  SplineCoefficients(const openvdb::FloatTree& tree, const openvdb::Coord& cell, Filter filter)
      : isTricubic(filter == Filter::Tricubic) {
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
    const auto at = [&](int x, int y, int z) {
      return static_cast<double>(accessor.getValue(cell.offsetBy(x - 1, y - 1, z - 1)));
    };
    for (int i = 0; i < size + 3; ++i)
      for (int j = 0; j < size + 3; ++j)
        for (int k = 0; k < size + 3; ++k) {
          const double own = at(i, j, k);
          c[i][j][k] = own;
          if (filter == Filter::BSplineQi)
            c[i][j][k] -= (at(i + 1, j, k) + at(i - 1, j, k) + at(i, j + 1, k) + at(i, j - 1, k) +
                           at(i, j, k + 1) + at(i, j, k - 1) - 6 * own) /
                          6;
        }
  }

  /// Returns false when bounds prove that the spline has no zero: those of the coefficients, or for
  /// Filter::Tricubic those of sums with weights whose magnitudes sum to (4/3)³ at most.
  [[nodiscard]] bool mayCross() const {
    double low = c[0][0][0], high = low;
    for (const auto& plane : c)
      for (const auto& row : plane)
        for (const double v : row) {
          low = std::min(low, v);
          high = std::max(high, v);
        }
    const double widening = isTricubic ? (high - low) * 37 / 54 : 0;
    return low - widening < 0 && high + widening >= 0;
  }
};

/// A tricubic spline on one cell: coefficients of uniform B-splines, or of Bernstein polynomials
/// for Filter::Tricubic.
class SplineCell {
 public:
  /// Copies the coefficients of cell (x, y, z) of a block. For Filter::Tricubic, computes them.
  template <int size>
  explicit SplineCell(const SplineCoefficients<size>& block, int x = 0, int y = 0, int z = 0)
      : isBernstein_(block.isTricubic) {
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        for (int k = 0; k < 4; ++k) c_[i][j][k] = block.c[x + i][y + j][z + k];
    if (isBernstein_) toBernstein();
  }

  /// Returns false when the spline has no zero in the cell: all coefficients have one sign, or
  /// |value| at the cell's centre exceeds the largest possible change within the cell.
  [[nodiscard]] bool mayCross() const;
  /// Value of the spline at p. Two cells with a common face return the same bits for p on that
  /// face, because there the coefficients that only one cell reads have weight zero.
  /// @param p  position in the cell, in [0, 1]³
  [[nodiscard]] double value(const Imath::V3d& p) const;
  /// Finds the first fraction of the segment from p to q at which the spline changes sign. The
  /// segment is halved repeatedly. A part is skipped when |value| at its middle exceeds the largest
  /// possible change within the part. It is not halved further when the slope keeps its sign within
  /// the part.
  [[nodiscard]] std::optional<double> firstSignChange(const Imath::V3d& p,
                                                      const Imath::V3d& q) const;
  /// Appends all fractions of the segment at which the spline changes sign, in ascending order. The
  /// directions of the changes alternate.
  void addSignChanges(const Imath::V3d& p, const Imath::V3d& q, std::vector<double>& found) const;

 private:
  void toBernstein();

  double c_[4][4][4];
  bool isBernstein_;
};

}  // namespace render
