#include "levelset/points/meshing/points_to_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "levelset/error.h"
#include "levelset/inspect/mesh_quality.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/unit/levelset/points/projection/mesh_topology.h"
#include "tests/unit/levelset/points/projection/projected_points.h"

namespace points_to_mesh_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::meshQuality;
using levelset::PointCloud;
using levelset::pointsToMesh;
using levelset::PointsToMeshResult;
using levelset::signedVolume;
using levelset::TriMesh;
using levelset::UsageError;
using projected_points::Topology;
using projected_points::topologyOf;
using support::measured;
using support::refusal;

void expectClosed(const PointsToMeshResult& result, long euler) {
  const Topology topology = topologyOf(result.mesh);
  EXPECT_TRUE(topology.isManifold);
  EXPECT_EQ(topology.borderEdges, 0u);
  EXPECT_EQ(topology.euler, euler);
  EXPECT_EQ(result.report.borders, 0u);
  EXPECT_EQ(result.report.incomplete, 0u);
  EXPECT_EQ(result.report.unusedPoints, 0u);
}

TEST(PointsToMesh, OfASphereIsClosed) {
  const PointsToMeshResult result = pointsToMesh(projected_points::sphere(3000));
  expectClosed(result, 2);
  EXPECT_EQ(result.report.filled, 0u);
  double worst = 0;
  for (const V3d& p : result.mesh.positions) worst = std::max(worst, std::abs(p.length() - 1));
  EXPECT_LT(worst, measured(1.93e-4));
  // A chord of 20 degrees is below its arc.
  EXPECT_NEAR(signedVolume(result.mesh) / (4 * std::numbers::pi / 3), 1, measured(0.045));
}

TEST(PointsToMesh, OfATorusHasWellShapedTriangles) {
  const PointsToMeshResult result = pointsToMesh(projected_points::torus(4000), {.smoothing = 1});
  expectClosed(result, 0);
  double worst = 0;
  for (const V3d& p : result.mesh.positions)
    worst = std::max(worst, projected_points::torusDistance(p));
  EXPECT_LT(worst, measured(1.7e-5));
  const auto quality = meshQuality(result.mesh);
  EXPECT_GT(quality.radiusRatio, 0.95);
  EXPECT_GT(quality.valenceSix, 0.81);
}

TEST(PointsToMesh, HasTheEdgeLengthOfTheOptions) {
  const double edge = 0.1;
  const PointsToMeshResult result =
      pointsToMesh(projected_points::sphere(3000), {.edgeLength = edge});
  expectClosed(result, 2);
  const auto quality = meshQuality(result.mesh);
  EXPECT_LT(quality.longestEdge, 2 * edge);
  // Equilateral triangles of this edge length.
  const double ideal = 4 * std::numbers::pi / (std::sqrt(3.0) / 4 * edge * edge);
  EXPECT_NEAR(static_cast<double>(result.mesh.triangles.size()) / ideal, 1, measured(0.034));
}

TEST(PointsToMesh, OfAHemisphereHasOneBorderOnItsRim) {
  const PointsToMeshResult result = pointsToMesh(projected_points::hemisphere(2000));
  const Topology topology = topologyOf(result.mesh);
  EXPECT_TRUE(topology.isManifold);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_EQ(result.report.borders, 1u);
  EXPECT_EQ(result.report.incomplete, 0u);
  double highest = 0, farthest = 0;
  std::set<std::array<std::uint32_t, 2>> sides;
  for (const auto& t : result.mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) sides.insert({t[i], t[(i + 1) % 3]});
  for (const auto& [a, b] : sides)
    if (!sides.contains({b, a})) highest = std::max(highest, std::abs(result.mesh.positions[a].z));
  for (const V3d& p : result.mesh.positions)
    farthest = std::max(farthest, std::abs(p.length() - 1));
  EXPECT_LT(highest, measured(9.01e-6));
  EXPECT_LT(farthest, measured(3.23e-4));
  EXPECT_NEAR(result.report.borderLength / (2 * std::numbers::pi), 1, measured(0.0089));
}

TEST(PointsToMesh, OfASquareCoversIt) {
  const PointsToMeshResult result =
      pointsToMesh(projected_points::square(30), {.edgeLength = 0.08});
  const Topology topology = topologyOf(result.mesh);
  EXPECT_TRUE(topology.isManifold);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_EQ(result.report.borders, 1u);
  EXPECT_NEAR(surfaceArea(result.mesh), 1, measured(0.0016));
  EXPECT_NEAR(result.report.borderLength, 4, measured(0.044));
}

TEST(PointsToMesh, KeepsTheBorderOfAHole) {
  PointCloud cloud;
  const V3d centre(0.5, 0.5, 0);
  const double radius = 0.2;
  for (const V3d& p : projected_points::square(30).positions)
    if ((p - centre).length() > radius + 0.015) cloud.positions.push_back(p);
  for (int i = 0; i < 38; ++i)
    cloud.positions.push_back(centre + radius * V3d(std::cos(i * std::numbers::pi / 19),
                                                    std::sin(i * std::numbers::pi / 19), 0));
  const PointsToMeshResult result = pointsToMesh(cloud);
  EXPECT_EQ(topologyOf(result.mesh).euler, 0);
  EXPECT_EQ(result.report.borders, 2u);
  EXPECT_NEAR(surfaceArea(result.mesh), 1 - std::numbers::pi * radius * radius, measured(0.0026));
}

TEST(PointsToMesh, ClosesOverTheEdgesOfACube) {
  PointCloud cloud;
  constexpr int kSide = 24;
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j)
      for (int k = 0; k <= kSide; ++k)
        if (i % kSide == 0 || j % kSide == 0 || k % kSide == 0)
          cloud.positions.push_back(V3d(i, j, k) / kSide);
  const PointsToMeshResult result = pointsToMesh(cloud);
  expectClosed(result, 2);
  // The edges are rounded, or bulge, over a spacing.
  EXPECT_NEAR(signedVolume(result.mesh), 1, measured(0.00172));
}

TEST(PointsToMesh, KeepsTwoSheetsAndTwoSpheresApart) {
  PointCloud cloud = projected_points::square(30);
  const std::size_t lower = cloud.size();
  for (std::size_t i = 0; i < lower; ++i)
    cloud.positions.push_back(cloud.positions[i] + V3d(0.01, 0.005, 0.1));
  const PointsToMeshResult sheets = pointsToMesh(cloud);
  EXPECT_EQ(sheets.report.components, 2u);
  EXPECT_EQ(sheets.report.borders, 2u);
  for (const V3d& p : sheets.mesh.positions)
    EXPECT_LT(std::min(std::abs(p.z), std::abs(p.z - 0.1)), 1e-9);
  PointCloud shell = projected_points::sphere(3000);
  for (const V3d& p : projected_points::sphere(2000).positions) shell.positions.push_back(0.8 * p);
  const PointsToMeshResult nested = pointsToMesh(shell);
  expectClosed(nested, 4);
  EXPECT_EQ(nested.report.components, 2u);
  // The inner sphere is a cavity.
  EXPECT_NEAR(signedVolume(nested.mesh) / (4 * std::numbers::pi / 3 * (1 - 0.512)), 1,
              measured(0.045));
}

TEST(PointsToMesh, CoversNoisyPoints) {
  PointCloud cloud = projected_points::torus(4000);
  projected_points::addNoise(cloud, 0.1 * std::sqrt(1.6 * std::numbers::pi * std::numbers::pi * 2 /
                                                    std::sqrt(3.0) / 4000));
  const PointsToMeshResult result = pointsToMesh(cloud, {.smoothing = 2});
  expectClosed(result, 0);
  double worst = 0;
  for (const V3d& p : result.mesh.positions)
    worst = std::max(worst, projected_points::torusDistance(p));
  EXPECT_LT(worst, measured(0.0063));
}

TEST(PointsToMesh, DoesNotDependOnPlaceAndSize) {
  const PointCloud cloud = projected_points::torus(1500);
  const PointsToMeshResult plain = pointsToMesh(cloud);
  PointCloud small = cloud, far = cloud;
  const double scale = std::ldexp(1.0, -40);
  for (V3d& p : small.positions) p *= scale;
  for (V3d& p : far.positions) p += V3d(1e6, -1e6, 1e6);
  const PointsToMeshResult tiny = pointsToMesh(small), moved = pointsToMesh(far);
  EXPECT_EQ(tiny.mesh.triangles, plain.mesh.triangles);
  for (std::size_t i = 0; i < plain.mesh.positions.size(); ++i)
    EXPECT_EQ(tiny.mesh.positions[i], plain.mesh.positions[i] * scale);
  expectClosed(moved, 0);
  EXPECT_NEAR(signedVolume(moved.mesh) / signedVolume(plain.mesh), 1, measured(1e-9));
}

TEST(PointsToMesh, CountsPointsAtEqualPositionsOnce) {
  PointCloud cloud = projected_points::sphere(1000);
  const PointsToMeshResult once = pointsToMesh(cloud);
  for (std::size_t i = 0; i < 1000; i += 2) cloud.positions.push_back(cloud.positions[i]);
  cloud.positions.insert(cloud.positions.end(), 50, cloud.positions[0]);
  const PointsToMeshResult twice = pointsToMesh(cloud);
  EXPECT_EQ(twice.mesh.positions, once.mesh.positions);
  EXPECT_EQ(twice.mesh.triangles, once.mesh.triangles);
}

TEST(PointsToMesh, HasTheSameBitsForAnyNumberOfThreads) {
  const PointCloud cloud = projected_points::torus(1500);
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] { return pointsToMesh(cloud).mesh; });
  };
  const TriMesh one = run(1), four = run(4);
  EXPECT_EQ(one.positions, four.positions);
  EXPECT_EQ(one.triangles, four.triangles);
}

TEST(PointsToMesh, RefusesWhatIsNoSurface) {
  const auto says = [](const PointCloud& cloud, const char* text) {
    const std::string message =
        refusal<InvalidInput>([&] { static_cast<void>(pointsToMesh(cloud)); });
    EXPECT_NE(message.find(text), std::string::npos) << message;
  };
  PointCloud cloud;
  says(cloud, "has no points");
  cloud.positions = {V3d(1)};
  says(cloud, "fewer than 3 different positions");
  cloud.positions = {V3d(1), V3d(2), V3d(1)};
  says(cloud, "fewer than 3 different positions");
  cloud.positions = {V3d(0), V3d(1), V3d(2), V3d(5)};
  says(cloud, "lie on a line");
  cloud.positions = {V3d(0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  says(cloud, "form no surface");
}

TEST(PointsToMesh, RefusesNormalsThatOpposeEachOther) {
  PointCloud cloud = projected_points::sphere(800);
  for (const V3d& p : cloud.positions) cloud.normals.emplace_back(p.normalized());
  const auto flipped = [&](std::size_t step) {
    PointCloud other = cloud;
    for (std::size_t i = 0; i < other.size(); i += step) other.normals[i] = -other.normals[i];
    return other;
  };
  // 7 % and 14 % of the normals; the limit is 10 %.
  EXPECT_NO_THROW(static_cast<void>(pointsToMesh(flipped(14))));
  const std::string message =
      refusal<InvalidInput>([&] { static_cast<void>(pointsToMesh(flipped(2))); });
  EXPECT_NE(message.find("oppose those of their neighbours"), std::string::npos) << message;
}

TEST(PointsToMesh, RefusesOptionsOutsideTheirRange) {
  const PointCloud cloud = projected_points::sphere(100);
  const auto says = [&](const levelset::PointsToMeshOptions& options, const char* text) {
    const std::string message =
        refusal<UsageError>([&] { static_cast<void>(pointsToMesh(cloud, options)); });
    EXPECT_NE(message.find(text), std::string::npos) << message;
  };
  says({.angle = 0}, "angle");
  says({.angle = 1.1}, "angle");
  says({.edgeLength = -1}, "edge length");
  says({.smoothing = 0.5}, "smoothing");
  says({.gap = 5}, "gap");
}

}  // namespace points_to_mesh_test
