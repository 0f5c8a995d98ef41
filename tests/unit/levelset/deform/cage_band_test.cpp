// Solids, meshes and points moved by cages, and the certificate.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/cage/cage_bounds.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/deform_mesh.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/cages.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace cage_band_test {

using namespace levelset;
using Imath::V3d;
using support::measured;
using support::measuredOrder;

/// A box cage with vertices shaken at random, by `shake` of their distance.
CageDeformation shaken(unsigned n, double shake, CageCoordinates kind) {
  const TriMesh rest = support::boxCage(V3d(-1.5), V3d(1.5), n);
  TriMesh moved = rest;
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (V3d& p : moved.positions)
    for (int axis = 0; axis < 3; ++axis) p[axis] += uniform(generator) * shake * 3 / n;
  return {rest, moved, kind};
}

CageDeformation stretchedCage(double factor) {
  const TriMesh rest = support::boxCage(V3d(-2.4), V3d(2.4), 1);
  return {rest,
          support::transformed(rest, [&](const V3d& p) { return V3d(p.x, p.y, factor * p.z); }),
          CageCoordinates::MeanValue};
}

/// Distance of an ellipsoid of revolution about z with half axes 1, 1, c, by Newton's method.
double ellipsoidDistance(const V3d& p, double c) {
  const double r = std::hypot(p.x, p.y), z = std::abs(p.z);
  double t = std::atan2(z, c * r);
  for (int step = 0; step < 60; ++step) {
    const double s = std::sin(t), k = std::cos(t);
    const double f = -(k - r) * s + (c * s - z) * c * k;
    const double slope = s * s - (k - r) * k + c * c * k * k - (c * s - z) * c * s;
    t = std::clamp(t - f / slope, 0.0, std::numbers::pi / 2);
  }
  const double distance = std::hypot(std::cos(t) - r, c * std::sin(t) - z);
  return r * r + z * z / (c * c) < 1 ? -distance : distance;
}

TEST(SlowCageBand, AnAffineCageMakesAnEllipsoidOfABall) {
  const double figures[] = {1.64e-3, 4.2e-4, 1.05e-4};  // voxels, on both sides
  double last = 0;
  int level = 0;
  const CageDeformation cage = stretchedCage(1.6);
  for (const double voxelSize : {0.16, 0.08, 0.04}) {
    const NarrowBand band = deformBand(makeSphere(1, V3d(0), voxelSize), cage).band;
    double inside = 0, outside = 0, beside = 0;
    support::forEachActive(band, [&](const V3d& p, double phi) {
      const double truth = ellipsoidDistance(p, 1.6), off = std::abs(phi - truth) / voxelSize;
      (truth < 0 ? inside : outside) = std::max(truth < 0 ? inside : outside, off);
      if (std::abs(truth) < voxelSize) beside = std::max(beside, off);
    });
    const double figure = figures[level++];
    EXPECT_LT(inside, measured(figure));
    EXPECT_LT(outside, measured(figure));
    if (last > 0) {
      EXPECT_GT(std::log2(last / (beside * voxelSize)), measuredOrder(2.97, 2));
    }
    last = beside * voxelSize;
  }
}

/// The volume of a solid after a smooth deformation is the integral of the Jacobian, here by sums
/// over the grid of the ball.
TEST(SlowCageBand, VolumeIsTheIntegralOfTheJacobian) {
  for (const CageCoordinates kind : {CageCoordinates::MeanValue, CageCoordinates::Green}) {
    const CageDeformation cage = shaken(1, 0.08, kind);
    double exact = 0;
    // Gauss points along the radius, equal steps of z and of the turn.
    constexpr int kTurns = 24;
    const double radii[] = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};
    const double weights[] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    for (int i = 0; i < kTurns; ++i)
      for (int j = 0; j < 2 * kTurns; ++j)
        for (int part = 0; part < 2; ++part)
          for (int g = 0; g < 3; ++g) {
            const double r = 0.8 * 0.5 * (part + radii[g]), z = 2 * (i + 0.5) / kTurns - 1,
                         turn = std::numbers::pi * (j + 0.5) / kTurns, flat = std::sqrt(1 - z * z);
            const V3d p(r * flat * std::cos(turn), r * flat * std::sin(turn), r * z);
            exact += weights[g] * 0.4 * r * r * cage.jet(p).determinant() * 2 * std::numbers::pi /
                     (kTurns * kTurns);
          }
    const NarrowBand band = deformBand(makeSphere(0.8, V3d(0), 0.08), cage).band;
    EXPECT_NEAR(measure(band).volume / exact, 1, measured(7.9e-6, 1e-4));
  }
}

TEST(SlowCageBand, TheIdentityKeepsTheBits) {
  const NarrowBand ball = makeSphere(1, V3d(0.1, 0.2, 0.3), 0.1);
  const TriMesh rest = support::boxCage(V3d(-2.5), V3d(2.5), 1);
  const CageDeformation cage(rest, rest, CageCoordinates::Green);
  const DeformBandResult result = deformBand(ball, cage);
  EXPECT_EQ(result.band.contentHash(), ball.contentHash());
  EXPECT_EQ(result.certificate.leastHigh, 1);
}

TEST(SlowCageBand, IsTheSameForAnyNumberOfThreads) {
  const auto run = [] {
    const CageDeformation cage = shaken(1, 0.1, CageCoordinates::Green);
    const DeformBandResult result = deformBand(makeSphere(0.6, V3d(0), 0.1), cage);
    return std::pair(result.band.contentHash(), result.certificate.leastLow);
  };
  EXPECT_EQ(support::onThreads(1, run), support::onThreads(4, run));
}

/// Each point of a ball has a Jacobian within the bounds of the ball.
TEST(CageCertificate, BoundsContainTheJacobianInEachBall) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&] {
    const double x = uniform(generator), y = uniform(generator);
    return V3d(x, y, uniform(generator));
  };
  int bounded = 0;
  double tightest = 0;
  for (const CageCoordinates kind : {CageCoordinates::MeanValue, CageCoordinates::Green}) {
    const CageDeformation cage = shaken(2, 0.2, kind);
    for (int ball = 0; ball < 60; ++ball) {
      const V3d centre = random() * 1.2;
      const double radius =
          0.08 * (1.4 - std::max({std::abs(centre.x), std::abs(centre.y), std::abs(centre.z)}));
      const cage::BallBounds bounds = cage::ballBounds(cage, centre, radius);
      if (!bounds.isBounded) continue;
      ++bounded;
      double largest = 0;
      for (int n = 0; n < 20; ++n) {
        const V3d p = centre + random().normalized() * radius;
        const DeformationJet jet = cage.jet(p);
        EXPECT_GE(jet.determinant(), bounds.least);
        for (std::size_t axis = 0; axis < 3; ++axis)
          largest = std::max(largest, (jet.slopes[axis] - bounds.centre.slopes[axis]).length());
      }
      EXPECT_LE(largest, bounds.spread);
      tightest = std::max(tightest, largest / bounds.spread);
    }
  }
  EXPECT_GT(bounded, 100);
  EXPECT_GT(tightest, 0.1);  // a bound that is never near is no bound to rely on
}

TEST(CageCertificate, FindsFoldsAndPlaces) {
  // Opposite faces change places: the Jacobian is negative in the middle.
  const TriMesh rest = support::boxCage(V3d(-1.5), V3d(1.5), 1);
  TriMesh turned = support::transformed(rest, [](const V3d& p) { return V3d(-p.x, p.y, p.z); });
  const TriMesh ball = support::sphereMesh(0.8);
  const FoldCertificate folded = CageDeformation(rest, turned, CageCoordinates::MeanValue)
                                     .certify({ball.positions, ball.triangles})
                                     .certificate;
  EXPECT_EQ(folded.verdict, FoldVerdict::Folds);
  EXPECT_NEAR(folded.leastHigh, -1, 1e-9);
  EXPECT_LT(folded.place.length(), 1);
  const CageDeformation gentle = shaken(1, 0.1, CageCoordinates::MeanValue);
  const CertifiedDeformation good = gentle.certify({ball.positions, ball.triangles});
  EXPECT_EQ(good.certificate.verdict, FoldVerdict::Certified);
  EXPECT_GE(good.certificate.leastLow, 0.25 * good.certificate.leastHigh);
  // The inverse finds points from a guess far away.
  ASSERT_TRUE(good.inverse);
  double worst = 0;
  for (std::size_t n = 0; n < ball.positions.size(); n += 29) {
    const auto found = good.inverse->near(gentle.at(ball.positions[n]), V3d(0.5, 0, 0));
    ASSERT_TRUE(found);
    worst = std::max(worst, (*found - ball.positions[n]).length());
  }
  EXPECT_LT(worst, 1e-10);
  EXPECT_FALSE(good.inverse->near(V3d(5, 5, 5), V3d(0)));
}

std::string refusalOf(const TriMesh& mesh, const CageDeformation& cage) {
  try {
    (void)deformMesh(mesh, cage);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(CageCertificate, RefusesSurfacesThatReachTheCage) {
  const TriMesh ball = support::sphereMesh(1.6);
  for (const CageCoordinates kind : {CageCoordinates::MeanValue, CageCoordinates::Green})
    EXPECT_NE(refusalOf(ball, shaken(1, 0.05, kind)).find("leaves it near"), std::string::npos);
  EXPECT_NE(refusalOf(support::transformed(support::sphereMesh(0.3),
                                           [](const V3d& p) { return p + V3d(3, 0, 0); }),
                      shaken(1, 0.05, CageCoordinates::Green))
                .find("leaves it near"),
            std::string::npos);
}

TEST(CageMesh, MovesMeshesAndPoints) {
  const CageDeformation cage = shaken(1, 0.1, CageCoordinates::Green);
  const TriMesh ball = support::sphereMesh(0.8);
  const DeformMeshResult mesh = deformMesh(ball, cage, {.tolerance = 0.01});
  ASSERT_GE(mesh.mesh.positions.size(), ball.positions.size());
  for (std::size_t n = 0; n < ball.positions.size(); ++n)
    ASSERT_EQ(mesh.mesh.positions[n], cage.at(ball.positions[n]));
  EXPECT_LE(mesh.bend, 0.01);
  PointCloud cloud{.positions = ball.positions};
  const DeformPointsResult points = deformPoints(cloud, cage);
  EXPECT_EQ(points.cloud.positions[7], cage.at(ball.positions[7]));
  EXPECT_GT(points.certificate.leastHigh, 0);
  cloud.positions.emplace_back(9, 9, 9);
  EXPECT_THROW((void)deformPoints(cloud, cage), InvalidInput);
}

}  // namespace cage_band_test
