#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <vector>

#include "levelset/splines/bcc_quadratic_spline.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/determining_set.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "tests/support/rational.h"

namespace spline_properties_test {

using namespace levelset;
using support::Rational;

using Point = std::array<Rational, 3>;
using Offset = std::array<int, 3>;

Point randomPoint(int seed) {
  Point p;
  for (int d = 0; d < 3; ++d) p[d] = Rational(support::randomWhole(seed, d)) / 17;
  return p;
}

/// Weights of the data in each coefficient of a tetrahedron, found by data that are one at a single
/// place and zero elsewhere.
template <class Spline>
auto weightsOf(const PartitionTetrahedron& t) {
  std::map<Offset, std::array<Rational, bernsteinCount(4, Spline::kDegree)>> weights;
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j)
      for (int k = -4; k <= 4; ++k) {
        const Offset place = {t.cell[0] + i, t.cell[1] + j, t.cell[2] + k};
        const auto form = Spline::coefficients(
            [&](int x, int y, int z) {
              return Rational(Offset{x, y, z} == place ? 1 : 0);
            },
            t);
        if (std::any_of(form.coefficients.begin(), form.coefficients.end(),
                        [](const Rational& w) { return w != 0; }))
          weights[place] = form.coefficients;
      }
  return weights;
}

/// Checks a few tetrahedra of a cell.
/// @param norm  the largest sum of the magnitudes of the weights of a coefficient
template <class Spline>
void expectWeights(const Offset& cell, int data, const Rational& norm) {
  for (int index = 0; index < Spline::kTetrahedra; index += Spline::kTetrahedra / 24 * 5 + 1) {
    const auto weights = weightsOf<Spline>({cell, index});
    EXPECT_EQ(static_cast<int>(weights.size()), data) << "tetrahedron " << index;
    Rational largest = 0;
    for (int c = 0; c < bernsteinCount(4, Spline::kDegree); ++c) {
      Rational sum = 0, magnitudes = 0;
      for (const auto& [place, w] : weights) {
        sum += w[c];
        magnitudes += abs(w[c]);
      }
      EXPECT_EQ(sum, 1) << "coefficient " << c;
      largest = std::max(largest, magnitudes);
    }
    EXPECT_EQ(largest, norm) << "tetrahedron " << index;
  }
}

TEST(SplineProperties, HaveWeightsThatSumToOneOverTheirStencils) {
  // The coefficient b1100 of the quadratic super spline has the weights −1/64 at four data.
  expectWeights<QuadraticSuperSpline>({1, -2, 3}, 27, Rational(9) / 8);
  expectWeights<CubicC1Spline>({1, -2, 3}, 23, 1);
  expectWeights<BccQuadraticSpline<2>>({1, -1, 3}, 28, Rational(5) / 4);
  // The factor k − 3 or k − 1 of some weights is zero for k = 3 and k = 1.
  expectWeights<BccQuadraticSpline<3>>({1, -1, 3}, 24, 1);
  expectWeights<BccQuadraticSpline<5>>({2, 4, -2}, 28, 1);
}

TEST(SplineProperties, BoundValuesByTheLargestDatum) {
  // The largest sum of magnitudes of the weights of a value, at the points of a fine mesh.
  const auto largest = [](const auto& weights, const auto& exponents) {
    Rational result = 0;
    for (const auto& e : exponents) {
      const auto point = bernsteinDomainPoint<Rational>(e);
      Rational sum = 0;
      for (const auto& [place, w] : weights) {
        BernsteinTetrahedron<2, Rational> form{w};
        sum += abs(form.value(point));
      }
      result = std::max(result, sum);
    }
    return result;
  };
  EXPECT_EQ(largest(weightsOf<QuadraticSuperSpline>({{0, 0, 0}, 3}), bernsteinExponents<4, 8>()),
            Rational(9) / 8);
}

/// Polynomial of degree two, or three with the term xyz, with its derivatives.
struct Polynomial {
  int seed;
  int ofXyz = 0;

  [[nodiscard]] Rational c(int n) const { return Rational(support::randomWhole(seed, n)) / 3; }
  [[nodiscard]] Rational operator()(const Point& p) const {
    return c(0) + c(1) * p[0] + c(2) * p[1] + c(3) * p[2] + c(4) * p[0] * p[1] +
           c(5) * p[0] * p[2] + c(6) * p[1] * p[2] + c(7) * p[0] * p[0] + c(8) * p[1] * p[1] +
           c(9) * p[2] * p[2] + ofXyz * p[0] * p[1] * p[2];
  }
  [[nodiscard]] Rational operator()(int i, int j, int k) const {
    return (*this)(Point{Rational(i), Rational(j), Rational(k)});
  }
  /// An eighth of the Laplacian: the difference that the splines make.
  [[nodiscard]] Rational bias() const { return (c(7) + c(8) + c(9)) / 4; }
  [[nodiscard]] Point gradient(const Point& p) const {
    return {c(1) + c(4) * p[1] + c(5) * p[2] + 2 * c(7) * p[0] + ofXyz * p[1] * p[2],
            c(2) + c(4) * p[0] + c(6) * p[2] + 2 * c(8) * p[1] + ofXyz * p[0] * p[2],
            c(3) + c(5) * p[0] + c(6) * p[1] + 2 * c(9) * p[2] + ofXyz * p[0] * p[1]};
  }
  [[nodiscard]] std::array<Point, 3> hessian(const Point& p) const {
    const Rational xy = c(4) + ofXyz * p[2], xz = c(5) + ofXyz * p[1], yz = c(6) + ofXyz * p[0];
    return {{{2 * c(7), xy, xz}, {xy, 2 * c(8), yz}, {xz, yz, 2 * c(9)}}};
  }
};

template <class Spline>
void expectReproduction(int ofXyz) {
  for (int n = 0; n < 60; ++n) {
    const Polynomial p{.seed = n, .ofXyz = ofXyz};
    const Point x = randomPoint(100 + n);
    const auto found = splineDerivatives(Spline{}, p, x);
    EXPECT_EQ(found.value, p(x) + p.bias());
    EXPECT_EQ(found.gradient, p.gradient(x));
    EXPECT_EQ(found.hessian, p.hessian(x));
    EXPECT_EQ(splineValue(Spline{}, p, x), found.value);
  }
}

TEST(SplineProperties, ReproduceQuadraticsUpToAConstant) {
  expectReproduction<QuadraticSuperSpline>(0);
  expectReproduction<CubicC1Spline>(0);
  expectReproduction<BccQuadraticSpline<2>>(0);
}

TEST(SplineProperties, OnlyTheCubicReproducesXyz) {
  expectReproduction<CubicC1Spline>(5);
  const auto xyz = [](int i, int j, int k) { return Rational(i * j * k); };
  const Point x = randomPoint(1);
  EXPECT_NE(splineValue(QuadraticSuperSpline{}, xyz, x), Rational(x[0] * x[1] * x[2]));
  EXPECT_NE(splineValue(BccQuadraticSpline<2>{}, xyz, x), Rational(x[0] * x[1] * x[2]));
}

TEST(SplineProperties, BccSplinesReproduceLinesAtTheData) {
  const auto linear = [](int i, int j, int k) { return Rational(2 * i - 3 * j + 5 * k + 1); };
  for (int n = 0; n < 50; ++n) {
    std::array<int, 3> d;
    for (int axis = 0; axis < 3; ++axis) d[axis] = support::randomWhole(n, axis);
    const Point x = {Rational(d[0]), Rational(d[1]), Rational(d[2])};
    const Rational exact = linear(d[0], d[1], d[2]);
    EXPECT_EQ(splineValue(BccQuadraticSpline<1>{}, linear, x), exact);
    EXPECT_EQ(splineValue(BccQuadraticSpline<3>{}, linear, x), exact);
    EXPECT_EQ(splineValue(BccQuadraticSpline<7>{}, linear, x), exact);
  }
}

TEST(SplineProperties, BccSplineHasTheWorkedCoefficients) {
  // The tetrahedron of the proof in [Kalbe11], its cell's centre at the origin of the functions.
  BccPartition::Frame frame;
  frame.kind = BccPartition::Kind::Square;
  const PartitionTetrahedron t{{0, 0, 0}, frame.index()};
  const std::array<Rational, 3> expected = {1, Rational(3) / 8, Rational(1) / 8};
  for (int d = 0; d < 3; ++d) {
    const auto sample = [d](int i, int j, int k) {
      return Rational(std::array<int, 3>{i, j, k}[d]) - Rational(1) / 2;
    };
    EXPECT_EQ((BccQuadraticSpline<2>::coefficients(sample, t).at({0, 0, 1, 1})), expected[d]);
  }
}

/// Weights of the eight data of a cell as the thesis prints them, by the rank of a datum in the
/// direction of the second vertex of the coefficient.
std::array<int, 8> printedWeights(BccPartition::Kind kind, int vertex, bool isHexagonEdge, int k) {
  using Kind = BccPartition::Kind;
  if (vertex == 0) return {k, k, k, k, k, k, k, k};
  if (vertex == 3) return {k + 3, k + 3, k + 1, k + 1, k - 1, k - 1, k - 3, k - 3};
  if (vertex == 2)
    return isHexagonEdge
               ? std::array<int, 8>{k + 3, k + 3, k, k, k, k, k - 3, k - 3}
               : std::array<int, 8>{k + 3, k + 2, k + 2, k + 1, k - 1, k - 2, k - 2, k - 3};
  return kind == Kind::Square
             ? std::array<int, 8>{k + 2, k + 2, k + 2, k + 2, k - 2, k - 2, k - 2, k - 2}
             : std::array<int, 8>{k + 3, k + 1, k + 1, k + 1, k - 1, k - 1, k - 1, k - 3};
}

template <int K>
void expectPrintedWeights(const Offset& cell) {
  const support::RandomGrid<> sample{23};
  constexpr auto kExponents = bernsteinExponents<4, 2>();
  for (int index = 0; index < BccPartition::kTetrahedra; ++index) {
    const PartitionTetrahedron t{cell, index};
    const BccPartition::Kind kind = BccPartition::frame(index).kind;
    const auto cells = BccPartition::cellsAtVertex(t);
    const auto vertices = BccPartition::vertices<Rational>(t);
    const auto form = BccQuadraticSpline<K>::coefficients(sample, t);
    for (int c = 0; c < form.kCount; ++c) {
      int a = 0, b = 3;
      while (kExponents[c][a] == 0) ++a;
      while (kExponents[c][b] == 0) --b;
      Rational expected = 0;
      for (int n = 0; n < 4; ++n) {
        const int share = BccPartition::ownerWeights(kind, a)[n];
        if (share == 0) continue;
        Point direction;
        for (int d = 0; d < 3; ++d) direction[d] = vertices[b][d] - cells[n][d] - Rational(1) / 2;
        // The data in the order of their projections: the order of their distances from the vertex.
        std::array<std::array<int, 3>, 8> order;
        for (int m = 0; m < 8; ++m) order[m] = {m & 1, m >> 1 & 1, m >> 2 & 1};
        const auto along = [&](const std::array<int, 3>& bit) {
          Rational sum = 0;
          for (int d = 0; d < 3; ++d) sum += bit[d] * direction[d];
          return sum;
        };
        std::stable_sort(order.begin(), order.end(),
                         [&](const auto& p, const auto& q) { return along(p) > along(q); });
        // An edge between two hexagons is in a plane of two axes, seen from the cell.
        const bool isHexagonEdge = std::count(direction.begin(), direction.end(), Rational(0)) == 1;
        const auto weights = printedWeights(kind, b, isHexagonEdge, K);
        for (int m = 0; m < 8; ++m)
          expected += Rational(share) / 8 * weights[m] / (8 * K) *
                      sample(cells[n][0] + order[m][0], cells[n][1] + order[m][1],
                             cells[n][2] + order[m][2]);
      }
      EXPECT_EQ(form.coefficients[c], expected) << "tetrahedron " << index << " coefficient " << c;
    }
  }
}

TEST(SplineProperties, BccSplineHasThePrintedWeights) {
  expectPrintedWeights<1>({0, 2, -4});
  expectPrintedWeights<2>({1, 3, -5});
  expectPrintedWeights<3>({2, 0, 0});
}

TEST(SplineProperties, DeterminingSetsGiveTheSameCoefficients) {
  const support::RandomGrid<> sample{31};
  const std::array<int, 3> cell = {-2, 7, 1};
  const auto quadratic = QuadraticSuperSpline::determiningSet(sample, cell);
  const auto cubic = CubicC1Spline::determiningSet(sample, cell);
  for (int index = 0; index < Type6Partition::kTetrahedra; ++index) {
    EXPECT_EQ(QuadraticSuperSpline::coefficients(quadratic, index).coefficients,
              QuadraticSuperSpline::coefficients(sample, {cell, index}).coefficients);
    EXPECT_EQ(CubicC1Spline::coefficients(cubic, index).coefficients,
              CubicC1Spline::coefficients(sample, {cell, index}).coefficients);
  }
}

/// Mesh of one cell of a partition.
template <class Partition>
struct CellMesh {
  std::vector<Point> vertices;
  std::vector<std::array<int, 4>> tetrahedra;

  explicit CellMesh(const std::array<int, 3>& cell) {
    std::map<Point, int> numbers;
    for (int index = 0; index < Partition::kTetrahedra; ++index) {
      std::array<int, 4>& tetrahedron = tetrahedra.emplace_back();
      const auto corners = Partition::template vertices<Rational>({cell, index});
      for (int v = 0; v < 4; ++v) {
        const auto [it, isNew] = numbers.try_emplace(corners[v], static_cast<int>(vertices.size()));
        if (isNew) vertices.push_back(corners[v]);
        tetrahedron[v] = it->second;
      }
    }
  }
};

template <int Degree>
std::vector<int> unknownsOf(const SmoothnessSystem<Degree, Rational>& system, int tetrahedra,
                            const std::vector<std::array<int, 4>>& exponents) {
  std::vector<int> set;
  for (int t = 0; t < tetrahedra; ++t)
    for (const auto& e : exponents) set.push_back(system.unknown(t, e));
  std::sort(set.begin(), set.end());
  set.erase(std::unique(set.begin(), set.end()), set.end());
  return set;
}

TEST(DeterminingSet, OfTheQuadraticSuperSplineHas20Coefficients) {
  const CellMesh<Type6Partition> cube({0, 0, 0});
  // All conditions but those at the centre of the cube.
  const SmoothnessSystem<2, Rational> system(
      cube.vertices, cube.tetrahedra,
      [](int, const std::array<int, 4>& face) { return face[0] == 0; });
  EXPECT_EQ(system.coefficientCount(), 65);
  const auto set = unknownsOf(system, 24, {{0, 0, 0, 2}, {0, 0, 2, 0}, {0, 0, 1, 1}});
  EXPECT_EQ(set.size(), 20u);
  // The averages at the centre of the cube and of its faces are two further choices: without the
  // conditions at the centre, b2000 and b1100 are free.
  EXPECT_FALSE(system.isDeterminingSet(set));
  auto withAverages = set;
  for (const int n : unknownsOf(system, 24, {{2, 0, 0, 0}, {1, 1, 0, 0}}))
    withAverages.push_back(n);
  EXPECT_TRUE(system.isDeterminingSet(withAverages));
  for (std::size_t n = 0; n < set.size(); ++n) {
    auto fewer = withAverages;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_FALSE(system.isDeterminingSet(fewer)) << n;
  }
}

TEST(DeterminingSet, OfTheCubicC1SplineHas56Coefficients) {
  const CellMesh<Type6Partition> cube({0, 0, 0});
  const SmoothnessSystem<3, Rational> system(cube.vertices, cube.tetrahedra);
  EXPECT_EQ(system.coefficientCount(), 175);
  auto set = unknownsOf(system, 24,
                        {{0, 0, 0, 3}, {0, 0, 3, 0}, {0, 0, 2, 1}, {0, 0, 1, 2}, {0, 1, 1, 1}});
  EXPECT_EQ(set.size(), 56u);
  EXPECT_TRUE(system.isDeterminingSet(set));
}

TEST(DeterminingSet, OfBccCellsIsThatOfTheThesis) {
  const CellMesh<BccPartition> cell({0, 0, 0});
  const SmoothnessSystem<2, Rational> system(cell.vertices, cell.tetrahedra);
  EXPECT_TRUE(system.isDeterminingSet(unknownsOf(system, 144, {{0, 0, 1, 1}, {0, 0, 0, 2}})));
  EXPECT_FALSE(system.isDeterminingSet(unknownsOf(system, 144, {{0, 0, 0, 2}})));
}

TEST(DeterminingSet, FindsKnownDimensions) {
  // Two tetrahedra at a face: C⁰ quadratics have 14 coefficients, of which C¹ takes away 3.
  const std::vector<Point> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 3, 1}};
  const SmoothnessSystem<2, Rational> two(vertices, {{0, 1, 2, 3}, {4, 1, 2, 3}});
  EXPECT_EQ(two.coefficientCount(), 14);
  EXPECT_EQ(two.dimension(), 11);
  // The same with floating-point numbers.
  const std::vector<std::array<double, 3>> rounded = {
      {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 3, 1}};
  EXPECT_EQ((SmoothnessSystem<2, double>(rounded, {{0, 1, 2, 3}, {4, 1, 2, 3}}).dimension()), 11);
}

/// Restriction of a spline to a segment inside one tetrahedron.
template <class Spline>
void expectSegments() {
  const support::RandomGrid<> sample{41};
  for (int n = 0; n < 40; ++n) {
    const PartitionTetrahedron t = Spline::locate(randomPoint(n));
    const auto vertices = Spline::template vertices<Rational>(t);
    const auto inside = [&](int seed) {
      std::array<Rational, 4> w;
      Rational sum = 0;
      for (int v = 0; v < 4; ++v) sum += w[v] = support::randomWhole(seed, v) + 51;
      Point p{};
      for (int v = 0; v < 4; ++v)
        for (int d = 0; d < 3; ++d) p[d] += w[v] / sum * vertices[v][d];
      return p;
    };
    const Point a = inside(2 * n), b = inside(2 * n + 1);
    const auto line = restrictToSegment(Spline::coefficients(sample, t),
                                        Spline::template barycentric<Rational>(t), a, b);
    for (int s = 0; s <= 5; ++s) {
      Point p;
      for (int d = 0; d < 3; ++d) p[d] = a[d] + Rational(s) / 5 * (b[d] - a[d]);
      EXPECT_EQ(lineValue(line, Rational(Rational(s) / 5)), splineValue(Spline{}, sample, p));
    }
  }
}

TEST(SplineProperties, RestrictToSegments) {
  expectSegments<QuadraticSuperSpline>();
  expectSegments<CubicC1Spline>();
  expectSegments<BccQuadraticSpline<2>>();
}

}  // namespace spline_properties_test
