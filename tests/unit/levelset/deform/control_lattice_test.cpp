#include "levelset/deform/control_lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "tests/support/measured.h"

namespace control_lattice_test {

using namespace levelset;
using Imath::V3d;

const Imath::Box3d kBox(V3d(-1, 2, 3), V3d(2, 4, 7));

std::vector<V3d> somePoints() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<V3d> points;
  for (int n = 0; n < 200; ++n)
    points.push_back(kBox.min + kBox.size() * V3d(part(random), part(random), part(random)));
  points.push_back(kBox.min);
  points.push_back(kBox.max);
  return points;
}

/// Lattice whose control points are the identity's, each moved by up to `by`.
ControlLattice shaken(const std::array<LatticeAxis, 3>& axes, double by, bool hasWeights = false) {
  LatticeData data = identityLattice(axes, frameOf(kBox)).data();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> offset(-by, by), weight(0.5, 2);
  for (V3d& p : data.points) p += V3d(offset(random), offset(random), offset(random));
  if (hasWeights)
    for (std::size_t n = 0; n < data.points.size(); ++n) data.weights.push_back(weight(random));
  return ControlLattice(std::move(data));
}

double largestDifference(const ControlLattice& lattice, const std::function<V3d(const V3d&)>& map) {
  double worst = 0;
  for (const V3d& p : somePoints()) worst = std::max(worst, (lattice.at(p) - map(p)).length());
  return worst;
}

TEST(ControlLattice, GrevilleAbscissaeGiveTheIdentity) {
  for (const int degree : {1, 2, 3, 7, 20}) {
    const ControlLattice lattice =
        identityLattice({uniformAxis(degree, static_cast<std::size_t>(degree) + 1),
                         uniformAxis(3, 9), uniformAxis(2, 5)},
                        frameOf(kBox));
    EXPECT_TRUE(lattice.isIdentity());
    EXPECT_LT(largestDifference(lattice, [](const V3d& p) { return p; }),
              support::doubleRounding(80))
        << degree;
    for (const V3d& p : somePoints()) {
      const DeformationJet jet = lattice.jet(p);
      for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(jet.slopes[static_cast<std::size_t>(axis)][c], axis == c ? 1 : 0, 3e-13);
    }
  }
}

TEST(ControlLattice, AffineControlPointsGiveAnAffineMap) {
  const auto map = [](const V3d& p) {
    return V3d(1 + 2 * p.x - p.y, p.y + 0.5 * p.z, 3 * p.z - p.x);
  };
  LatticeData data =
      identityLattice({uniformAxis(3, 6), uniformAxis(2, 4), uniformAxis(1, 3)}, frameOf(kBox))
          .data();
  for (V3d& p : data.points) p = map(p);
  const ControlLattice lattice(data);
  EXPECT_FALSE(lattice.isIdentity());
  EXPECT_LT(largestDifference(lattice, map), 3e-14);
  // Equal weights change nothing.
  data.weights.assign(data.points.size(), 2.5);
  EXPECT_LT(largestDifference(ControlLattice(data), map), 3e-14);
}

/// x² and x y have the coefficients of their blossoms.
TEST(ControlLattice, ReproducesPolynomials) {
  LatticeData data{.axes = {uniformAxis(2, 5), uniformAxis(1, 2), uniformAxis(1, 2)},
                   .boxToWorld = frameOf(kBox)};
  const LatticeAxis& axis = data.axes[0];
  for (std::size_t i = 0; i < 5; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) {
        const double a = axis.knots[i + 1], b = axis.knots[i + 2], u = (a + b) / 2;
        data.points.emplace_back(a * b, u * j, k);
      }
  const ControlLattice lattice(data);
  EXPECT_LT(largestDifference(lattice,
                              [&](const V3d& p) {
                                const V3d u = lattice.parameterOf(p);
                                return V3d(u.x * u.x, u.x * u.y, u.z);
                              }),
            1e-15);
}

/// A quarter of a circle is a rational quadratic curve.
TEST(ControlLattice, WeightsMakeExactCircles) {
  LatticeData data{.axes = {uniformAxis(2, 3), uniformAxis(1, 2), uniformAxis(1, 2)},
                   .boxToWorld = frameOf(kBox)};
  const V3d arc[3] = {V3d(1, 0, 0), V3d(1, 1, 0), V3d(0, 1, 0)};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) {
        data.points.push_back(arc[i] * (1 + j) + V3d(0, 0, k));
        data.weights.push_back(i == 1 ? std::sqrt(0.5) : 1);
      }
  const ControlLattice lattice(data);
  for (const V3d& p : somePoints()) {
    const V3d moved = lattice.at(p);
    ASSERT_NEAR(std::hypot(moved.x, moved.y), 1 + lattice.parameterOf(p).y, 1e-15);
  }
}

TEST(ControlLattice, JacobianIsThatOfDifferences) {
  for (const bool hasWeights : {false, true}) {
    const ControlLattice lattice =
        shaken({uniformAxis(3, 7), uniformAxis(2, 3), uniformAxis(4, 6)}, 0.2, hasWeights);
    double worst = 0;
    for (const V3d& p : somePoints()) {
      if (!lattice.contains(p, -1e-3)) continue;
      const DeformationJet jet = lattice.jet(p);
      for (int axis = 0; axis < 3; ++axis) {
        V3d step(0);
        step[axis] = 1e-5;
        const V3d difference = (lattice.at(p + step) - lattice.at(p - step)) / 2e-5;
        worst = std::max(worst, (difference - jet.slopes[static_cast<std::size_t>(axis)]).length());
      }
    }
    EXPECT_LT(worst, hasWeights ? 1e-8 : 2e-9);
  }
}

TEST(ControlLattice, ContinuesLinearlyOutsideItsBox) {
  const ControlLattice lattice =
      shaken({uniformAxis(3, 4), uniformAxis(2, 3), uniformAxis(3, 4)}, 0.2);
  const V3d inside(2, 3, 5), outward(1, 0, 0);
  EXPECT_FALSE(lattice.contains(inside + outward));
  const DeformationJet jet = lattice.jet(inside);
  EXPECT_LT((lattice.at(inside + outward * 0.3) - jet.position - jet.slopes[0] * 0.3).length(),
            1e-14);
}

TEST(ControlLattice, DegreeElevationKeepsTheMap) {
  for (const bool hasWeights : {false, true}) {
    const ControlLattice lattice =
        shaken({uniformAxis(2, 3), uniformAxis(3, 4), uniformAxis(1, 2)}, 0.3, hasWeights);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LT(
          largestDifference(elevated(lattice, axis), [&](const V3d& p) { return lattice.at(p); }),
          1e-14);
  }
  EXPECT_THROW(
      (void)elevated(shaken({uniformAxis(2, 4), uniformAxis(1, 2), uniformAxis(1, 2)}, 0), 0),
      InvalidInput);
}

TEST(ControlLattice, BezierPiecesAreTheSameMap) {
  LatticeAxis uneven{3, {0, 0, 0, 0, 0.2, 0.5, 0.5, 0.9, 1, 1, 1, 1}};
  for (const bool hasWeights : {false, true}) {
    const ControlLattice lattice =
        shaken({uneven, uniformAxis(2, 5), uniformAxis(1, 3)}, 0.2, hasWeights);
    const BezierPieces pieces(lattice);
    EXPECT_EQ(pieces.size(), 4u * 3u * 2u);
    double worst = 0;
    for (std::size_t n = 0; n < pieces.size(); ++n) {
      const BezierPiece piece = pieces.piece(n);
      const std::array<double, 3> local = {0.3, 0.8, 0.6};
      const V3d u = piece.low + (piece.high - piece.low) * V3d(0.3, 0.8, 0.6);
      const V3d value = V3d(valueAt(piece.numerator[0], local), valueAt(piece.numerator[1], local),
                            valueAt(piece.numerator[2], local)) /
                        valueAt(piece.weight, local);
      worst = std::max(worst, (value - lattice.at(lattice.worldOf(u))).length());
    }
    EXPECT_LT(worst, 1e-14);
  }
}

TEST(ControlLattice, TakesAHundredThousandControlPoints) {
  const ControlLattice lattice =
      shaken({uniformAxis(3, 47), uniformAxis(3, 47), uniformAxis(3, 47)}, 0.01);
  EXPECT_EQ(lattice.data().points.size(), 103823u);
  EXPECT_LT(largestDifference(lattice, [](const V3d& p) { return p; }), 0.02);
}

template <class Change>
void expectRefusal(const Change& change, const std::string& part) {
  LatticeData data =
      identityLattice({uniformAxis(2, 3), uniformAxis(1, 2), uniformAxis(1, 3)}, frameOf(kBox))
          .data();
  change(data);
  try {
    (void)ControlLattice(data);
    FAIL() << part;
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(ControlLattice, RefusesWhatIsNoLattice) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectRefusal([&](LatticeData& d) { d.points[4].y = nan; }, "control point 4");
  expectRefusal([&](LatticeData& d) { d.points[4].y = 1e200; }, "control point 4");
  expectRefusal([&](LatticeData& d) { d.points.pop_back(); }, "17 control points");
  expectRefusal([&](LatticeData& d) { d.axes[1].degree = 0; }, "degree of the lattice is 0");
  expectRefusal([&](LatticeData& d) { d.axes[1].degree = 21; }, "degree of the lattice is 21");
  expectRefusal([&](LatticeData& d) { d.axes[2].knots[2] = nan; }, "knot 2 of the lattice along w");
  expectRefusal([&](LatticeData& d) { d.axes[2].knots[2] = 0; }, "inner knot 0 along w");
  expectRefusal([&](LatticeData& d) { d.axes[0].knots[0] = -1; }, "begin with 3 zeros");
  expectRefusal([&](LatticeData& d) { d.axes[0].knots.pop_back(); }, "5 knots along u");
  expectRefusal([&](LatticeData& d) { d.weights = {1}; }, "1 weights for 18");
  expectRefusal(
      [&](LatticeData& d) {
        d.weights.assign(18, 1);
        d.weights[3] = 0;
      },
      "weight 3");
  expectRefusal(
      [&](LatticeData& d) {
        d.weights.assign(18, 1);
        d.weights[5] = nan;
      },
      "weight 5");
  expectRefusal([&](LatticeData& d) { d.boxToWorld[0][0] = 0; }, "box of the lattice is flat");
  expectRefusal([&](LatticeData& d) { d.boxToWorld[3][1] = nan; }, "box of the lattice is flat");
  EXPECT_THROW((void)uniformAxis(0, 3), InvalidInput);
  EXPECT_THROW((void)uniformAxis(3, 3), InvalidInput);
  EXPECT_THROW((void)frameOf(Imath::Box3d()), InvalidInput);
}

}  // namespace control_lattice_test
