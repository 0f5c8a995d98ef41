#include "levelset/deform/deform_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include <numbers>

#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "levelset/mesh_sign/mesh_topology.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace deform_mesh_test {

using namespace levelset;
using Imath::V3d;

const auto kAlongZ = directionsAlong(V3d(0, 0, 1), V3d(1, 0, 0));
const OrientedBox kBox{V3d(0), kAlongZ, V3d(1, 1, 2)};
const double kAngle = 1.5;

TriMesh bar() {
  return support::boxMesh(V3d(-0.5, -0.5, -2), V3d(0.5, 0.5, 2));
}

TEST(DeformMesh, DividesTrianglesWithoutCracks) {
  const ControlLattice lattice = bendLattice(kBox, kAngle, 1e-9).lattice;
  double last = 0;
  for (const double tolerance : {0.04, 0.01, 0.0025}) {
    const DeformMeshResult result = deformMesh(bar(), lattice, {.tolerance = tolerance});
    EXPECT_LE(result.bend, tolerance);
    EXPECT_GT(result.halvedEdges, 0u);
    EXPECT_TRUE(convert::findTopology(result.mesh).isClosed());
    EXPECT_EQ(result.mesh.positions.size(), 8 + result.halvedEdges);
    // The sides of the bent bar are parts of cylinders and planes.
    const double ring = 4 / kAngle;
    double worst = 0;
    for (const auto& t : result.mesh.triangles) {
      const V3d middle = (result.mesh.positions[t[0]] + result.mesh.positions[t[1]] +
                          result.mesh.positions[t[2]]) /
                         3;
      const double r = std::hypot(middle.x - ring, middle.z);
      const V3d end = V3d(middle.x - ring, 0, middle.z);
      const double turn = std::atan2(end.z, -end.x);
      worst = std::max(worst, std::min({std::abs(r - ring - 0.5), std::abs(r - ring + 0.5),
                                        std::abs(std::abs(middle.y) - 0.5),
                                        std::abs(std::abs(turn) - kAngle / 2) * r}));
    }
    EXPECT_LT(worst, support::measured(0.85, 4 / 3.0) * tolerance);
    // The volume is the integral of the Jacobian: that of the bar.
    const double volume = signedVolume(result.mesh) - 4;
    EXPECT_LT(std::abs(volume), support::measured(0.97) * tolerance);
    if (last > 0) {
      EXPECT_LT(std::abs(volume), 0.3 * last);
    }
    last = std::abs(volume);
  }
  const DeformMeshResult whole = deformMesh(bar(), lattice);
  EXPECT_EQ(whole.mesh.triangles.size(), bar().triangles.size());
  EXPECT_EQ(whole.halvedEdges, 0u);
  EXPECT_GT(whole.bend, 0.1);
}

TEST(DeformMesh, DividesBothSidesOfSeamsAlike) {
  // Triangles with vertices of their own: each edge is a seam.
  const TriMesh soup = support::soup(bar());
  const ControlLattice lattice = twistLattice(kBox, 2, 1e-9).lattice;
  const DeformMeshResult result = deformMesh(soup, lattice, {.tolerance = 0.005});
  EXPECT_FALSE(convert::findTopology(soup).triangles.empty());
  EXPECT_TRUE(convert::findTopology(result.mesh).isClosed());
  EXPECT_EQ(convert::findTopology(result.mesh).dropped, 0u);
}

TEST(DeformMesh, NormalsStayPerpendicular) {
  TriMesh ball = support::sphereMesh(0.8);
  for (const V3d& p : ball.positions) ball.attributes.normals.push_back(p.normalized());
  for (const V3d& p : ball.positions) ball.attributes.uvs.emplace_back(p.x, p.y);
  const OrientedBox box{V3d(0), kAlongZ, V3d(1)};
  const DeformMeshResult result =
      deformMesh(ball, stretchLattice(box, 3).lattice, {.tolerance = 0.1});
  ASSERT_EQ(result.mesh.attributes.normals.size(), ball.positions.size());
  EXPECT_EQ(result.mesh.attributes.uvs, ball.attributes.uvs);
  for (std::size_t n = 0; n < result.mesh.positions.size(); ++n) {
    const V3d p = result.mesh.positions[n];
    const V3d normal = V3d(p.x, p.y, p.z / 9).normalized();
    ASSERT_LT((result.mesh.attributes.normals[n] - normal).length(), 1e-14);
  }
}

TEST(DeformMesh, TheIdentityKeepsTheBits) {
  const TriMesh ball = support::sphereMesh(0.8);
  const ControlLattice lattice = identityLattice(
      {uniformAxis(3, 4), uniformAxis(3, 6), uniformAxis(1, 2)}, frameOf({V3d(-1), V3d(1.5)}));
  const DeformMeshResult result = deformMesh(ball, lattice, {.tolerance = 1e-6});
  EXPECT_EQ(result.mesh.positions, ball.positions);
  EXPECT_EQ(result.mesh.triangles, ball.triangles);
}

TEST(DeformMesh, IsTheSameForAnyNumberOfThreads) {
  const ControlLattice lattice = twistLattice(kBox, 2, 1e-9).lattice;
  const auto run = [&] { return deformMesh(bar(), lattice, {.tolerance = 0.002}).mesh; };
  const TriMesh one = support::onThreads(1, run), four = support::onThreads(4, run);
  EXPECT_EQ(one.positions, four.positions);
  EXPECT_EQ(one.triangles, four.triangles);
}

TEST(DeformPoints, MovesPointsNormalsAndRadii) {
  PointCloud cloud{.positions = {V3d(0.3, 0.2, 0.5), V3d(-0.4, 0.1, 0)},
                   .normals = {Imath::V3f(0, 1, 1), Imath::V3f(1, 0, 0)},
                   .radii = {0.5f, 1.f}};
  const OrientedBox box{V3d(0), kAlongZ, V3d(1)};
  const PointCloud moved = deformPoints(cloud, stretchLattice(box, 8).lattice).cloud;
  EXPECT_LT((moved.positions[0] - V3d(0.3, 0.2, 4)).length(), 1e-14);
  EXPECT_LT((moved.normals[0] - Imath::V3f(0, 8, 1).normalized()).length(), 1e-6f);
  EXPECT_NEAR(moved.radii[0], 1, 1e-6);
  EXPECT_NEAR(moved.radii[1], 2, 1e-6);
  EXPECT_THROW((void)deformPoints(cloud, stretchLattice({V3d(0), kAlongZ, V3d(0.25)}, 2).lattice),
               InvalidInput);
}

TEST(DeformMesh, RefusesWhatItCannotDeform) {
  const ControlLattice lattice = twistLattice(kBox, 2, 1e-9).lattice;
  EXPECT_THROW((void)deformMesh(bar(), lattice, {.tolerance = -1}), UsageError);
  EXPECT_THROW((void)deformMesh(bar(), lattice, {.tolerance = 1e-9, .maxMemory = 1000000}),
               ResourceLimit);
  EXPECT_THROW((void)deformMesh(bar(), bendLattice(kBox, 4.5, 1e-6).lattice), InvalidInput);
  TriMesh far = bar();
  far.positions[3].z = 9;
  EXPECT_THROW((void)deformMesh(far, lattice), InvalidInput);
}

}  // namespace deform_mesh_test
