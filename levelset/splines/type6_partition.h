#pragma once

#include <array>
#include <utility>

#include "levelset/splines/tetrahedral_spline.h"

namespace levelset {

/// Type-6 partition of a grid: six planes through its centre split each cube into 24 congruent
/// tetrahedra [Kalbe11]. The cube of the cell (i, j, k) has its centre at the datum (i, j, k) and
/// edges of one grid spacing.
///
/// Vertices of a tetrahedron: v0 is the centre of the cube, v1 the centre of a face, and v2 and v3
/// are the ends of an edge of that face.
class Type6Partition {
 public:
  static constexpr int kTetrahedra = 24;

  /// Axes of a tetrahedron. The face of v1 is at `sign` on `axis`, the edge of v2 and v3 at
  /// `edgeSign` on `edgeAxis`, and v2 is on the positive side of `thirdAxis`.
  struct Frame {
    int axis = 0, sign = 1;
    int edgeAxis = 1, edgeSign = 1;
    int thirdAxis = 2;

    /// Number of the tetrahedron in its cell.
    [[nodiscard]] constexpr int index() const {
      return axis * 8 + (sign < 0 ? 4 : 0) + (edgeAxis == (axis + 1) % 3 ? 0 : 2) +
             (edgeSign < 0 ? 1 : 0);
    }
    /// Offset of a datum of the grid, from its coordinates along axis, edgeAxis and thirdAxis.
    [[nodiscard]] constexpr std::array<int, 3> offset(int x, int y, int z) const {
      std::array<int, 3> result{};
      result[axis] = sign * x;
      result[edgeAxis] = edgeSign * y;
      result[thirdAxis] = z;
      return result;
    }
  };

  [[nodiscard]] static constexpr Frame frame(int index) {
    Frame f;
    f.axis = index / 8;
    f.sign = index & 4 ? -1 : 1;
    f.edgeAxis = (f.axis + (index & 2 ? 2 : 1)) % 3;
    f.edgeSign = index & 1 ? -1 : 1;
    f.thirdAxis = 3 - f.axis - f.edgeAxis;
    return f;
  }

  /// Returns the tetrahedron that holds a point; any one of them if several do.
  template <class Scalar>
  [[nodiscard]] static PartitionTetrahedron locate(const std::array<Scalar, 3>& point) {
    PartitionTetrahedron t;
    std::array<Scalar, 3> size;
    std::array<int, 3> sign{};
    for (int d = 0; d < 3; ++d) {
      t.cell[d] = floorOf(Scalar(point[d] + Scalar(1) / Scalar(2)));
      const Scalar local = point[d] - Scalar(t.cell[d]);
      sign[d] = local < Scalar(0) ? -1 : 1;
      size[d] = local < Scalar(0) ? Scalar(-local) : local;
    }
    Frame f;
    f.axis = size[1] > size[0] ? 1 : 0;
    if (size[2] > size[f.axis]) f.axis = 2;
    const int a = (f.axis + 1) % 3, b = (f.axis + 2) % 3;
    f.edgeAxis = size[b] > size[a] ? b : a;
    f.sign = sign[f.axis];
    f.edgeSign = sign[f.edgeAxis];
    t.index = f.index();
    return t;
  }

  template <class Scalar>
  [[nodiscard]] static std::array<std::array<Scalar, 3>, 4> vertices(
      const PartitionTetrahedron& t) {
    const Frame f = frame(t.index);
    std::array<std::array<Scalar, 3>, 4> v;
    const std::array<std::array<int, 3>, 4> halves = {f.offset(0, 0, 0), f.offset(1, 0, 0),
                                                      f.offset(1, 1, 1), f.offset(1, 1, -1)};
    for (int n = 0; n < 4; ++n)
      for (int d = 0; d < 3; ++d) v[n][d] = Scalar(t.cell[d]) + Scalar(halves[n][d]) / Scalar(2);
    return v;
  }

  /// Barycentric coordinates: with X, Y, Z along the axes of the frame, from the centre of the
  /// cube, they are 1 − 2X, 2X − 2Y, Y + Z and Y − Z.
  template <class Scalar>
  [[nodiscard]] static BarycentricMap<4, Scalar> barycentric(const PartitionTetrahedron& t) {
    const Frame f = frame(t.index);
    constexpr int kRows[4][3] = {{-2, 0, 0}, {2, -2, 0}, {0, 1, 1}, {0, 1, -1}};
    BarycentricMap<4, Scalar> map;
    for (int v = 0; v < 4; ++v) {
      const std::array<int, 3> row = f.offset(kRows[v][0], kRows[v][1], kRows[v][2]);
      int constant = v == 0 ? 1 : 0;
      for (int d = 0; d < 3; ++d) constant -= row[d] * t.cell[d];
      map.rows[v] = {Scalar(row[0]), Scalar(row[1]), Scalar(row[2]), Scalar(constant)};
    }
    return map;
  }

  [[nodiscard]] static constexpr PartitionTetrahedron neighbour(PartitionTetrahedron t, int face) {
    Frame f = frame(t.index);
    if (face == 0) {
      t.cell[f.axis] += f.sign;
      f.sign = -f.sign;
    } else if (face == 1) {
      std::swap(f.axis, f.edgeAxis);
      std::swap(f.sign, f.edgeSign);
    } else {
      std::swap(f.edgeAxis, f.thirdAxis);
      f.edgeSign = face == 2 ? -1 : 1;
    }
    t.index = f.index();
    return t;
  }
};

static_assert(TetrahedralPartition<Type6Partition>);

}  // namespace levelset
