#pragma once

#include <array>

#include "levelset/splines/type6_masks.h"
#include "levelset/splines/type6_partition.h"

namespace levelset {

/// Values that determine the cubic C¹ spline on one cube: 8 corners, 24 points of edges, and the
/// centroids of 24 triangles of the faces. Axes are those of the grid; a sign is −1 or 1.
template <class Scalar>
struct CubicDeterminingSet {
  static constexpr int kCount = 56;
  using Signs = std::array<int, 3>;

  std::array<Scalar, 8> corners{};
  std::array<std::array<Scalar, 3>, 8> edges{};      ///< near a corner, along an axis
  std::array<std::array<Scalar, 6>, 6> centroids{};  ///< of a face, next to its edge with a face

  [[nodiscard]] static constexpr int cornerOf(const Signs& s) {
    return (s[0] > 0 ? 1 : 0) + (s[1] > 0 ? 2 : 0) + (s[2] > 0 ? 4 : 0);
  }
  [[nodiscard]] static constexpr int faceOf(int axis, int sign) {
    return 2 * axis + (sign > 0 ? 1 : 0);
  }

  [[nodiscard]] const Scalar& corner(const Signs& s) const { return corners[cornerOf(s)]; }
  [[nodiscard]] const Scalar& edge(const Signs& s, int axis) const {
    return edges[cornerOf(s)][axis];
  }
  /// Centroid on the face of `axis`, next to the edge of the corner `s` along the third axis.
  [[nodiscard]] const Scalar& centroid(const Signs& s, int axis, int edgeAxis) const {
    return centroids[faceOf(axis, s[axis])][faceOf(edgeAxis, s[edgeAxis])];
  }

  /// Coefficient b1002 at a corner.
  [[nodiscard]] Scalar spoke(const Signs& s) const {
    return (edge(s, 0) + edge(s, 1) + edge(s, 2) - corner(s)) / Scalar(2);
  }
  /// Coefficient b1011 at the edge of a corner along an axis.
  [[nodiscard]] Scalar besideEdge(const Signs& s, int along) const {
    const int a = (along + 1) % 3, b = (along + 2) % 3;
    Signs end = s;
    end[along] = -s[along];
    return centroid(s, a, b) + centroid(s, b, a) - (edge(s, along) + edge(end, along)) / Scalar(2);
  }
  /// Coefficient b2001 at a corner.
  [[nodiscard]] Scalar innerSpoke(const Signs& s) const {
    return (besideEdge(s, 0) + besideEdge(s, 1) + besideEdge(s, 2) - spoke(s)) / Scalar(2);
  }
};

/// Cubic C¹ spline on the type-6 partition [Kalbe11]. It does not interpolate: it maps x² to
/// x² + 1/4 (grid spacing 1), and reproduces 1, x, xy and xyz. A tetrahedron depends on 23 data. No
/// weight is negative, so values lie between the smallest and the largest of these data.
class CubicC1Spline : public Type6Partition {
 public:
  static constexpr int kDegree = 3;

  /// Coefficients of a tetrahedron, from the data.
  template <GridSample Sample>
  [[nodiscard]] static BernsteinTetrahedron<3, SampleScalar<Sample>> coefficients(
      const Sample& sample, const PartitionTetrahedron& t) {
    return type6Coefficients<3>(kMasks, type6Neighbourhood(sample, t));
  }

  /// Determining set of a cube, from its 27 data.
  template <GridSample Sample>
  [[nodiscard]] static CubicDeterminingSet<SampleScalar<Sample>> determiningSet(
      const Sample& sample, const std::array<int, 3>& cell) {
    using Scalar = SampleScalar<Sample>;
    CubicDeterminingSet<Scalar> set;
    const auto datum = [&](const std::array<int, 3>& offset) {
      return sample(cell[0] + offset[0], cell[1] + offset[1], cell[2] + offset[2]);
    };
    // The sum of the data at 0 or s along the axes a and b, at `height` along the third axis.
    const auto around = [&](const std::array<int, 3>& s, int a, int b, int height) {
      Scalar sum(0);
      for (int n = 0; n < 4; ++n) {
        std::array<int, 3> offset{};
        offset[a] = n & 1 ? s[a] : 0;
        offset[b] = n & 2 ? s[b] : 0;
        offset[3 - a - b] = height;
        sum += datum(offset);
      }
      return sum;
    };
    // The sum of the data at 0 or s along `axis`, at given offsets along two other axes.
    const auto pair = [&](const std::array<int, 3>& s, int axis, int b, int atB, int c, int atC) {
      std::array<int, 3> offset{};
      offset[b] = atB;
      offset[c] = atC;
      Scalar sum = datum(offset);
      offset[axis] = s[axis];
      return Scalar(sum + datum(offset));
    };
    for (int n = 0; n < 8; ++n) {
      const std::array<int, 3> s = {n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1};
      set.corners[set.cornerOf(s)] = (around(s, 0, 1, 0) + around(s, 0, 1, s[2])) / Scalar(8);
      for (int along = 0; along < 3; ++along) {
        const int a = (along + 1) % 3, b = (along + 2) % 3;
        set.edges[set.cornerOf(s)][along] =
            (Scalar(5) * around(s, a, b, 0) + around(s, a, b, s[along])) / Scalar(24);
        for (const auto& [face, other] : {std::array{a, b}, std::array{b, a}})
          set.centroids[set.faceOf(face, s[face])][set.faceOf(other, s[other])] =
              (Scalar(26) * pair(s, face, other, 0, along, 0) +
               Scalar(14) * pair(s, face, other, s[other], along, 0) +
               Scalar(3) *
                   (pair(s, face, other, 0, along, 1) + pair(s, face, other, 0, along, -1)) +
               pair(s, face, other, s[other], along, 1) +
               pair(s, face, other, s[other], along, -1)) /
              Scalar(96);
      }
    }
    return set;
  }

  /// Coefficients of a tetrahedron by averages of the determining set of its cube.
  template <class Scalar>
  [[nodiscard]] static BernsteinTetrahedron<3, Scalar> coefficients(
      const CubicDeterminingSet<Scalar>& set, int index) {
    const Frame f = frame(index);
    const int x = f.axis, y = f.edgeAxis, z = f.thirdAxis;
    const std::array<int, 3> c2 = f.offset(1, 1, 1), c3 = f.offset(1, 1, -1),
                             d2 = f.offset(1, -1, 1), d3 = f.offset(1, -1, -1);
    const Scalar two(2), four(4);
    BernsteinTetrahedron<3, Scalar> form;
    form.at({0, 0, 3, 0}) = set.corner(c2);
    form.at({0, 0, 0, 3}) = set.corner(c3);
    form.at({0, 0, 2, 1}) = set.edge(c2, z);
    form.at({0, 0, 1, 2}) = set.edge(c3, z);
    form.at({0, 1, 1, 1}) = set.centroid(c2, x, y);
    form.at({0, 1, 2, 0}) = (set.edge(c2, y) + set.edge(c2, z)) / two;
    form.at({0, 1, 0, 2}) = (set.edge(c3, y) + set.edge(c3, z)) / two;
    form.at({0, 2, 1, 0}) = (set.centroid(c2, x, y) + set.centroid(c2, x, z)) / two;
    form.at({0, 2, 0, 1}) = (set.centroid(c3, x, y) + set.centroid(c3, x, z)) / two;
    form.at({0, 3, 0, 0}) = (set.centroid(c2, x, y) + set.centroid(c2, x, z) +
                             set.centroid(d3, x, y) + set.centroid(d3, x, z)) /
                            four;
    form.at({1, 0, 2, 0}) = set.spoke(c2);
    form.at({1, 0, 0, 2}) = set.spoke(c3);
    const Scalar edge = set.besideEdge(c2, z), side2 = set.besideEdge(c2, y),
                 side3 = set.besideEdge(c3, y), opposite = set.besideEdge(d2, z);
    form.at({1, 0, 1, 1}) = edge;
    form.at({1, 1, 1, 0}) = (edge + side2) / two;
    form.at({1, 1, 0, 1}) = (edge + side3) / two;
    form.at({1, 2, 0, 0}) = (edge + side2 + side3 + opposite) / four;
    const Scalar inner2 = set.innerSpoke(c2), inner3 = set.innerSpoke(c3);
    const Scalar near = inner2 + inner3 + set.innerSpoke(d2) + set.innerSpoke(d3);
    Scalar all = near;
    for (const int v : {1, -1})
      for (const int w : {1, -1}) all += set.innerSpoke(f.offset(-1, v, w));
    form.at({2, 0, 1, 0}) = inner2;
    form.at({2, 0, 0, 1}) = inner3;
    form.at({2, 1, 0, 0}) = near / four;
    form.at({3, 0, 0, 0}) = all / Scalar(8);
    return form;
  }

  /// Weights of the data, in the order of the coefficients.
  static constexpr std::array<Type6Mask, 20> kMasks = {{
      Type6Mask{96}
          .with(36, "000")
          .with(8, "100 010 001 00m 0m0 m00")
          .with(1, "110 101 10m 1m0 011 01m 0m1 0mm m10 m01 m0m mm0"),  // b3000
      Type6Mask{192}
          .with(72, "000")
          .with(28, "100")
          .with(16, "010 001 00m 0m0")
          .with(4, "m00")
          .with(3, "110 101 10m 1m0")
          .with(2, "011 01m 0m1 0mm")
          .with(1, "m10 m01 m0m mm0"),  // b2100
      Type6Mask{96}
          .with(36, "000")
          .with(14, "100 010 001")
          .with(2, "00m 0m0 m00 110 101 011")
          .with(1, "10m 1m0 01m 0m1 m10 m01"),  // b2010
      Type6Mask{96}
          .with(36, "000")
          .with(14, "100 010 00m")
          .with(2, "001 0m0 m00 110 10m 01m")
          .with(1, "101 1m0 011 0mm m10 m0m"),  // b2001
      Type6Mask{96}
          .with(32, "000")
          .with(20, "100")
          .with(7, "010 001 00m 0m0")
          .with(3, "110 101 10m 1m0")
          .with(1, "011 01m 0m1 0mm"),  // b1200
      Type6Mask{96}
          .with(32, "000")
          .with(20, "100")
          .with(12, "010 001")
          .with(5, "110 101")
          .with(2, "00m 0m0 011")
          .with(1, "10m 1m0 01m 0m1"),  // b1110
      Type6Mask{96}
          .with(32, "000")
          .with(20, "100")
          .with(12, "010 00m")
          .with(5, "110 10m")
          .with(2, "001 0m0 01m")
          .with(1, "101 1m0 011 0mm"),                                             // b1101
      Type6Mask{12}.with(3, "000").with(2, "100 010 001").with(1, "110 101 011"),  // b1020
      Type6Mask{48}
          .with(16, "000")
          .with(10, "100 010")
          .with(4, "110")
          .with(2, "001 00m")
          .with(1, "101 10m 011 01m"),                                             // b1011
      Type6Mask{12}.with(3, "000").with(2, "100 010 00m").with(1, "110 10m 01m"),  // b1002
      Type6Mask{192}
          .with(52, "000 100")
          .with(10, "010 001 00m 0m0 110 101 10m 1m0")
          .with(1, "011 01m 0m1 0mm 111 11m 1m1 1mm"),  // b0300
      Type6Mask{192}
          .with(52, "000 100")
          .with(17, "010 001 110 101")
          .with(3, "00m 0m0 10m 1m0")
          .with(2, "011 111")
          .with(1, "01m 0m1 11m 1m1"),  // b0210
      Type6Mask{192}
          .with(52, "000 100")
          .with(17, "010 00m 110 10m")
          .with(3, "001 0m0 101 1m0")
          .with(2, "01m 11m")
          .with(1, "011 0mm 111 1mm"),                                                 // b0201
      Type6Mask{24}.with(5, "000 100").with(3, "010 001 110 101").with(1, "011 111"),  // b0120
      Type6Mask{96}
          .with(26, "000 100")
          .with(14, "010 110")
          .with(3, "001 00m 101 10m")
          .with(1, "011 01m 111 11m"),                                                 // b0111
      Type6Mask{24}.with(5, "000 100").with(3, "010 00m 110 10m").with(1, "01m 11m"),  // b0102
      Type6Mask{8}.with(1, "000 100 010 001 110 101 011 111"),                         // b0030
      Type6Mask{24}.with(5, "000 100 010 110").with(1, "001 101 011 111"),             // b0021
      Type6Mask{24}.with(5, "000 100 010 110").with(1, "00m 10m 01m 11m"),             // b0012
      Type6Mask{8}.with(1, "000 100 010 00m 110 10m 01m 11m"),                         // b0003
  }};
};

static_assert(TetrahedralSpline<CubicC1Spline>);

}  // namespace levelset
