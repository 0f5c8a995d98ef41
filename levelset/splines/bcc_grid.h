#pragma once

#include <array>
#include <utility>

#include "levelset/splines/tetrahedral_spline.h"

namespace levelset {

/// Truncated octahedra around the sites of a body-centred cubic (BCC) lattice, 144 tetrahedra each
/// [Kalbe11]. The cell (i, j, k) has its centre at (i + ½, j + ½, k + ½). Its three numbers are all
/// even or all odd. Its square faces are one grid spacing from the centre. The centres of its eight
/// hexagonal faces are the corners of the grid cube (i, j, k).
///
/// Vertices of a tetrahedron: v0 is the centre of the cell, v1 the centre of a face, v2 the middle
/// of an edge of that face, and v3 an end of that edge.
class BccPartition {
 public:
  static constexpr int kTetrahedra = 144;

  enum class Kind {
    Square,          ///< v1 is the centre of a square
    SquareHexagon,   ///< v1 is the centre of a hexagon, v2 on an edge with a square
    HexagonHexagon,  ///< v1 is the centre of a hexagon, v2 on an edge of two hexagons
  };

  /// Sector of a cell and tetrahedron in it. The coordinates from the centre of the cell along
  /// axes[0], axes[1] and axes[2], times the signs, are a ≥ b ≥ c ≥ 0 in the sector.
  struct Frame {
    std::array<int, 3> axes{0, 1, 2};
    std::array<int, 3> signs{1, 1, 1};  ///< along axes[0], axes[1] and axes[2]
    Kind kind = Kind::Square;

    /// Number of the tetrahedron in its cell.
    [[nodiscard]] constexpr int index() const {
      const int permutation = 2 * axes[0] + (axes[1] == (axes[0] + 1) % 3 ? 0 : 1);
      const int bits = (signs[0] < 0 ? 1 : 0) + (signs[1] < 0 ? 2 : 0) + (signs[2] < 0 ? 4 : 0);
      return (permutation * 8 + bits) * 3 + static_cast<int>(kind);
    }
    /// Vector with the components a, b and c along the axes of the frame.
    template <class Number>
    [[nodiscard]] constexpr std::array<Number, 3> toGrid(const std::array<Number, 3>& abc) const {
      std::array<Number, 3> result{};
      for (int n = 0; n < 3; ++n) result[axes[n]] = Number(signs[n]) * abc[n];
      return result;
    }
    /// Components of a vector along the axes of the frame.
    template <class Number>
    [[nodiscard]] constexpr std::array<Number, 3> fromGrid(const std::array<Number, 3>& v) const {
      return {Number(signs[0]) * v[axes[0]], Number(signs[1]) * v[axes[1]],
              Number(signs[2]) * v[axes[2]]};
    }
  };

  [[nodiscard]] static constexpr Frame frame(int index) {
    Frame f;
    f.kind = static_cast<Kind>(index % 3);
    const int bits = index / 3 % 8, permutation = index / 24;
    const int first = permutation / 2, step = permutation % 2 == 0 ? 1 : 2;
    f.axes = {first, (first + step) % 3, (first + 2 * step) % 3};
    f.signs = {bits & 1 ? -1 : 1, bits & 2 ? -1 : 1, bits & 4 ? -1 : 1};
    return f;
  }

  /// Vertices v0 to v3 in the frame, from the centre of the cell, in quarters of the grid spacing.
  [[nodiscard]] static constexpr std::array<std::array<int, 3>, 4> quarters(Kind kind) {
    if (kind == Kind::Square) return {{{0, 0, 0}, {4, 0, 0}, {4, 1, 1}, {4, 2, 0}}};
    if (kind == Kind::SquareHexagon) return {{{0, 0, 0}, {2, 2, 2}, {4, 1, 1}, {4, 2, 0}}};
    return {{{0, 0, 0}, {2, 2, 2}, {3, 3, 0}, {4, 2, 0}}};
  }

  /// Returns the cell whose centre is closest to a point; any one of them if several are.
  template <class Scalar>
  [[nodiscard]] static std::array<int, 3> nearestCell(const std::array<Scalar, 3>& point) {
    std::array<std::array<int, 3>, 2> cells{};
    std::array<Scalar, 2> distance{Scalar(0), Scalar(0)};
    const Scalar half = Scalar(1) / Scalar(2);
    for (int parity = 0; parity < 2; ++parity)
      for (int d = 0; d < 3; ++d) {
        // The nearest number of this parity to point[d] − ½.
        const Scalar shifted = point[d] + half - Scalar(parity);
        cells[parity][d] = 2 * floorOf(Scalar(shifted / Scalar(2))) + parity;
        const Scalar away = point[d] - half - Scalar(cells[parity][d]);
        distance[parity] += away * away;
      }
    return cells[distance[1] < distance[0] ? 1 : 0];
  }

  /// Returns the tetrahedron that holds a point; any one of them if several do.
  template <class Scalar>
  [[nodiscard]] static PartitionTetrahedron locate(const std::array<Scalar, 3>& point) {
    PartitionTetrahedron t;
    t.cell = nearestCell(point);
    Frame f;
    std::array<Scalar, 3> size;
    std::array<int, 3> sign{};
    for (int d = 0; d < 3; ++d) {
      const Scalar local = point[d] - Scalar(t.cell[d]) - Scalar(1) / Scalar(2);
      sign[d] = local < Scalar(0) ? -1 : 1;
      size[d] = local < Scalar(0) ? Scalar(-local) : local;
    }
    const auto order = [&](int m, int n) {
      if (size[f.axes[m]] < size[f.axes[n]]) std::swap(f.axes[m], f.axes[n]);
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
    for (int n = 0; n < 3; ++n) f.signs[n] = sign[f.axes[n]];
    const Scalar &a = size[f.axes[0]], &b = size[f.axes[1]], &c = size[f.axes[2]];
    if (!(a < Scalar(2) * (b + c)))
      f.kind = Kind::Square;
    else
      f.kind = Scalar(2) * b > a + c ? Kind::HexagonHexagon : Kind::SquareHexagon;
    t.index = f.index();
    return t;
  }

  template <class Scalar>
  [[nodiscard]] static std::array<std::array<Scalar, 3>, 4> vertices(
      const PartitionTetrahedron& t) {
    const Frame f = frame(t.index);
    std::array<std::array<Scalar, 3>, 4> v;
    for (int n = 0; n < 4; ++n) {
      const std::array<int, 3> offset = f.toGrid(quarters(f.kind)[n]);
      for (int d = 0; d < 3; ++d) v[n][d] = Scalar(t.cell[d]) + Scalar(2 + offset[d]) / Scalar(4);
    }
    return v;
  }

  template <class Scalar>
  [[nodiscard]] static BarycentricMap<4, Scalar> barycentric(const PartitionTetrahedron& t) {
    // Rows in the frame of the tetrahedron, times three; the constant is 1 for v0.
    constexpr int kRows[3][4][3] = {{{-3, 0, 0}, {3, -6, -6}, {0, 0, 12}, {0, 6, -6}},
                                    {{-2, -2, -2}, {-2, 4, 4}, {4, -8, 4}, {0, 6, -6}},
                                    {{-2, -2, -2}, {0, 0, 6}, {-4, 8, -4}, {6, -6, 0}}};
    const Frame f = frame(t.index);
    BarycentricMap<4, Scalar> map;
    for (int v = 0; v < 4; ++v) {
      const int* const k = kRows[static_cast<int>(f.kind)][v];
      const std::array<int, 3> row = f.toGrid(std::array<int, 3>{k[0], k[1], k[2]});
      // The centre is at cell + ½; six times the constant is a whole number.
      int constant = v == 0 ? 6 : 0;
      for (int d = 0; d < 3; ++d) {
        map.rows[v][d] = Scalar(row[d]) / Scalar(3);
        constant -= row[d] * (2 * t.cell[d] + 1);
      }
      map.rows[v][3] = Scalar(constant) / Scalar(6);
    }
    return map;
  }

  [[nodiscard]] static constexpr PartitionTetrahedron neighbour(PartitionTetrahedron t, int face) {
    Frame f = frame(t.index);
    const bool isSquare = f.kind == Kind::Square;
    const Kind otherHexagon =
        f.kind == Kind::SquareHexagon ? Kind::HexagonHexagon : Kind::SquareHexagon;
    if (face == 0 && isSquare) {
      t.cell[f.axes[0]] += 2 * f.signs[0];
      f.signs[0] = -f.signs[0];
    } else if (face == 0) {
      for (int n = 0; n < 3; ++n) {
        t.cell[f.axes[n]] += f.signs[n];
        f.signs[n] = -f.signs[n];
      }
      std::swap(f.axes[0], f.axes[2]);
      std::swap(f.signs[0], f.signs[2]);
      f.kind = otherHexagon;
    } else if (face == 1 && f.kind != Kind::HexagonHexagon) {
      f.kind = isSquare ? Kind::SquareHexagon : Kind::Square;
    } else if (face == 1 || (face == 2 && isSquare)) {
      f.signs[2] = -f.signs[2];
    } else if (face == 2) {
      f.kind = otherHexagon;
    } else {
      const int n = f.kind == Kind::HexagonHexagon ? 0 : 1;
      std::swap(f.axes[n], f.axes[n + 1]);
      std::swap(f.signs[n], f.signs[n + 1]);
    }
    t.index = f.index();
    return t;
  }

  /// Returns the four cells that meet at v3, the cell of the tetrahedron first. In the frame, their
  /// centres are at (0, 0, 0), (2, 0, 0), (1, 1, 1) and (1, 1, −1).
  [[nodiscard]] static constexpr std::array<std::array<int, 3>, 4> cellsAtVertex(
      const PartitionTetrahedron& t) {
    const Frame f = frame(t.index);
    std::array<std::array<int, 3>, 4> cells{};
    for (int n = 0; n < 4; ++n) {
      const std::array<int, 3> offset = f.toGrid(kOwners[n]);
      for (int d = 0; d < 3; ++d) cells[n][d] = t.cell[d] + offset[d];
    }
    return cells;
  }

  /// Centres of the cells of cellsAtVertex(), in the frame.
  static constexpr std::array<std::array<int, 3>, 4> kOwners = {
      {{0, 0, 0}, {2, 0, 0}, {1, 1, 1}, {1, 1, -1}}};

  /// Weights, in eighths, of the cells of cellsAtVertex() in a vertex: its barycentric coordinates
  /// in the centres of the cells that meet there.
  [[nodiscard]] static constexpr std::array<int, 4> ownerWeights(Kind kind, int vertex) {
    if (vertex == 0) return {8, 0, 0, 0};
    if (vertex == 3) return {2, 2, 2, 2};
    const bool isSquare = kind == Kind::Square;
    if (vertex == 1)
      return isSquare ? std::array<int, 4>{4, 4, 0, 0} : std::array<int, 4>{4, 0, 4, 0};
    return kind == Kind::HexagonHexagon ? std::array<int, 4>{2, 0, 3, 3}
                                        : std::array<int, 4>{3, 3, 2, 0};
  }
};

static_assert(TetrahedralPartition<BccPartition>);

}  // namespace levelset
