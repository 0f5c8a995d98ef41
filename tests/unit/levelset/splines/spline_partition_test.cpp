#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>
#include <type_traits>

#include "levelset/splines/bcc_grid.h"
#include "levelset/splines/smoothness.h"
#include "levelset/splines/type6_partition.h"
#include "tests/support/rational.h"

namespace spline_partition_test {

using namespace levelset;
using support::Rational;

using Point = std::array<Rational, 3>;

Rational volumeOf(const std::array<Point, 4>& v) {
  std::array<Point, 3> e;
  for (int n = 0; n < 3; ++n)
    for (int d = 0; d < 3; ++d) e[n][d] = v[n + 1][d] - v[0][d];
  const Rational det = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                       e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                       e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
  return (det < 0 ? Rational(-det) : det) / 6;
}

/// Vertices of equal roles have equal numbers. In type 6, v2 and v3 have the same role.
template <class Partition>
int roleOf(int vertex) {
  return std::is_same_v<Partition, Type6Partition> && vertex == 3 ? 2 : vertex;
}

/// Checks numbers, vertices, barycentric coordinates and neighbours of the tetrahedra of a cell.
/// @return volume of the cell
template <class Partition>
Rational checkCell(const std::array<int, 3>& cell) {
  Rational volume = 0;
  std::set<std::set<Point>> distinct;
  for (int index = 0; index < Partition::kTetrahedra; ++index) {
    const PartitionTetrahedron t{cell, index};
    EXPECT_EQ(Partition::frame(index).index(), index);
    const auto vertices = Partition::template vertices<Rational>(t);
    EXPECT_TRUE(distinct.insert({vertices.begin(), vertices.end()}).second);
    volume += volumeOf(vertices);

    // The closed form of the barycentric coordinates against the inverse matrix.
    EXPECT_EQ(Partition::template barycentric<Rational>(t).rows, barycentricMap(vertices).rows);

    // The centroid is located in the tetrahedron itself.
    Point centroid{};
    for (const Point& v : vertices)
      for (int d = 0; d < 3; ++d) centroid[d] += v[d] / 4;
    EXPECT_EQ(Partition::locate(centroid), t);

    for (int face = 0; face < 4; ++face) {
      const PartitionTetrahedron other = Partition::neighbour(t, face);
      const auto shared = sharedFace(vertices, Partition::template vertices<Rational>(other));
      if (!shared) {
        ADD_FAILURE() << "no shared face: " << index << " face " << face;
        continue;
      }
      EXPECT_EQ(shared->firstApex, face);
      EXPECT_EQ(Partition::neighbour(other, shared->secondApex), t);
      for (int v = 0; v < 3; ++v)
        EXPECT_EQ(roleOf<Partition>(shared->first[v]), roleOf<Partition>(shared->second[v]));
    }
  }
  return volume;
}

TEST(SplinePartition, FillsTheCubeOfType6) {
  EXPECT_EQ(checkCell<Type6Partition>({2, -3, 5}), 1);
}

TEST(SplinePartition, FillsTheTruncatedOctahedron) {
  EXPECT_EQ(checkCell<BccPartition>({2, -4, 6}), 4);
  EXPECT_EQ(checkCell<BccPartition>({-3, 1, 7}), 4);
  int squares = 0;
  for (int index = 0; index < BccPartition::kTetrahedra; ++index)
    squares += BccPartition::frame(index).kind == BccPartition::Kind::Square;
  EXPECT_EQ(squares, 48);
}

/// Points whose barycentric coordinates must all be at least zero in the tetrahedron found. Among
/// them are points on faces, edges and vertices.
template <class Partition>
void expectLocation() {
  for (int n = 0; n < 3000; ++n) {
    // Multiples of 1/8 often lie on faces and edges; multiples of 1/77 seldom do.
    const int denominator = n % 2 == 0 ? 8 : 77;
    Point p;
    for (int d = 0; d < 3; ++d) p[d] = Rational(support::randomWhole(3, n, d)) / denominator;
    const PartitionTetrahedron t = Partition::locate(p);
    const auto weights = barycentricMap(Partition::template vertices<Rational>(t)).coordinates(p);
    for (const Rational& w : weights) EXPECT_GE(w, 0);
  }
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-20, 20);
  for (int n = 0; n < 20000; ++n) {
    const std::array<double, 3> p = {uniform(random), uniform(random), uniform(random)};
    const PartitionTetrahedron t = Partition::locate(p);
    const auto weights = Partition::template barycentric<double>(t).coordinates(p);
    // Coordinates up to 20 times rows up to 4, so the roundings are some 80 times that of 1.
    for (const double w : weights) EXPECT_GE(w, -100 * 2.2e-16);
  }
}

TEST(SplinePartition, LocatesPointsInType6) {
  expectLocation<Type6Partition>();
}

TEST(SplinePartition, LocatesPointsInBccCells) {
  expectLocation<BccPartition>();
}

TEST(SplinePartition, FindsTheClosestBccSite) {
  for (int n = 0; n < 2000; ++n) {
    Point p;
    for (int d = 0; d < 3; ++d) p[d] = Rational(support::randomWhole(5, n, d)) / 33;
    const auto distance = [&](const std::array<int, 3>& cell) {
      Rational sum = 0;
      for (int d = 0; d < 3; ++d) {
        const Rational away = p[d] - cell[d] - Rational(1) / 2;
        sum += away * away;
      }
      return sum;
    };
    const std::array<int, 3> found = BccPartition::nearestCell(p);
    EXPECT_EQ((found[0] - found[1]) % 2, 0);
    EXPECT_EQ((found[0] - found[2]) % 2, 0);
    for (const int step : {-2, 2})
      for (int d = 0; d < 3; ++d) {
        auto other = found;
        other[d] += step;
        EXPECT_LE(distance(found), distance(other));
      }
    for (int bits = 0; bits < 8; ++bits)
      EXPECT_LE(distance(found),
                distance({found[0] + (bits & 1 ? 1 : -1), found[1] + (bits & 2 ? 1 : -1),
                          found[2] + (bits & 4 ? 1 : -1)}));
  }
}

TEST(SplinePartition, HasCellsAtVerticesWithAffineWeights) {
  // The weighted centres of the cells give the vertex back.
  for (int index = 0; index < BccPartition::kTetrahedra; ++index) {
    const PartitionTetrahedron t{{2, 4, -2}, index};
    const auto cells = BccPartition::cellsAtVertex(t);
    const auto vertices = BccPartition::vertices<Rational>(t);
    EXPECT_EQ(cells[0], t.cell);
    for (int v = 0; v < 4; ++v) {
      const auto weights = BccPartition::ownerWeights(BccPartition::frame(index).kind, v);
      Point sum{};
      for (int n = 0; n < 4; ++n)
        for (int d = 0; d < 3; ++d)
          sum[d] += Rational(weights[n]) / 8 * (cells[n][d] + Rational(1) / 2);
      EXPECT_EQ(sum, vertices[v]);
    }
  }
}

}  // namespace spline_partition_test
