#include <gtest/gtest.h>

#include <array>

#include "levelset/splines/bcc_quadratic_spline.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "levelset/splines/smoothness.h"
#include "tests/support/rational.h"

namespace spline_smoothness_test {

using namespace levelset;
using support::Rational;

/// Smoothness across all faces of the tetrahedra of a cell, with random data: counts of the
/// conditions that were tested and that hold exactly.
struct Tally {
  int continuity = 0, continuityHolds = 0;
  int slope = 0, slopeHolds = 0;
};

/// @param wanted  called with the tetrahedron, the face's number and the exponents (v0 to v3) of
///                a condition of order 1; chooses those to count
template <class Spline, class Wanted>
Tally tallyOf(const std::array<int, 3>& cell, const Wanted& wanted) {
  Tally tally;
  const support::RandomGrid<> sample{11};
  for (int index = 0; index < Spline::kTetrahedra; ++index) {
    const PartitionTetrahedron t{cell, index};
    const auto vertices = Spline::template vertices<Rational>(t);
    const auto map = barycentricMap(vertices);
    const auto form = Spline::coefficients(sample, t);
    for (int face = 0; face < 4; ++face) {
      const PartitionTetrahedron other = Spline::neighbour(t, face);
      const auto otherVertices = Spline::template vertices<Rational>(other);
      const auto shared = sharedFace(vertices, otherVertices);
      if (!shared) {
        ADD_FAILURE() << "no shared face";
        continue;
      }
      const auto apex = map.coordinates(otherVertices[shared->secondApex]);
      const auto otherForm = Spline::coefficients(sample, other);
      for (const Rational& r : smoothnessResiduals<0>(form, otherForm, *shared, apex)) {
        ++tally.continuity;
        tally.continuityHolds += r == 0;
      }
      const auto residuals = smoothnessResiduals<1>(form, otherForm, *shared, apex);
      const auto conditions = smoothnessConditions<1, Spline::kDegree, Rational>(*shared, apex);
      for (std::size_t n = 0; n < residuals.size(); ++n) {
        std::array<int, 4> exponents{};
        for (int v = 0; v < 3; ++v) exponents[shared->first[v]] = conditions[n].face[v];
        if (!wanted(t, face, exponents)) continue;
        ++tally.slope;
        tally.slopeHolds += residuals[n] == 0;
      }
    }
  }
  return tally;
}

template <class Spline>
void expectC1(const std::array<int, 3>& cell) {
  const Tally tally = tallyOf<Spline>(cell, [](const auto&, int, const auto&) { return true; });
  const int faces = 4 * Spline::kTetrahedra;
  EXPECT_EQ(tally.continuity, faces * bernsteinCount(3, Spline::kDegree));
  EXPECT_EQ(tally.continuityHolds, tally.continuity);
  EXPECT_EQ(tally.slope, faces * bernsteinCount(3, Spline::kDegree - 1));
  EXPECT_EQ(tally.slopeHolds, tally.slope);
}

TEST(SplineSmoothness, OfCubicC1SplineIsExact) {
  expectC1<CubicC1Spline>({3, -1, 4});
}

TEST(SplineSmoothness, OfBccSplinesIsExact) {
  expectC1<BccQuadraticSpline<2>>({2, -4, 6});
  expectC1<BccQuadraticSpline<2>>({3, 1, -5});
  expectC1<BccQuadraticSpline<1>>({0, 0, 0});
  expectC1<BccQuadraticSpline<3>>({1, -1, 1});
}

TEST(SplineSmoothness, OfQuadraticSuperSplineIsExactExceptAtCentres) {
  const std::array<int, 3> cell = {3, -1, 4};
  const auto isAcrossCubes = [](const auto&, int face, const auto&) { return face == 0; };
  const auto isInside = [](const auto&, int face, const auto& e) { return face > 0 && e[0] == 0; };
  const auto isAtCentre = [](const auto&, int face, const auto& e) {
    return face > 0 && e[0] == 1;
  };

  const Tally across = tallyOf<QuadraticSuperSpline>(cell, isAcrossCubes);
  EXPECT_EQ(across.continuity, 24 * 4 * 6);
  EXPECT_EQ(across.continuityHolds, across.continuity);
  EXPECT_EQ(across.slope, 24 * 3);
  EXPECT_EQ(across.slopeHolds, across.slope);

  const Tally inside = tallyOf<QuadraticSuperSpline>(cell, isInside);
  EXPECT_EQ(inside.slope, 24 * 3 * 2);
  EXPECT_EQ(inside.slopeHolds, inside.slope);

  // The third condition of each face inside the cube is the one that this spline gives up.
  const Tally centre = tallyOf<QuadraticSuperSpline>(cell, isAtCentre);
  EXPECT_EQ(centre.slope, 24 * 3);
  EXPECT_EQ(centre.slopeHolds, 0);
}

/// A jump of one coefficient must show, or the tests above would prove nothing.
TEST(SplineSmoothness, FindsOneWrongCoefficient) {
  const support::RandomGrid<> sample{5};
  const PartitionTetrahedron t{{0, 0, 0}, 0};
  const PartitionTetrahedron other = CubicC1Spline::neighbour(t, 1);
  const auto vertices = CubicC1Spline::vertices<Rational>(t);
  const auto otherVertices = CubicC1Spline::vertices<Rational>(other);
  const auto shared = sharedFace(vertices, otherVertices);
  ASSERT_TRUE(shared);
  const auto apex = barycentricMap(vertices).coordinates(otherVertices[shared->secondApex]);
  const auto form = CubicC1Spline::coefficients(sample, t);
  constexpr auto kExponents = bernsteinExponents<4, 3>();
  for (int n = 0; n < form.kCount; ++n) {
    auto wrong = CubicC1Spline::coefficients(sample, other);
    wrong.coefficients[n] += Rational(1) / 1000;
    int found = 0;
    for (const Rational& r : smoothnessResiduals<0>(form, wrong, *shared, apex)) found += r != 0;
    for (const Rational& r : smoothnessResiduals<1>(form, wrong, *shared, apex)) found += r != 0;
    // Conditions of the orders 0 and 1 see the coefficients up to one layer from the face.
    EXPECT_EQ(found, kExponents[n][shared->secondApex] <= 1 ? 1 : 0);
  }
}

/// A C² polynomial has no residuals of order 2 either; a C¹ spline has.
TEST(SplineSmoothness, OfSecondOrderHoldsForPolynomials) {
  const PartitionTetrahedron t{{0, 0, 0}, 5};
  const PartitionTetrahedron other = CubicC1Spline::neighbour(t, 2);
  const auto vertices = CubicC1Spline::vertices<Rational>(t);
  const auto otherVertices = CubicC1Spline::vertices<Rational>(other);
  const auto shared = sharedFace(vertices, otherVertices);
  ASSERT_TRUE(shared);
  const auto apex = barycentricMap(vertices).coordinates(otherVertices[shared->secondApex]);
  const auto residuals = [&](const auto& sample) {
    return smoothnessResiduals<2>(CubicC1Spline::coefficients(sample, t),
                                  CubicC1Spline::coefficients(sample, other), *shared, apex);
  };
  for (const Rational& r :
       residuals([](int i, int j, int k) { return Rational(i * j * k + i * i); }))
    EXPECT_EQ(r, 0);
  int jumps = 0;
  for (const Rational& r : residuals(support::RandomGrid<>{3})) jumps += r != 0;
  EXPECT_EQ(jumps, 3);
}

}  // namespace spline_smoothness_test
