#include "levelset/deform/untangle/untangle_deformation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/deform/lattice_certificate.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "tests/support/cages.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"

namespace untangle_test {

using namespace levelset;
using Imath::V3d;

const Imath::Box3d kUnitBox{V3d(0), V3d(1)};

ControlLattice shakenLattice(int degree, std::size_t count, double shake, bool hasWeights) {
  const LatticeAxis axis = uniformAxis(degree, count);
  LatticeData data = identityLattice({axis, axis, axis}, frameOf(kUnitBox)).data();
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (V3d& p : data.points)
    for (int c = 0; c < 3; ++c) p[c] += shake * uniform(generator) / static_cast<double>(count - 1);
  if (hasWeights)
    for (std::size_t n = 0; n < data.points.size(); ++n)
      data.weights.push_back(1 + 0.2 * uniform(generator));
  return ControlLattice(std::move(data));
}

/// With degree 1 along all axes, one corner beyond the opposite face folds the box. The least move
/// is known: the Jacobian is least at that corner, where it is 1 minus the displacement along x.
TEST(Untangle, MovesOneCornerByTheLeastDistance) {
  const LatticeAxis axis = uniformAxis(1, 2);
  LatticeData data = identityLattice({axis, axis, axis}, frameOf(kUnitBox)).data();
  data.points[0].x += 1.2;  // of (0, 0, 0)
  const ControlLattice folded(data);
  ASSERT_EQ(certifyLattice(folded).verdict, FoldVerdict::Folds);
  const UntangledLattice result = untangled(folded);
  const FoldCertificate certificate = certifyLattice(result.lattice);
  EXPECT_EQ(certificate.verdict, FoldVerdict::Certified);
  EXPECT_FALSE(certificate.overlaps);
  // Moving the corner alone takes 0.2375. Four points share a smaller sum of squares.
  EXPECT_EQ(result.report.movedPoints, 4u);
  EXPECT_LT(result.report.rootMeanSquareMove, support::measured(0.0586, 0.2375 / std::sqrt(8.0)));
  EXPECT_LT(result.report.largestMove, support::measured(0.12));
}

TEST(Untangle, LatticesAreCertifiedAfterwards) {
  for (const bool hasWeights : {false, true})
    for (const double shake : {0.5, 0.7}) {
      const ControlLattice folded = shakenLattice(2, 4, shake, hasWeights);
      const FoldCertificate before = certifyLattice(folded);
      ASSERT_EQ(before.verdict, FoldVerdict::Folds);
      const UntangledLattice result = untangled(folded);
      const FoldCertificate after = certifyLattice(result.lattice);
      EXPECT_TRUE(after.isInjective()) << describe(after);
      EXPECT_GT(result.report.largestMove, 0);
      EXPECT_LT(result.report.largestMove, 2 * shake / 3);  // than the shake itself
    }
}

TEST(Untangle, ObeysItsMemoryAndCanBeInterrupted) {
  const ControlLattice folded = shakenLattice(2, 4, 0.7, false);
  EXPECT_THROW((void)untangled(folded, {.maxMemory = 100'000}), ResourceLimit);
  double last = 0;
  int reports = 0;
  EXPECT_THROW((void)untangled(folded, {.progress =
                                            [&](double share) {
                                              EXPECT_GE(share, last);
                                              last = share;
                                              return ++reports < 12;
                                            }}),
               Cancelled);
}

TEST(Untangle, LeavesLatticesWithoutFoldsAsTheyAre) {
  const ControlLattice good = shakenLattice(2, 5, 0.1, false);
  const UntangledLattice result = untangled(good);
  EXPECT_EQ(result.lattice.data().points, good.data().points);
  EXPECT_EQ(result.report.movedPoints, 0u);
  EXPECT_EQ(result.report.rounds, 1u);
}

TEST(Untangle, CagesAreCertifiedAfterwards) {
  const TriMesh rest = support::boxCage(V3d(-1.5), V3d(1.5), 1), ball = support::sphereMesh(0.5);
  TriMesh moved = rest;
  // A face, pushed through the opposite one.
  for (V3d& p : moved.positions)
    if (p.x == 1.5) p.x -= 3.4;
  const DeformationDomain domain{ball.positions, ball.triangles};
  const CageDeformation folded(rest, moved, CageCoordinates::MeanValue);
  const FoldCertificate before = folded.certify(domain).certificate;
  EXPECT_EQ(before.verdict, FoldVerdict::Folds) << describe(before);
  const UntangledCage result = untangled(folded, domain);
  const FoldCertificate after = result.cage.certify(domain).certificate;
  EXPECT_TRUE(after.isInjective()) << describe(after);
  EXPECT_GT(result.report.largestMove, 0.1);
  EXPECT_LT(result.report.largestMove, 3.4);  // than back to rest
}

TEST(Untangle, RefusesWhatItDoesNotRepair) {
  const ControlLattice folded = shakenLattice(2, 5, 1.5, false);
  EXPECT_THROW((void)untangled(folded, {.leastShare = 0}), UsageError);
  EXPECT_THROW((void)untangled(folded, {.leastShare = 1}), UsageError);
  // More than a full turn: no fold, but an overlap.
  const OrientedBox bar{V3d(0), directionsAlong(V3d(0, 0, 1), V3d(1, 0, 0)), V3d(0.3, 0.3, 5)};
  EXPECT_THROW((void)untangled(bendLattice(bar, 7, 1e-6).lattice), InvalidInput);
}

}  // namespace untangle_test
