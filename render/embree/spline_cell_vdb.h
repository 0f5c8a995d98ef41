#pragma once

// Private to the judge: the tricubic B-spline of a cell in double precision, and where a line
// crosses its zero set, by bounds of its slopes.

#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/filter.h"

namespace render {

/// The spline's coefficients that the cells from (0, 0, 0) to (size − 1)³ of a grid need.
template <int size>
struct SplineCoefficients {
  double c[size + 3][size + 3][size + 3];

  /// @param cell    index of the first one's lowest corner
  /// @param filter  not trilinear
  SplineCoefficients(const openvdb::FloatTree& tree, const openvdb::Coord& cell, Filter filter) {
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
};

class SplineCell {
 public:
  /// Cell (x, y, z) of a block.
  template <int size>
  explicit SplineCell(const SplineCoefficients<size>& block, int x = 0, int y = 0, int z = 0) {
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        for (int k = 0; k < 4; ++k) c_[i][j][k] = block.c[x + i][y + j][z + k];
  }

  /// False where it crosses zero for certain nowhere: its coefficients have one sign, or the middle
  /// is farther from zero than its slopes allow.
  [[nodiscard]] bool mayCross() const;
  /// The same bits for both cells at a face that p is on: what the farthest coefficients weigh
  /// there is nothing.
  /// @param p  in [0, 1]³
  [[nodiscard]] double value(const Imath::V3d& p) const;
  /// The first share of the way from p to q at which the spline changes sign: halves are left out
  /// where the middle is farther from zero than its slope allows, and not halved any more where the
  /// slope cannot change its sign.
  [[nodiscard]] std::optional<double> firstSignChange(const Imath::V3d& p,
                                                      const Imath::V3d& q) const;
  /// Appends all of them, in order. Each turns to the other side.
  void addSignChanges(const Imath::V3d& p, const Imath::V3d& q, std::vector<double>& found) const;

 private:
  double c_[4][4][4];
};

}  // namespace render
