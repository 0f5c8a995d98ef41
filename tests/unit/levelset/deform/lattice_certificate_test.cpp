#include "levelset/deform/lattice_certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "tests/support/threads.h"

namespace lattice_certificate_test {

using namespace levelset;
using Imath::V3d;

const Imath::Box3d kBox(V3d(-1), V3d(1));

ControlLattice shaken(const std::array<LatticeAxis, 3>& axes, double by, bool hasWeights) {
  LatticeData data = identityLattice(axes, frameOf(kBox)).data();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> offset(-by, by), weight(0.8, 1.25);
  for (V3d& p : data.points) p += V3d(offset(random), offset(random), offset(random));
  if (hasWeights)
    for (std::size_t n = 0; n < data.points.size(); ++n) data.weights.push_back(weight(random));
  return ControlLattice(std::move(data));
}

double leastSample(const ControlLattice& lattice, int count) {
  double least = 1e100;
  for (int i = 0; i <= count; ++i)
    for (int j = 0; j <= count; ++j)
      for (int k = 0; k <= count; ++k)
        least = std::min(
            least,
            lattice
                .jet(lattice.worldOf(V3d(double(i) / count, double(j) / count, double(k) / count)))
                .determinant());
  return least;
}

TEST(LatticeCertificate, BracketsTheJacobianOfABend) {
  const OrientedBox box{V3d(0), directionsAlong(V3d(0, 0, 1), V3d(1, 0, 0)), V3d(0.5, 0.3, 2)};
  for (const double angle : {0.5, 1.5, 3.0}) {
    const FoldCertificate found = certifyLattice(bendLattice(box, angle, 1e-9).lattice);
    const double least = 1 - angle * 0.5 / 4;
    EXPECT_EQ(found.verdict, FoldVerdict::Certified);
    EXPECT_FALSE(found.overlaps);
    EXPECT_LT(found.leastLow, least + 1e-6);
    EXPECT_NEAR(found.leastHigh, least, 1e-6);
    EXPECT_GT(found.leastLow, least - 0.01 * least - 1e-6);
    EXPECT_NEAR(found.place.x, 0.5, 1e-12);
  }
  EXPECT_NEAR(certifyLattice(twistLattice(box, 2, 1e-9).lattice).leastHigh, 1, 1e-6);
  EXPECT_NEAR(certifyLattice(taperLattice(box, 0.5).lattice).leastHigh, 0.25, 1e-12);
  EXPECT_NEAR(certifyLattice(stretchLattice(box, 3).lattice).leastLow, 3, 1e-9);
}

TEST(LatticeCertificate, BracketsHoldForShakenLattices) {
  for (const bool hasWeights : {false, true})
    for (const double by : {0.02, 0.1, 0.2}) {
      const ControlLattice lattice =
          shaken({uniformAxis(2, 4), uniformAxis(3, 4), uniformAxis(1, 3)}, by, hasWeights);
      const FoldCertificate found = certifyLattice(lattice);
      const double sampled = leastSample(lattice, 24);
      EXPECT_LE(found.leastLow, sampled) << by;
      EXPECT_LE(found.leastHigh, sampled + 0.01 * std::abs(sampled)) << by;
      EXPECT_LE(found.leastLow, found.leastHigh);
      EXPECT_GT(found.leastLow, found.leastHigh - 0.011 * std::max(std::abs(found.leastHigh), 1.0));
      EXPECT_NE(found.verdict, FoldVerdict::Undecided);
      EXPECT_EQ(found.verdict == FoldVerdict::Folds, found.leastHigh <= 0);
      EXPECT_NEAR(lattice.jet(found.place).determinant(), found.leastHigh, 1e-9);
    }
}

TEST(LatticeCertificate, FindsFoldsBetweenSamples) {
  // The map u + a sin-like dip: cubic in u with a negative slope in a narrow interval.
  LatticeData data =
      identityLattice({uniformAxis(3, 4), uniformAxis(1, 2), uniformAxis(1, 2)}, frameOf(kBox))
          .data();
  // The slope is 3 (Δ0 (1−u)² + 2 Δ1 u (1−u) + Δ2 u²): with 1, −1.001, 1 it is just negative at
  // 1/2.
  const double x[4] = {0, 1, -0.001, 0.999};
  for (std::size_t n = 0; n < 16; ++n) data.points[n].x = x[n / 4];
  const FoldCertificate found = certifyLattice(ControlLattice(data));
  EXPECT_EQ(found.verdict, FoldVerdict::Folds);
  EXPECT_LT(found.leastHigh, 0);
  EXPECT_NEAR(found.place.x, 0, 0.05);
  EXPECT_THROW(requireInjective(found), InvalidInput);
  // With −0.99 it is just positive.
  const double y[4] = {0, 1, 0.01, 1.01};
  for (std::size_t n = 0; n < 16; ++n) data.points[n].x = y[n / 4];
  const FoldCertificate positive = certifyLattice(ControlLattice(data));
  EXPECT_EQ(positive.verdict, FoldVerdict::Certified);
  EXPECT_NEAR(positive.leastHigh, 1.5 * 0.01 / 2, 0.001);
}

TEST(LatticeCertificate, ACollapsedLatticeFolds) {
  LatticeData data =
      identityLattice({uniformAxis(2, 3), uniformAxis(2, 3), uniformAxis(2, 3)}, frameOf(kBox))
          .data();
  for (V3d& p : data.points) p.z = 0;
  EXPECT_EQ(certifyLattice(ControlLattice(data)).verdict, FoldVerdict::Folds);
}

TEST(LatticeCertificate, FindsOverlapsThatDoNotFold) {
  // A bar bent by more than a full turn penetrates itself, and its Jacobian is positive.
  const OrientedBox box{V3d(0), directionsAlong(V3d(0, 0, 1), V3d(1, 0, 0)), V3d(0.3, 0.3, 5)};
  const FoldCertificate open = certifyLattice(bendLattice(box, 6, 1e-6).lattice);
  EXPECT_TRUE(open.isInjective());
  const FoldCertificate closed = certifyLattice(bendLattice(box, 7, 1e-6).lattice);
  EXPECT_EQ(closed.verdict, FoldVerdict::Certified);
  EXPECT_TRUE(closed.overlaps);
  EXPECT_THROW(requireInjective(closed), InvalidInput);
}

TEST(LatticeCertificate, IsTheSameForAnyNumberOfThreads) {
  const ControlLattice lattice =
      shaken({uniformAxis(3, 8), uniformAxis(3, 8), uniformAxis(2, 8)}, 0.02, false);
  const auto figures = [&] {
    const FoldCertificate c = certifyLattice(lattice);
    return std::tuple(c.leastLow, c.leastHigh, c.place.x, c.boxes);
  };
  EXPECT_EQ(support::onThreads(1, figures), support::onThreads(4, figures));
}

TEST(LatticeCertificate, ObeysItsMemory) {
  // The Jacobian of this lattice of degree 6 has 18³ coefficients, 47 kB, in each box.
  const ControlLattice lattice =
      shaken({uniformAxis(6, 7), uniformAxis(6, 7), uniformAxis(6, 7)}, 0.1, false);
  const FoldCertificate found = certifyLattice(lattice, {.maxMemory = 100'000'000});
  EXPECT_GT(found.boxes, 20u);
  EXPECT_THROW((void)certifyLattice(lattice, {.maxMemory = 90'000}), ResourceLimit);
}

TEST(LatticeCertificate, CanBeInterruptedWhileBoxesAreHalved) {
  // The share of the progress is 0.6 before the first box is halved, and 0.8 after the last one.
  const auto isHalving = [](double share) { return share > 0.6 && share < 0.8; };
  for (const std::size_t pieces : {1u, 2u}) {
    const ControlLattice lattice =
        shaken({uniformAxis(6, 6 + pieces), uniformAxis(6, 7), uniformAxis(6, 7)}, 0.1, false);
    std::vector<double> shares;
    const auto note = [&](double share) {
      shares.push_back(share);
      return true;
    };
    // Without a tolerance, boxes are halved up to their limit.
    const FoldCertificate found =
        certifyLattice(lattice, {.tolerance = 0, .mostBoxes = 100, .progress = note});
    EXPECT_EQ(found.pieces, pieces);
    EXPECT_EQ(found.boxes, pieces + 100);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end())) << pieces;
    EXPECT_GE(std::count_if(shares.begin(), shares.end(), isHalving), 3) << pieces;
    // The first report in the loop ends the work.
    double last = 0;
    const auto goOn = [&](double share) {
      last = share;
      return !isHalving(share);
    };
    EXPECT_THROW(
        (void)certifyLattice(lattice, {.tolerance = 0, .mostBoxes = 100, .progress = goOn}),
        Cancelled)
        << pieces;
    EXPECT_PRED1(isHalving, last) << pieces;
    // Shares do not decrease at the limit of the boxes either.
    shares.clear();
    (void)certifyLattice(lattice, {.tolerance = 0, .mostBoxes = 15, .progress = note});
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end())) << pieces;
  }
}

TEST(LatticeCertificate, CertifiesHighDegreesAndManyPieces) {
  EXPECT_EQ(certifyLattice(
                shaken({uniformAxis(20, 21), uniformAxis(2, 3), uniformAxis(2, 3)}, 0.01, false))
                .verdict,
            FoldVerdict::Certified);
  const FoldCertificate many = certifyLattice(
      identityLattice({uniformAxis(3, 40), uniformAxis(3, 40), uniformAxis(3, 40)}, frameOf(kBox)));
  EXPECT_EQ(many.pieces, 37u * 37u * 37u);
  EXPECT_EQ(many.verdict, FoldVerdict::Certified);
}

}  // namespace lattice_certificate_test
