#pragma once

#include <array>

#include "levelset/splines/bcc_grid.h"

namespace levelset {

/// Mean and half difference of the eight data of a cell: the sums of f and of s f over the corners
/// s ∈ {−1, 1}³ of the grid cube of the cell, divided by eight.
template <class Scalar>
struct BccCell {
  Scalar mean = Scalar(0);
  std::array<Scalar, 3> difference = {Scalar(0), Scalar(0), Scalar(0)};
};

/// Returns the cell's numbers from the eight data of its grid cube.
template <GridSample Sample>
BccCell<SampleScalar<Sample>> bccCell(const Sample& sample, const std::array<int, 3>& cell) {
  using Scalar = SampleScalar<Sample>;
  BccCell<Scalar> result;
  for (int n = 0; n < 8; ++n) {
    const std::array<int, 3> bit = {n & 1, n >> 1 & 1, n >> 2 & 1};
    const Scalar f = sample(cell[0] + bit[0], cell[1] + bit[1], cell[2] + bit[2]);
    result.mean += f;
    for (int d = 0; d < 3; ++d) result.difference[d] += bit[d] != 0 ? f : Scalar(-f);
  }
  result.mean /= Scalar(8);
  for (Scalar& d : result.difference) d /= Scalar(8);
  return result;
}

/// Quadratic C¹ splines Q_k on the truncated octahedra of a BCC lattice [Kalbe11]. All of them are
/// C¹ everywhere, and reproduce 1, and x at the data. Q_2 reproduces 1, x and xy, and maps x² to
/// x² + 1/4 (grid spacing 1). Q_k has no negative weight for k ≥ 3. A tetrahedron depends on 28
/// data.
///
/// A cell acts through an affine function of its BccCell: I(v) = mean + (2/k) difference · (v − c)
/// for its centre c. The coefficient between the vertices v_a and v_b, a ≤ b, is the mean of I(v_b)
/// over the cells that meet at v_a, with the weights BccPartition::ownerWeights(). This equals
/// the weights printed in [Kalbe11], except where data at equal distances are printed with unequal
/// weights: there the order of the data is not free.
///
/// The cells at the border of a grid are complete: ExtendedGrid (grid_extension.h) gives the data
/// beyond it, so that the spline covers the whole box of the data.
template <int K = 2>
class BccQuadraticSpline : public BccPartition {
  static_assert(K >= 1);

 public:
  static constexpr int kDegree = 2;

  /// Coefficients of a tetrahedron, from the data.
  template <GridSample Sample>
  [[nodiscard]] static BernsteinTetrahedron<2, SampleScalar<Sample>> coefficients(
      const Sample& sample, const PartitionTetrahedron& t) {
    return fromCells<SampleScalar<Sample>>(
        [&](const std::array<int, 3>& cell) { return bccCell(sample, cell); }, t);
  }

  /// Coefficients of a tetrahedron, from the numbers of cells.
  /// @param cellAt  function from the numbers of a cell to its BccCell
  template <class Scalar, class CellAt>
  [[nodiscard]] static BernsteinTetrahedron<2, Scalar> fromCells(const CellAt& cellAt,
                                                                 const PartitionTetrahedron& t) {
    const Frame f = frame(t.index);
    const auto cells = cellsAtVertex(t);
    constexpr auto kExponents = bernsteinExponents<4, 2>();
    BernsteinTetrahedron<2, Scalar> form;
    form.coefficients.fill(Scalar(0));
    for (int n = 0; n < 4; ++n) {
      const BccCell<Scalar> cell = cellAt(cells[n]);
      const std::array<Scalar, 3> slope = f.fromGrid(cell.difference);
      std::array<Scalar, 4> atVertex;
      for (int v = 0; v < 4; ++v) {
        // Twice the slope over K, times a vector in quarters.
        Scalar along(0);
        for (int d = 0; d < 3; ++d)
          along += Scalar(quarters(f.kind)[v][d] - 4 * kOwners[n][d]) * slope[d];
        atVertex[v] = cell.mean + along / Scalar(2 * K);
      }
      for (int c = 0; c < form.kCount; ++c) {
        int a = 0, b = 3;
        while (kExponents[c][a] == 0) ++a;
        while (kExponents[c][b] == 0) --b;
        const int weight = ownerWeights(f.kind, a)[n];
        if (weight != 0) form.coefficients[c] += Scalar(weight) * atVertex[b];
      }
    }
    for (Scalar& c : form.coefficients) c /= Scalar(8);
    return form;
  }
};

static_assert(TetrahedralSpline<BccQuadraticSpline<2>>);

}  // namespace levelset
