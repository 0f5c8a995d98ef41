#pragma once

#include <array>

#include "levelset/splines/type6_masks.h"
#include "levelset/splines/type6_partition.h"

namespace levelset {

/// Values that determine the quadratic super spline on one cube: 8 corners and 12 middles of edges.
/// Stored at offsets of −1, 0 or 1 half spacings from the centre; other offsets are unused.
template <class Scalar>
struct QuadraticDeterminingSet {
  static constexpr int kCount = 20;
  std::array<Scalar, 27> values{};

  [[nodiscard]] static constexpr int position(const std::array<int, 3>& halves) {
    return 9 * (halves[0] + 1) + 3 * (halves[1] + 1) + halves[2] + 1;
  }
  [[nodiscard]] const Scalar& at(const std::array<int, 3>& halves) const {
    return values[position(halves)];
  }
  /// Coefficient between the centre of the cube and a corner.
  [[nodiscard]] Scalar spoke(const std::array<int, 3>& corner) const {
    Scalar sum = -at(corner);
    for (int d = 0; d < 3; ++d) {
      std::array<int, 3> edge = corner;
      edge[d] = 0;
      sum += at(edge);
    }
    return sum / Scalar(2);
  }
};

/// Quadratic super spline on the type-6 partition [Kalbe11]. It is C⁰, and C¹ across the faces of
/// the cubes. Inside a cube, one of the three C¹ conditions of each face does not hold: the
/// condition at the centre of the cube. It does not interpolate: it maps x² to x² + 1/4 (grid
/// spacing 1), and reproduces 1, x and xy. A tetrahedron depends on 27 data. Some weights are
/// negative; values are at most 9/8 of the largest datum.
class QuadraticSuperSpline : public Type6Partition {
 public:
  static constexpr int kDegree = 2;

  /// Coefficients of a tetrahedron, from the data.
  template <GridSample Sample>
  [[nodiscard]] static BernsteinTetrahedron<2, SampleScalar<Sample>> coefficients(
      const Sample& sample, const PartitionTetrahedron& t) {
    return type6Coefficients<2>(kMasks, type6Neighbourhood(sample, t));
  }

  /// Determining set of a cube, from its 27 data.
  template <GridSample Sample>
  [[nodiscard]] static QuadraticDeterminingSet<SampleScalar<Sample>> determiningSet(
      const Sample& sample, const std::array<int, 3>& cell) {
    using Scalar = SampleScalar<Sample>;
    QuadraticDeterminingSet<Scalar> set;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          if ((x == 0) + (y == 0) + (z == 0) > 1) continue;
          // The mean of the data around a middle of an edge (4) or a corner (8).
          Scalar sum(0);
          for (int n = 0; n < 8; ++n)
            sum += sample(cell[0] + (n & 1 ? x : 0), cell[1] + (n & 2 ? y : 0),
                          cell[2] + (n & 4 ? z : 0));
          set.values[set.position({x, y, z})] = sum / Scalar(8);
        }
    return set;
  }

  /// Coefficients of a tetrahedron by averages of the determining set of its cube.
  template <class Scalar>
  [[nodiscard]] static BernsteinTetrahedron<2, Scalar> coefficients(
      const QuadraticDeterminingSet<Scalar>& set, int index) {
    const Frame f = frame(index);
    const auto at = [&](int x, int y, int z) -> const Scalar& { return set.at(f.offset(x, y, z)); };
    const auto spoke = [&](int x, int y, int z) { return set.spoke(f.offset(x, y, z)); };
    const Scalar two(2), four(4);
    const Scalar near = spoke(1, 1, 1) + spoke(1, 1, -1) + spoke(1, -1, 1) + spoke(1, -1, -1);
    const Scalar far = spoke(-1, 1, 1) + spoke(-1, 1, -1) + spoke(-1, -1, 1) + spoke(-1, -1, -1);
    BernsteinTetrahedron<2, Scalar> form;
    form.at({2, 0, 0, 0}) = (near + far) / Scalar(8);
    form.at({1, 1, 0, 0}) = near / four;
    form.at({1, 0, 1, 0}) = spoke(1, 1, 1);
    form.at({1, 0, 0, 1}) = spoke(1, 1, -1);
    form.at({0, 2, 0, 0}) = (at(1, 1, 0) + at(1, -1, 0) + at(1, 0, 1) + at(1, 0, -1)) / four;
    form.at({0, 1, 1, 0}) = (at(1, 1, 0) + at(1, 0, 1)) / two;
    form.at({0, 1, 0, 1}) = (at(1, 1, 0) + at(1, 0, -1)) / two;
    form.at({0, 0, 2, 0}) = at(1, 1, 1);
    form.at({0, 0, 1, 1}) = at(1, 1, 0);
    form.at({0, 0, 0, 2}) = at(1, 1, -1);
    return form;
  }

  /// Weights of the data, in the order of the coefficients.
  static constexpr std::array<Type6Mask, 10> kMasks = {{
      Type6Mask{128}
          .with(40, "000")
          .with(12, "100 010 001 00m 0m0 m00")
          .with(2, "110 101 10m 1m0 011 01m 0m1 0mm m10 m01 m0m mm0")
          .with(-1, "111 11m 1m1 1mm m11 m1m mm1 mmm"),  // b2000
      Type6Mask{64}
          .with(20, "000")
          .with(12, "100")
          .with(6, "010 001 00m 0m0")
          .with(2, "110 101 10m 1m0")
          .with(1, "011 01m 0m1 0mm")
          .with(-1, "111 11m 1m1 1mm"),  // b1100
      Type6Mask{16}
          .with(5, "000")
          .with(3, "100 010 001")
          .with(1, "110 101 011")
          .with(-1, "111"),  // b1010
      Type6Mask{16}
          .with(5, "000")
          .with(3, "100 010 00m")
          .with(1, "110 10m 01m")
          .with(-1, "11m"),                                                         // b1001
      Type6Mask{16}.with(4, "000 100").with(1, "010 001 00m 0m0 110 101 10m 1m0"),  // b0200
      Type6Mask{8}.with(2, "000 100").with(1, "010 001 110 101"),                   // b0110
      Type6Mask{8}.with(2, "000 100").with(1, "010 00m 110 10m"),                   // b0101
      Type6Mask{8}.with(1, "000 100 010 001 110 101 011 111"),                      // b0020
      Type6Mask{4}.with(1, "000 100 010 110"),                                      // b0011
      Type6Mask{8}.with(1, "000 100 010 00m 110 10m 01m 11m"),                      // b0002
  }};
};

static_assert(TetrahedralSpline<QuadraticSuperSpline>);

}  // namespace levelset
