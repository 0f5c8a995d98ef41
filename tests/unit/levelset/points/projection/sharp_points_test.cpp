#include "tests/unit/levelset/points/projection/sharp_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "levelset/error.h"
#include "levelset/points/meshing/points_to_mesh.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/unit/levelset/points/projection/mesh_topology.h"

/// Meshes of points that keep sharp edges.
namespace sharp_points_test {

using Imath::V3d;
using levelset::PointCloud;
using levelset::pointsToMesh;
using levelset::PointsToMeshReport;
using levelset::PointsToMeshResult;
using levelset::signedVolume;
using levelset::TriMesh;
using levelset::UsageError;
using projected_points::topologyOf;
using sharp_points::pointsOf;
using support::doubleRounding;
using support::measured;
using support::measuredOrder;
using support::refusal;

constexpr double kAngle = std::numbers::pi / 6;

void expectClosedMesh(const PointsToMeshResult& result, long euler) {
  const projected_points::Topology topology = topologyOf(result.mesh);
  EXPECT_TRUE(topology.isManifold);
  EXPECT_EQ(topology.borderEdges, 0u);
  EXPECT_EQ(topology.euler, euler);
  EXPECT_EQ(result.report.incomplete, 0u);
}

void expectSharp(const PointsToMeshReport& report, std::size_t pieces, std::size_t curves,
                 std::size_t corners) {
  EXPECT_EQ(report.pieces, pieces);
  EXPECT_EQ(report.sharpCurves, curves);
  EXPECT_EQ(report.sharpCorners, corners);
}

/// Length of the edges whose triangles have normals that differ by more than 0.4 radians.
double sharpLength(const TriMesh& mesh) {
  const auto normal = [&](const std::array<std::uint32_t, 3>& t) {
    const V3d& a = mesh.positions[t[0]];
    return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).normalized();
  };
  std::map<std::array<std::uint32_t, 2>, V3d> sides;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) sides[{t[i], t[(i + 1) % 3]}] = normal(t);
  double sum = 0;
  for (const auto& [side, own] : sides) {
    const auto other = sides.find({side[1], side[0]});
    if (side[0] < side[1] && other != sides.end() && own.dot(other->second) < std::cos(0.4))
      sum += (mesh.positions[side[0]] - mesh.positions[side[1]]).length();
  }
  return sum;
}

double nearestVertex(const TriMesh& mesh, const V3d& position) {
  double least = INFINITY;
  for (const V3d& p : mesh.positions) least = std::min(least, (p - position).length());
  return least;
}

double worstBoxDistance(const TriMesh& mesh, const V3d& size) {
  double worst = 0;
  for (const V3d& p : mesh.positions) worst = std::max(worst, sharp_points::boxDistance(p, size));
  return worst;
}

TEST(SharpPoints, OfACubeHaveItsEdgesAndCorners) {
  const PointCloud cloud = pointsOf(sharp_points::cubeMesh(), 3000);
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 6, 12, 8);
  EXPECT_EQ(result.report.roundedPairs, 0u);
  EXPECT_EQ(result.report.filled, 0u);
  EXPECT_LT(worstBoxDistance(result.mesh, V3d(1)), doubleRounding(4));
  EXPECT_NEAR(signedVolume(result.mesh), 1, doubleRounding(10));
  EXPECT_NEAR(result.report.sharpLength, 12, doubleRounding(200));
  EXPECT_NEAR(sharpLength(result.mesh), 12, doubleRounding(200));
  for (int corner = 0; corner < 8; ++corner)
    EXPECT_LT(nearestVertex(result.mesh, V3d(corner & 1, corner >> 1 & 1, corner >> 2)),
              doubleRounding(4));
  // Without the option, edges are rounded and corners are cut off.
  const PointsToMeshResult rounded = pointsToMesh(cloud);
  EXPECT_EQ(rounded.report.pieces, 0u);
  EXPECT_GT(std::abs(signedVolume(rounded.mesh) - 1), 1e-4);
  EXPECT_GT(nearestVertex(rounded.mesh, V3d(0)), 0.005);
}

TEST(SharpPoints, OfAGridOnACubeHaveItsEdges) {
  PointCloud cloud;
  constexpr int kSide = 14;
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j)
      for (int k = 0; k <= kSide; ++k)
        if (i % kSide == 0 || j % kSide == 0 || k % kSide == 0)
          cloud.positions.push_back(V3d(i, j, k) / kSide);
  // Some points lie on the edges.
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 6, 12, 8);
  EXPECT_NEAR(signedVolume(result.mesh), 1, doubleRounding(10));
}

TEST(SharpPoints, OfARotatedBoxFarFromTheOriginHaveItsEdges) {
  PointCloud cloud = pointsOf(sharp_points::prism({{0, 0}, {1.5, 0}, {1.5, 1}, {0, 1}}, 0.6), 3000);
  const V3d u = V3d(1, 2, 2) / 3, v = V3d(2, 1, -2) / 3, w = u.cross(v);
  for (V3d& p : cloud.positions) p = u * p.x + v * p.y + w * p.z + V3d(1e6, -1e6, 1e6);
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 6, 12, 8);
  EXPECT_NEAR(signedVolume(result.mesh) / 0.9, 1, measured(6.9e-12));
  EXPECT_NEAR(sharpLength(result.mesh), 12.4, measured(5.5e-11));
}

TEST(SharpPoints, OfABracketHaveItsConcaveEdge) {
  const PointsToMeshResult result =
      pointsToMesh(pointsOf(sharp_points::bracketMesh(), 2000), {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 8, 18, 12);
  EXPECT_NEAR(signedVolume(result.mesh) / 2.31, 1, doubleRounding(20));
  EXPECT_NEAR(sharpLength(result.mesh), 22, doubleRounding(400));
  EXPECT_LT(nearestVertex(result.mesh, V3d(0.7, 0.7, 0)), doubleRounding(8));
}

TEST(SharpPoints, WithNormalsHaveTheSameEdges) {
  const PointCloud cloud = sampleMesh(sharp_points::bracketMesh(), {.count = 2000});
  ASSERT_FALSE(cloud.normals.empty());
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 8, 18, 12);
  EXPECT_NEAR(signedVolume(result.mesh) / 2.31, 1, doubleRounding(20));
}

TEST(SharpPoints, OfAnOctahedronHaveCornersOfFourFaces) {
  TriMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  const PointsToMeshResult result = pointsToMesh(pointsOf(mesh, 1500), {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 8, 12, 6);
  EXPECT_NEAR(signedVolume(result.mesh) / (4.0 / 3), 1, doubleRounding(20));
  for (const V3d& corner : mesh.positions)
    EXPECT_LT(nearestVertex(result.mesh, corner), doubleRounding(8));
}

TEST(SharpPoints, OfATetrahedronHaveEdgesOfSharpWedges) {
  // Without the option, the rounded surface of wedges of 71 degrees is wrong.
  TriMesh mesh;
  mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  const PointsToMeshResult result = pointsToMesh(pointsOf(mesh, 1500), {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 4, 6, 4);
  EXPECT_NEAR(signedVolume(result.mesh) / (8.0 / 3), 1, doubleRounding(20));
  for (const V3d& corner : mesh.positions)
    EXPECT_LT(nearestVertex(result.mesh, corner), doubleRounding(20));
}

TEST(SharpPoints, OfTwoCubesHaveTheEdgesOfBoth) {
  TriMesh mesh = sharp_points::cubeMesh(), cavity = mesh;
  for (V3d& p : cavity.positions) p = p * 0.5 + V3d(0.25);
  for (auto& t : cavity.triangles) std::swap(t[0], t[1]);
  append(mesh, cavity);
  const PointsToMeshResult result = pointsToMesh(pointsOf(mesh, 2000), {.sharpAngle = kAngle});
  expectClosedMesh(result, 4);
  EXPECT_EQ(result.report.components, 2u);
  expectSharp(result.report, 12, 24, 16);
  EXPECT_NEAR(signedVolume(result.mesh), 0.875, doubleRounding(20));
}

/// Largest distance of the vertices from a cylinder of radius 1 and height 1.5.
double cylinderError(const PointsToMeshResult& result) {
  double worst = 0;
  for (const V3d& p : result.mesh.positions) {
    const double radius = std::hypot(p.x, p.y) - 1, height = std::max(-p.z, p.z - 1.5);
    worst = std::max(worst, std::abs(std::max(radius, height)));
  }
  return worst;
}

TEST(SharpPoints, OfACylinderConvergeToItsRims) {
  std::vector<double> errors;
  for (const std::size_t count : {1000u, 2000u, 4000u}) {
    const PointsToMeshResult result =
        pointsToMesh(sharp_points::cylinder(count), {.sharpAngle = kAngle});
    expectClosedMesh(result, 2);
    expectSharp(result.report, 3, 2, 0);
    EXPECT_NEAR(result.report.sharpLength / (4 * std::numbers::pi), 1, measured(2.25e-4));
    errors.push_back(cylinderError(result));
  }
  EXPECT_LT(errors[0], measured(1.01e-3));
  EXPECT_LT(errors[2], measured(8.61e-5));
  // The spacing halves.
  EXPECT_GT(std::log2(errors[0] / errors[2]), measuredOrder(3.55));
}

TEST(SharpPoints, KeepTheEdgesOfANoisyCube) {
  PointCloud cloud = pointsOf(sharp_points::cubeMesh(), 3000);
  const double spacing = projected_points::hexagonalSpacing(6, cloud.size());
  projected_points::addNoise(cloud, 0.1 * spacing);
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  expectSharp(result.report, 6, 12, 8);
  EXPECT_LT(worstBoxDistance(result.mesh, V3d(1)) / spacing, measured(0.229));
  EXPECT_NEAR(signedVolume(result.mesh), 1, measured(7.4e-4));
  EXPECT_NEAR(result.report.sharpLength, 12, measured(0.0036));
}

TEST(SharpPoints, OfSmoothSurfacesHaveTheSameBitsAsWithoutTheOption) {
  for (const PointCloud& cloud : {projected_points::sphere(1000), projected_points::torus(1500),
                                  sharp_points::fadingEdge(2000)}) {
    const PointsToMeshResult plain = pointsToMesh(cloud),
                             sharp = pointsToMesh(cloud, {.sharpAngle = kAngle});
    expectSharp(sharp.report, 0, 0, 0);
    EXPECT_EQ(sharp.mesh.positions, plain.mesh.positions);
    EXPECT_EQ(sharp.mesh.triangles, plain.mesh.triangles);
  }
}

TEST(SharpPoints, RoundAnEdgeThatFadesOut) {
  const PointsToMeshResult result =
      pointsToMesh(sharp_points::fadingEdge(3000), {.sharpAngle = kAngle});
  expectClosedMesh(result, 2);
  EXPECT_GT(result.report.roundedPairs, 20u);
  double worst = 0;
  for (const V3d& p : result.mesh.positions)
    worst = std::max(worst, std::abs(p.length() - sharp_points::fadingRadius(p.normalized())));
  EXPECT_LT(worst, measured(0.0234));
}

TEST(SharpPoints, RoundEdgesThatMeetABorder) {
  TriMesh mesh = sharp_points::cubeMesh();
  std::erase_if(mesh.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return mesh.positions[v].z == 1; });
  });
  const PointsToMeshResult result = pointsToMesh(pointsOf(mesh, 1500), {.sharpAngle = kAngle});
  EXPECT_TRUE(topologyOf(result.mesh).isManifold);
  EXPECT_EQ(topologyOf(result.mesh).euler, 1);
  EXPECT_EQ(result.report.borders, 1u);
  EXPECT_GT(result.report.roundedPairs, 100u);
}

TEST(SharpPoints, KeepABorderBesideASharpEdge) {
  // A cylinder without its upper disc: a sharp rim, and a border.
  PointCloud cloud;
  for (const V3d& p : sharp_points::cylinder(3000).positions)
    if (p.z < 1.5) cloud.positions.push_back(p);
  const PointsToMeshResult result = pointsToMesh(cloud, {.sharpAngle = kAngle});
  EXPECT_TRUE(topologyOf(result.mesh).isManifold);
  EXPECT_EQ(topologyOf(result.mesh).euler, 1);
  EXPECT_EQ(result.report.borders, 1u);
  expectSharp(result.report, 2, 1, 0);
}

TEST(SharpPoints, HaveTheSameBitsForAnyNumberOfThreads) {
  PointCloud cylinder = sharp_points::cylinder(1500);
  projected_points::addNoise(cylinder, 0.005);
  PointCloud cubes = pointsOf(sharp_points::cubeMesh(), 1500);
  projected_points::addNoise(cubes, 0.002);
  for (std::size_t i = 0, count = cubes.size(); i < count; ++i)
    cubes.positions.push_back(cubes.positions[i] + V3d(3, 0, 0));
  const auto expectSame = [](const PointCloud& cloud, std::size_t pieces, std::size_t curves,
                             std::size_t corners) {
    const auto run = [&](std::size_t threads) {
      return support::onThreads(threads,
                                [&] { return pointsToMesh(cloud, {.sharpAngle = kAngle}); });
    };
    const PointsToMeshResult one = run(1), four = run(4);
    expectSharp(one.report, pieces, curves, corners);
    EXPECT_EQ(one.mesh.positions, four.mesh.positions);
    EXPECT_EQ(one.mesh.triangles, four.mesh.triangles);
    EXPECT_EQ(one.report.sharpLength, four.report.sharpLength);
    EXPECT_EQ(one.report.roundedPairs, four.report.roundedPairs);
  };
  expectSame(cylinder, 3, 2, 0);
  expectSame(cubes, 12, 24, 16);
}

TEST(SharpPoints, RefuseAnglesOutsideTheirRange) {
  const PointCloud cloud = projected_points::sphere(100);
  for (const double angle : {0.1, 1.6, -0.5}) {
    const std::string message =
        refusal<UsageError>([&] { static_cast<void>(pointsToMesh(cloud, {.sharpAngle = angle})); });
    EXPECT_NE(message.find("10 to 90 degrees"), std::string::npos) << message;
  }
}

}  // namespace sharp_points_test
