// Meshes by an advancing front: closed, on the zero set, and of well-shaped triangles.

#include "levelset/meshing/front_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/inspect/mesh_quality.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/meshing/front/fill_holes.h"
#include "levelset/meshing/front/fill_loop.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace front_mesh_test {

using namespace levelset;
using Imath::V3d;

const V3d kCentre(0.13, -0.21, 0.07);
constexpr double kSphereError = 5.9e-6;

void expectClosed(const BandFrontMesh& front, long euler) {
  EXPECT_TRUE(manifoldness(front.mesh).isClosedManifold());
  EXPECT_EQ(measure(front.mesh).euler, euler);
}

NarrowBand torus(double voxel) {
  return support::sampleBand(
      [](const V3d& p) {
        const V3d q = p - kCentre;
        return std::hypot(std::hypot(q.x, q.y) - 1, q.z) - 0.4;
      },
      {V3d(-1.8), V3d(1.8)}, voxel);
}

TEST(FrontMesh, OfASphereLiesOnIt) {
  const BandFrontMesh front = bandToFrontMesh(makeSphere(1, kCentre, 0.05));
  expectClosed(front, 2);
  EXPECT_EQ(front.components, 1u);
  EXPECT_EQ(front.uniform + front.filled, 0u);
  double largest = 0;
  for (const V3d& p : front.mesh.positions)
    largest = std::max(largest, std::abs((p - kCentre).length() - 1));
  EXPECT_LE(largest, support::measured(kSphereError));
  EXPECT_GT(signedVolume(front.mesh), 0.9 * 4 / 3 * std::numbers::pi);
}

/// Kalbe gives 0.92 to 0.94 for the mean ratio of radii, and 0.74 to 0.76 for the share of vertices
/// with six triangles [Kalbe11].
TEST(FrontMesh, OfATorusHasWellShapedTriangles) {
  const BandFrontMesh front = bandToFrontMesh(torus(0.02));
  expectClosed(front, 0);
  EXPECT_EQ(front.uniform + front.filled, 0u);
  const MeshQuality quality = meshQuality(front.mesh);
  EXPECT_GT(quality.radiusRatio, 0.93);
  EXPECT_GT(quality.valenceSix, 0.7);
  EXPECT_GT(quality.leastAngle, 0.2);
}

TEST(FrontMesh, HasTheEdgeLengthOfTheOptions) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.03);
  FrontMeshOptions options;
  options.edgeLength = 0.09;
  const double longest = meshQuality(bandToFrontMesh(ball, options).mesh).longestEdge;
  EXPECT_LE(longest, 2 * options.edgeLength);
  EXPECT_GE(longest, options.edgeLength);
  // On a sphere all edges have the length of the angle.
  options = {};
  options.angle = 0.3;
  const TriMesh mesh = bandToFrontMesh(ball, options).mesh;
  const double length = 2 * std::sin(0.15),
               expected = 4 * std::numbers::pi / (std::sqrt(3.0) / 4 * length * length);
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()) / expected, 1, 0.2);
}

/// The chord error of a mesh falls with the square of its edges.
TEST(FrontMesh, ConvergesWithSecondOrder) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.02);
  std::vector<double> errors;
  for (const double length : {0.24, 0.12, 0.06}) {
    FrontMeshOptions options;
    options.edgeLength = length;
    errors.push_back(4 * std::numbers::pi / 3 - signedVolume(bandToFrontMesh(ball, options).mesh));
  }
  for (std::size_t i = 1; i < errors.size(); ++i)
    EXPECT_NEAR(std::log2(errors[i - 1] / errors[i]), 2, 0.15);
}

/// Creases get short edges, and the mesh stays closed.
TEST(FrontMesh, ClosesOverCreasesAndCavities) {
  const NarrowBand solid =
      subtract(makeBox(V3d(2, 1.6, 1.4), kCentre, 0.05), makeSphere(0.4, kCentre, 0.05));
  const BandFrontMesh front = bandToFrontMesh(solid);
  expectClosed(front, 4);
  EXPECT_EQ(front.components, 2u);
  EXPECT_EQ(front.uniform, 0u);
  EXPECT_NEAR(signedVolume(front.mesh), 2 * 1.6 * 1.4 - 4 / 3. * std::numbers::pi * 0.064, 0.02);
}

/// Largest relative differences of volume and area from those of marching cubes.
struct Difference {
  double volume = 0, area = 0;
};

Difference differenceFrom(const NarrowBand& solid, const BandFrontMesh& front) {
  const TriMesh uniform = bandToMesh(solid);
  EXPECT_TRUE(manifoldness(front.mesh).isClosedManifold());
  EXPECT_EQ(measure(front.mesh).euler, measure(uniform).euler);
  return {std::abs(signedVolume(front.mesh) / signedVolume(uniform) - 1),
          std::abs(surfaceArea(front.mesh) / surfaceArea(uniform) - 1)};
}

/// The front of one box must not go on along the other one.
TEST(FrontMesh, OfBoxesThatTouchHasTwoComponents) {
  const NarrowBand box = makeBox(V3d(1), V3d(0), 0.05);
  struct Case {
    V3d at;
    double volumeError, areaError;
  };
  for (const Case& c : {Case{V3d(1, 1, 0), 7.3e-4, 0.069}, {V3d(1, 1, 1), 2.3e-3, 0.04}}) {
    const NarrowBand solid = unite(box, makeBox(V3d(1), c.at, 0.05));
    const BandFrontMesh front = bandToFrontMesh(solid);
    expectClosed(front, 4);
    EXPECT_EQ(front.components, 2u);
    EXPECT_EQ(front.uniform, 0u);
    EXPECT_NEAR(signedVolume(front.mesh), 2, support::measured(c.volumeError));
    EXPECT_NEAR(surfaceArea(front.mesh), 12, support::measured(c.areaError));
  }
}

/// Marching cubes leave holes in a shell of one voxel. A front that ignores them is another solid.
TEST(FrontMesh, OfAThinShellIsTheSolidOfMarchingCubes) {
  struct Case {
    double voxels;
    std::size_t uniform;
    double volume, area;  ///< relative differences
  };
  for (const Case& c :
       {Case{1, 1, 0, 0}, {1.2, 1, 0, 0}, {1.5, 0, 0.049, 0.0028}, {2, 0, 0.0088, 0.0065}}) {
    const testing::ScopedTrace trace("", 0, std::to_string(c.voxels));
    const NarrowBand solid =
        subtract(makeSphere(1, V3d(0), 0.05), makeSphere(1 - 0.05 * c.voxels, V3d(0), 0.05));
    const BandFrontMesh front = bandToFrontMesh(solid);
    const Difference difference = differenceFrom(solid, front);
    EXPECT_EQ(front.uniform, c.uniform);
    EXPECT_LE(difference.volume, support::measured(c.volume) + support::doubleRounding(100));
    EXPECT_LE(difference.area, support::measured(c.area) + support::doubleRounding(100));
  }
}

/// Creases that lie on planes of grid points.
TEST(FrontMesh, ClosesOverASquareHoleOnTheGrid) {
  const NarrowBand solid =
      subtract(makeBox(V3d(2), V3d(0), 0.05), makeBox(V3d(1, 1, 4), V3d(0), 0.05));
  const BandFrontMesh front = bandToFrontMesh(solid);
  expectClosed(front, 0);
  EXPECT_EQ(front.uniform, 0u);
  EXPECT_NEAR(signedVolume(front.mesh), 6, support::measured(2.7e-3));
  EXPECT_NEAR(surfaceArea(front.mesh), 30, support::measured(0.027));
}

TEST(FrontMesh, OfRandomSolidsIsNearMarchingCubes) {
  std::mt19937 random(7);
  const auto number = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  const auto point = [&](double size) {
    const double x = number(-size, size), y = number(-size, size);
    return V3d(x, y, number(-size, size));
  };
  const auto shape = [&] {
    const V3d centre = point(0.5);
    if (number(0, 1) < 0.5) return makeSphere(number(0.2, 0.7), centre, 0.05);
    return makeBox(V3d(0.9) + point(0.6), centre, 0.05);
  };
  Difference largest;
  std::size_t components = 0, uniform = 0;
  for (int i = 0; i < 20; ++i) {
    const testing::ScopedTrace trace("", 0, std::to_string(i));
    NarrowBand solid = unite(shape(), shape());
    solid = subtract(unite(solid, shape()), shape());
    const BandFrontMesh front = bandToFrontMesh(solid);
    const Difference difference = differenceFrom(solid, front);
    largest.volume = std::max(largest.volume, difference.volume);
    largest.area = std::max(largest.area, difference.area);
    components += front.components;
    uniform += front.uniform;
  }
  EXPECT_LE(largest.volume, support::measured(0.0154));
  EXPECT_LE(largest.area, support::measured(0.0242));
  EXPECT_EQ(components, 24u);
  EXPECT_LE(uniform, 7u);
}

/// Where a predicted vertex leaves the band, the projection starts nearer to the surface.
TEST(FrontMesh, HasWideAnglesOnFineVoxels) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.02);
  FrontMeshOptions options;
  options.edgeLength = 10;
  for (const double degrees : {40.0, 57.0}) {
    options.angle = degrees * std::numbers::pi / 180;
    const BandFrontMesh front = bandToFrontMesh(ball, options);
    expectClosed(front, 2);
    EXPECT_EQ(front.uniform, 0u);
    double largest = 0;
    for (const V3d& p : front.mesh.positions)
      largest = std::max(largest, std::abs((p - kCentre).length() - 1));
    EXPECT_LE(largest, support::measured(3e-7)) << degrees;
    // Chords of the length L lose 3/8 (L / R)² of the volume.
    const double length = 2 * std::sin(options.angle / 2),
                 lost = 1 - signedVolume(front.mesh) / (4 * std::numbers::pi / 3);
    EXPECT_NEAR(lost / (0.375 * length * length), 1, support::measured(0.075)) << degrees;
  }
}

/// A limit above all edge lengths changes nothing.
TEST(FrontMesh, DoesNotDependOnALargeEdgeLength) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.05);
  FrontMeshOptions options;
  options.edgeLength = 1;
  const TriMesh mesh = bandToFrontMesh(ball, options).mesh;
  options.edgeLength = 1000;
  const TriMesh same = bandToFrontMesh(ball, options).mesh;
  EXPECT_EQ(mesh.positions, same.positions);
  EXPECT_EQ(mesh.triangles, same.triangles);
}

TEST(FrontMesh, DoesNotDependOnThreads) {
  const NarrowBand solid =
      unite(makeSphere(0.5, V3d(-1, 0, 0), 0.05), makeSphere(0.7, V3d(1, 0.2, 0), 0.05));
  const auto mesh = [&] { return bandToFrontMesh(solid).mesh; };
  const TriMesh one = support::onThreads(1, mesh), four = support::onThreads(4, mesh);
  EXPECT_EQ(one.positions, four.positions);
  EXPECT_EQ(one.triangles, four.triangles);
}

/// Solids below a voxel keep the triangles of marching cubes, or get a closed front.
TEST(FrontMesh, IsClosedForTinySolids) {
  for (const double radius : {0.5, 0.6, 1.0, 2.0}) {
    const BandFrontMesh front = bandToFrontMesh(makeSphere(radius, kCentre, 1));
    const testing::ScopedTrace trace("", 0, std::to_string(radius));
    expectClosed(front, 2);
  }
}

TEST(FrontMesh, StopsWhenCancelled) {
  FrontMeshOptions options;
  options.progress = [](double fraction) { return fraction < 0.2; };
  EXPECT_THROW((void)bandToFrontMesh(makeSphere(1, kCentre, 0.02), options), Cancelled);
}

TEST(FrontMesh, Refuses) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.1);
  FrontMeshOptions options;
  options.edgeLength = 0.05;
  EXPECT_THROW((void)bandToFrontMesh(ball, options), UsageError);
  options = {};
  for (const double angle : {0.0, -1.0, 1.1, std::nan("")}) {
    options.angle = angle;
    EXPECT_THROW((void)bandToFrontMesh(ball, options), UsageError) << angle;
  }
  EXPECT_THROW((void)bandToFrontMesh(NarrowBand()), InvalidInput);
}

TEST(MeshQualityTest, KnowsRightAndEquilateralTriangles) {
  EXPECT_EQ(meshQuality(TriMesh()).radiusRatio, 0);
  TriMesh mesh;
  mesh.positions = {V3d(0), V3d(2, 0, 0), V3d(1, std::sqrt(3.0), 0)};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_NEAR(meshQuality(mesh).radiusRatio, 1, support::rounding(1));
  EXPECT_NEAR(meshQuality(mesh).leastAngle, std::numbers::pi / 3, support::rounding(1));
  mesh.positions[2] = V3d(0, 2, 0);
  // r = (a + b − c) / 2 and R = c / 2.
  const double c = 2 * std::sqrt(2.0);
  EXPECT_NEAR(meshQuality(mesh).radiusRatio, 2 * (4 - c) / c, support::rounding(1));
  EXPECT_NEAR(meshQuality(mesh).meanLeast, std::numbers::pi / 4, support::rounding(1));
  EXPECT_EQ(meshQuality(mesh).longestEdge, c);
  EXPECT_EQ(meshQuality(mesh).shortestEdge, 2);
  mesh.positions[2] = V3d(4, 0, 0);
  EXPECT_EQ(meshQuality(mesh).leastAngle, 0);
  EXPECT_EQ(meshQuality(mesh).radiusRatio, 0);
  // The vertex that no triangle uses does not count.
  TriMesh fan;
  fan.positions = {V3d(0), V3d(5)};
  for (int i = 0; i < 6; ++i)
    fan.positions.emplace_back(std::cos(i * std::numbers::pi / 3),
                               std::sin(i * std::numbers::pi / 3), 0);
  for (std::uint32_t i = 0; i < 6; ++i) fan.triangles.push_back({0, 2 + i, 2 + (i + 1) % 6});
  EXPECT_NEAR(meshQuality(fan).valenceSix, 1.0 / 7, support::rounding(1));
}

TEST(FillLoop, TriangulatesAPolygonWithTheLeastArea) {
  const std::vector<V3d> positions = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0.3, 0.8, 0),
                                      V3d(0, 1, 0)};
  const std::vector<V3d> normals(positions.size(), V3d(0, 0, 1));
  const std::vector<std::uint32_t> loop = {0, 1, 2, 3, 4};
  const auto unused = [](std::uint32_t, std::uint32_t) { return false; };
  const auto triangles = fillLoop(loop, positions, normals, unused, 2);
  ASSERT_EQ(triangles.size(), 3u);
  double area = 0;
  for (const auto& t : triangles) {
    const V3d twice = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    EXPECT_GT(twice.z, 0);
    area += twice.z / 2;
  }
  EXPECT_NEAR(area, 0.9, support::rounding(1));
  // All diagonals are in use.
  EXPECT_TRUE(fillLoop(
                  loop, positions, normals, [](std::uint32_t, std::uint32_t) { return true; }, 2)
                  .empty());
}

/// A hole with the corners of a square, one of which lies beyond the opposite one.
TEST(FillLoop, RefusesFoldedTrianglesAndLongDiagonals) {
  const std::vector<std::uint32_t> loop = {0, 1, 2, 3};
  const std::vector<V3d> normals(4, V3d(0, 0, 1));
  const auto unused = [](std::uint32_t, std::uint32_t) { return false; };
  std::vector<V3d> positions = {V3d(0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0, 1, 0)};
  EXPECT_EQ(fillLoop(loop, positions, normals, unused, 1.5).size(), 2u);
  EXPECT_TRUE(fillLoop(loop, positions, normals, unused, 1.4).empty());
  positions[0] = V3d(1.5, 1.5, 0);
  EXPECT_TRUE(fillLoop(loop, positions, normals, unused, 10).empty());
}

class PlaneFront : public FrontSurface {
 public:
  [[nodiscard]] std::optional<Foot> project(const V3d& p) const override {
    return Foot{V3d(p.x, p.y, 0), V3d(0, 0, 1)};
  }
  [[nodiscard]] double edgeLength(const V3d&) const override { return 1; }
};

/// A grid of squares, without the one at (3, 3). The corner there lies beyond the opposite one, so
/// the hole has no triangulation before the triangles around it are removed.
TEST(FillHoles, RemovesFoldedTrianglesAroundAHole) {
  constexpr std::uint32_t kSize = 8;
  FrontMesh mesh;
  for (std::uint32_t y = 0; y < kSize; ++y)
    for (std::uint32_t x = 0; x < kSize; ++x) mesh.positions.emplace_back(x, y, 0);
  mesh.normals.assign(mesh.positions.size(), V3d(0, 0, 1));
  const auto at = [](std::uint32_t x, std::uint32_t y) { return y * kSize + x; };
  for (std::uint32_t y = 0; y + 1 < kSize; ++y)
    for (std::uint32_t x = 0; x + 1 < kSize; ++x) {
      if (x == 3 && y == 3) continue;
      mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  mesh.positions[at(3, 3)] = V3d(4.5, 4.5, 0);
  const PlaneFront plane;
  const std::vector<std::vector<std::uint32_t>> loops = {{at(3, 3), at(4, 3), at(4, 4), at(3, 4)}};
  fillHoles(plane, loops, mesh);
  EXPECT_TRUE(mesh.isClosed);
  EXPECT_GT(mesh.filled, 2u);
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const V3d& a = mesh.positions[t[0]];
    const double twice = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).z;
    EXPECT_GT(twice, 0);
    area += twice / 2;
  }
  EXPECT_NEAR(area, 49, support::rounding(49));
}

/// A front that stopped leaves large loops. They stay open.
TEST(FillHoles, LeavesALargeHoleOpen) {
  FrontMesh mesh;
  mesh.positions = {V3d(0), V3d(9, 0, 0), V3d(9, 9, 0), V3d(0, 9, 0)};
  mesh.normals.assign(4, V3d(0, 0, 1));
  const PlaneFront plane;
  const std::vector<std::vector<std::uint32_t>> loops = {{0, 1, 2, 3}};
  fillHoles(plane, loops, mesh);
  EXPECT_FALSE(mesh.isClosed);
  EXPECT_TRUE(mesh.triangles.empty());
}

}  // namespace front_mesh_test
