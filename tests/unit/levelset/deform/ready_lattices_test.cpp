#include "levelset/deform/ready_lattices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/deform/lattice_inverse.h"
#include "levelset/error.h"
#include "tests/support/measured.h"

namespace ready_lattices_test {

using namespace levelset;
using Imath::V3d;

const OrientedBox kBox{V3d(1, 2, 3), directionsAlong(V3d(1, 1, 2), V3d(1, 0, 0)), V3d(0.5, 0.4, 2)};

std::vector<V3d> pointsIn(const OrientedBox& box) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(-1, 1);
  std::vector<V3d> points;
  for (int n = 0; n < 500; ++n) {
    V3d p = box.centre;
    for (int axis = 0; axis < 3; ++axis)
      p += box.directions[static_cast<std::size_t>(axis)] * (part(random) * box.halfSize[axis]);
    points.push_back(p);
  }
  return points;
}

template <class Map>
double largestError(const ControlLattice& lattice, const OrientedBox& box, const Map& map) {
  double worst = 0;
  for (const V3d& p : pointsIn(box)) worst = std::max(worst, (lattice.at(p) - map(p)).length());
  return worst;
}

TEST(ReadyLattices, KeepTheirTolerance) {
  for (const double angle : {-2.0, 0.3, 1.5, 3.0})
    for (const double tolerance : {1e-3, 1e-6, 1e-10}) {
      const ReadyLattice bend = bendLattice(kBox, angle, tolerance),
                         twist = twistLattice(kBox, angle, tolerance);
      EXPECT_LE(bend.error, tolerance);
      EXPECT_LE(twist.error, tolerance);
      // The reported error is that of test points; others exceed it by less than 1 %.
      EXPECT_LE(
          largestError(bend.lattice, kBox, [&](const V3d& p) { return bent(kBox, angle, p); }),
          1.01 * bend.error + 1e-14);
      EXPECT_LE(
          largestError(twist.lattice, kBox, [&](const V3d& p) { return twisted(kBox, angle, p); }),
          1.01 * twist.error + 1e-14);
    }
}

TEST(ReadyLattices, TaperAndStretchAreExact) {
  const ReadyLattice taper = taperLattice(kBox, 0.4), stretch = stretchLattice(kBox, 1.7);
  EXPECT_LT(taper.error, support::doubleRounding(20));
  EXPECT_LT(stretch.error, support::doubleRounding(20));
  EXPECT_LT(largestError(taper.lattice, kBox, [](const V3d& p) { return tapered(kBox, 0.4, p); }),
            support::doubleRounding(30));
  EXPECT_LT(
      largestError(stretch.lattice, kBox, [](const V3d& p) { return stretched(kBox, 1.7, p); }),
      support::doubleRounding(30));
}

/// The ends of a bent box enclose its angle, and its middle line keeps its length.
TEST(ReadyLattices, ABendTurnsItsEnds) {
  const OrientedBox box{V3d(0), directionsAlong(V3d(0, 0, 1), V3d(1, 0, 0)), V3d(0.5, 0.4, 2)};
  const double angle = M_PI / 2, radius = 4 / angle;
  EXPECT_LT((bent(box, angle, V3d(0)) - V3d(0)).length(), 1e-15);
  const V3d end = bent(box, angle, V3d(0, 0, 2));
  EXPECT_NEAR(end.x, radius * (1 - std::sqrt(0.5)), 1e-14);
  EXPECT_NEAR(end.z, radius * std::sqrt(0.5), 1e-14);
  EXPECT_LT((bent(box, 1e-9, V3d(0.3, 0.2, 1)) - V3d(0.3, 0.2, 1)).length(), 1e-9);
  EXPECT_TRUE(bendLattice(box, 0, 1e-6).lattice.isIdentity());
  EXPECT_TRUE(taperLattice(box, 1).lattice.isIdentity());
}

/// Splines of degree 5 have order 6, so a tolerance 64³ times smaller takes 8 times the spans.
TEST(ReadyLattices, TheErrorFallsWithTheSixthPowerOfTheSpans) {
  const auto spans = [](double tolerance) {
    return spanCount(twistLattice(kBox, 3, tolerance).lattice.data().axes[2]);
  };
  EXPECT_EQ(spans(1e-4), 4u);
  EXPECT_EQ(spans(1e-4 / 64 / 64 / 64), 32u);
}

TEST(ReadyLattices, InverseFindsEachPoint) {
  const ControlLattice lattice = bendLattice(kBox, 2, 1e-9).lattice;
  const LatticeInverse inverse(lattice);
  double worst = 0;
  int missing = 0;
  for (const V3d& p : pointsIn(kBox)) {
    const V3d moved = lattice.at(p);
    const auto found = inverse.at(moved), near = inverse.near(moved, kBox.centre);
    if (!found || !near) {
      ++missing;
      continue;
    }
    worst = std::max({worst, (*found - p).length(), (*near - p).length()});
  }
  EXPECT_EQ(missing, 0);
  EXPECT_LT(worst, 1e-10);
  EXPECT_FALSE(inverse.at(kBox.centre + V3d(10, 0, 0)));
}

TEST(ReadyLattices, RefuseWhatTheyCannotDo) {
  EXPECT_THROW((void)bendLattice(kBox, 101, 1e-6), UsageError);
  EXPECT_THROW((void)bendLattice(kBox, NAN, 1e-6), UsageError);
  EXPECT_THROW((void)twistLattice(kBox, 1, 0), UsageError);
  EXPECT_THROW((void)twistLattice(kBox, 1, 1e-18), InvalidInput);
  EXPECT_THROW((void)taperLattice(kBox, 0), UsageError);
  EXPECT_THROW((void)stretchLattice(kBox, -1), UsageError);
  EXPECT_THROW((void)directionsAlong(V3d(0), V3d(0)), UsageError);
  EXPECT_THROW((void)directionsAlong(V3d(0, 0, 1), V3d(0, 0, 2)), UsageError);
  EXPECT_THROW((void)boxAround({}, directionsAlong(V3d(0, 0, 1), V3d(0)), 0), InvalidInput);
}

}  // namespace ready_lattices_test
