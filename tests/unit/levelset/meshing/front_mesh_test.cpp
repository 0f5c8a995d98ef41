// Meshes by an advancing front: closed, on the zero set, and of well-shaped triangles.

#include "levelset/meshing/front_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
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

struct Quality {
  double meanRatio = 0;  ///< of the radii of the inscribed and the circumscribed circle, up to 1/2
  double leastAngle = 4;
  double valenceSix = 0;  ///< share of the vertices with six triangles
  double longest = 0;
  long euler = 0;
  bool isClosed = true;  ///< each edge has one triangle on each side
};

Quality qualityOf(const TriMesh& mesh) {
  Quality quality;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  std::vector<int> valence(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    std::array<V3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = mesh.positions[t[i]];
      ++valence[t[i]];
      ++sides[{t[i], t[(i + 1) % 3]}];
    }
    double lengths[3];
    for (std::size_t i = 0; i < 3; ++i) {
      const V3d u = p[(i + 1) % 3] - p[i], v = p[(i + 2) % 3] - p[i];
      lengths[i] = u.length();
      quality.longest = std::max(quality.longest, lengths[i]);
      quality.leastAngle = std::min(quality.leastAngle, std::atan2(u.cross(v).length(), u.dot(v)));
    }
    const double area = (p[1] - p[0]).cross(p[2] - p[0]).length() / 2,
                 half = (lengths[0] + lengths[1] + lengths[2]) / 2;
    quality.meanRatio += 4 * area * area / (half * lengths[0] * lengths[1] * lengths[2]);
  }
  quality.meanRatio /= static_cast<double>(mesh.triangles.size());
  for (const auto& [side, count] : sides)
    if (count != 1 || !sides.contains({side.second, side.first})) quality.isClosed = false;
  quality.valenceSix = static_cast<double>(std::count(valence.begin(), valence.end(), 6)) /
                       static_cast<double>(valence.size());
  quality.euler = static_cast<long>(mesh.positions.size()) - static_cast<long>(sides.size() / 2) +
                  static_cast<long>(mesh.triangles.size());
  return quality;
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
  const Quality quality = qualityOf(front.mesh);
  EXPECT_TRUE(quality.isClosed);
  EXPECT_EQ(quality.euler, 2);
  EXPECT_EQ(front.components, 1u);
  EXPECT_EQ(front.uniform + front.filled + front.otherTopology, 0u);
  double largest = 0;
  for (const V3d& p : front.mesh.positions)
    largest = std::max(largest, std::abs((p - kCentre).length() - 1));
  EXPECT_LE(largest, support::measured(kSphereError));
  EXPECT_GT(signedVolume(front.mesh), 0.9 * 4 / 3 * std::numbers::pi);
}

/// Kalbe gives 0.46 to 0.47 for the mean ratio of radii, and 0.74 to 0.76 for the share of vertices
/// with six triangles [Kalbe11].
TEST(FrontMesh, OfATorusHasWellShapedTriangles) {
  const BandFrontMesh front = bandToFrontMesh(torus(0.02));
  const Quality quality = qualityOf(front.mesh);
  EXPECT_TRUE(quality.isClosed);
  EXPECT_EQ(quality.euler, 0);
  EXPECT_EQ(front.uniform + front.filled + front.otherTopology, 0u);
  EXPECT_GT(quality.meanRatio, 0.465);
  EXPECT_GT(quality.valenceSix, 0.7);
  EXPECT_GT(quality.leastAngle, 0.2);
}

TEST(FrontMesh, HasTheEdgeLengthOfTheOptions) {
  const NarrowBand ball = makeSphere(1, kCentre, 0.03);
  FrontMeshOptions options;
  options.edgeLength = 0.09;
  const Quality fine = qualityOf(bandToFrontMesh(ball, options).mesh);
  EXPECT_LE(fine.longest, 2 * options.edgeLength);
  EXPECT_GE(fine.longest, options.edgeLength);
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
  const Quality quality = qualityOf(front.mesh);
  EXPECT_TRUE(quality.isClosed);
  EXPECT_EQ(quality.euler, 4);
  EXPECT_EQ(front.components, 2u);
  EXPECT_EQ(front.uniform, 0u);
  EXPECT_NEAR(signedVolume(front.mesh), 2 * 1.6 * 1.4 - 4 / 3. * std::numbers::pi * 0.064, 0.02);
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
    const Quality quality = qualityOf(front.mesh);
    EXPECT_TRUE(quality.isClosed) << radius;
    EXPECT_EQ(quality.euler, 2) << radius;
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

TEST(FillLoop, TriangulatesAPolygonWithTheLeastArea) {
  const std::vector<V3d> positions = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0.3, 0.8, 0),
                                      V3d(0, 1, 0)};
  const std::vector<V3d> normals(positions.size(), V3d(0, 0, 1));
  const std::vector<std::uint32_t> loop = {0, 1, 2, 3, 4};
  const auto unused = [](std::uint32_t, std::uint32_t) { return false; };
  const auto triangles = fillLoop(loop, positions, normals, unused);
  ASSERT_EQ(triangles.size(), 3u);
  double area = 0;
  for (const auto& t : triangles) {
    const V3d twice = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    EXPECT_GT(twice.z, 0);
    area += twice.z / 2;
  }
  EXPECT_NEAR(area, 0.9, support::rounding(1));
  // All diagonals are in use.
  EXPECT_TRUE(fillLoop(loop, positions, normals, [](std::uint32_t, std::uint32_t) {
                return true;
              }).empty());
}

}  // namespace front_mesh_test
