#include "levelset/inspect/surface_difference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace surface_difference_test {

using namespace levelset;
using Imath::V3d;

TriMesh sphere(double radius, double voxel, const V3d& center = V3d(0)) {
  return bandToMesh(makeSphere(radius, center, voxel));
}

SurfaceDifference differ(const TriMesh& a, const TriMesh& b, double spacing,
                         const std::vector<V3d>& creases = {}, double reach = 0) {
  return surfaceDifference(TriangleSurface(a), TriangleSurface(b),
                           {.spacing = spacing, .creases = creases, .creaseRadius = reach});
}

TEST(SurfaceDifference, OfConcentricSpheresIsThatOfTheirRadii) {
  // Triangles of both spheres lie inside them by up to 0.35 h²/R.
  const double h = 0.05, sag = 0.35 * h * h;
  EXPECT_NEAR(differ(sphere(1, h), sphere(1.2, h), h).smooth, 0.2, support::measured(0.894) * sag);
}

TEST(SurfaceDifference, IsSymmetricAndZeroForEqualSurfaces) {
  const TriMesh a = sphere(1, 0.1), b = sphere(0.9, 0.07, V3d(0.2, 0, 0.1));
  EXPECT_EQ(differ(a, b, 0.05).smooth, differ(b, a, 0.05).smooth);
  EXPECT_LT(differ(a, a, 0.05).smooth, support::measured(2.01e-10));  // contribution of slivers
}

TEST(SurfaceDifference, FindsPartsOnOneSurfaceOnly) {
  TriMesh both = sphere(1, 0.1);
  append(both, sphere(0.3, 0.1, V3d(3, 0, 0)));
  EXPECT_NEAR(differ(both, sphere(1, 0.1), 0.1).smooth, 2.3, support::doubleRounding(3));
  EXPECT_NEAR(differ(sphere(1, 0.1), both, 0.1).smooth, 2.3, support::doubleRounding(3));
}

TEST(SurfaceDifference, DistancesAreThoseToTheNearestTriangle) {
  const TriMesh mesh = sphere(1, 0.3);
  const TriangleSurface surface(mesh);
  for (int i = 0; i < 200; ++i) {
    const V3d p(std::sin(i * 1.3) * 1.4, std::sin(i * 2.1) * 1.2, std::cos(i * 0.7));
    double nearest = 1e300;
    for (const auto& [a, b, c] : mesh.triangles)
      nearest = std::min(
          nearest,
          (closestOnTriangle(p, mesh.positions[a], mesh.positions[b], mesh.positions[c]).point - p)
              .length());
    EXPECT_NEAR(surface.distance(p, 1e100), nearest, support::doubleRounding(5));
    EXPECT_NEAR(surface.distance(p, nearest), nearest,
                support::doubleRounding(5));  // equals the limit
    // Also correct for a limit that is too small.
    EXPECT_NEAR(surface.distance(p, nearest / 2), nearest, support::doubleRounding(5));
  }
}

TEST(SurfaceDifference, HasTheSameBitsForAnyNumberOfThreads) {
  const TriMesh a = sphere(1, 0.05), b = sphere(1.01, 0.1);
  const auto measure = [&] { return differ(a, b, 0.05).smooth; };
  EXPECT_EQ(support::onThreads(1, measure), support::onThreads(4, measure));
}

TEST(SurfaceDifference, RefusesEmptySurfaces) {
  EXPECT_SAYS(support::refusal<InvalidInput>([] { (void)TriangleSurface(TriMesh()); }),
              "no surface");
}

TEST(SurfaceDifference, SeparatesErrorsBesideCreases) {
  const TriMesh a = sphere(1, 0.1), b = sphere(1.1, 0.1);
  const SurfaceDifference all = differ(a, b, 0.1, {V3d(0)}, 5);
  EXPECT_EQ(all.smooth, 0);
  EXPECT_NEAR(all.crease, 0.1, support::measured(0.00331));
  EXPECT_EQ(all.creaseShare, 1);
  const SurfaceDifference part = differ(a, b, 0.1, {V3d(1, 0, 0)}, 0.5);
  EXPECT_NEAR(part.smooth, 0.1, support::measured(0.00331));
  // Within a chord of 0.5 lies 0.5²/4 of a unit sphere.
  EXPECT_NEAR(part.creaseShare, 0.0625, support::measured(0.00814));
}

double edgeDistance(const V3d& p, const V3d& half) {
  const V3d d(half.x - std::abs(p.x), half.y - std::abs(p.y), half.z - std::abs(p.z));
  // Distance from the nearest edge, across the two sides with the smallest distances.
  std::array<double, 3> sides{std::abs(d.x), std::abs(d.y), std::abs(d.z)};
  std::sort(sides.begin(), sides.end());
  return std::hypot(sides[0], sides[1]);
}

TEST(Creases, OfABoxAreItsEdges) {
  const V3d size(2, 1.6, 1.2);
  const double h = 0.04;
  const TriMesh fine = bandToMesh(makeBox(size, V3d(0.011, 0.007, 0.013), h)),
                coarse = bandToMesh(makeBox(size, V3d(0.011, 0.007, 0.013), 2 * h));
  const std::vector<V3d> creases = findCreases(fine, h, coarse, 2 * h);
  ASSERT_FALSE(creases.empty());
  for (const V3d& p : creases)
    EXPECT_LT(edgeDistance(p - V3d(0.011, 0.007, 0.013), size / 2),
              support::measured(1.82, 2.5) * h);
  // Each section of an edge has a crease beside it.
  for (double t = -0.9; t < 0.9; t += 0.05) {
    const V3d onEdge = V3d(t, 0.8, 0.6) + V3d(0.011, 0.007, 0.013);
    double nearest = 1e300;
    for (const V3d& p : creases) nearest = std::min(nearest, (p - onEdge).length());
    EXPECT_LT(nearest, support::measured(0.52) * h);
  }
}

TEST(Creases, AreNotFoundOnRoundSurfaces) {
  for (const double h : {0.2, 0.1, 0.05}) {
    const TriMesh fine = bandToMesh(makeTorus(1, 0.4, V3d(0), V3d(0, 0, 1), h)),
                  coarse = bandToMesh(makeTorus(1, 0.4, V3d(0), V3d(0, 0, 1), 2 * h));
    EXPECT_TRUE(findCreases(fine, h, coarse, 2 * h).empty()) << h;
  }
}

TEST(Creases, OfAUnionAreItsSeam) {
  const auto pair = [](double h) {
    return bandToMesh(unite(makeSphere(1, V3d(0), h), makeSphere(1, V3d(1.2, 0, 0), h)));
  };
  const double h = 0.04;
  const std::vector<V3d> creases = findCreases(pair(h), h, pair(2 * h), 2 * h);
  ASSERT_FALSE(creases.empty());
  for (const V3d& p : creases)
    EXPECT_LT(std::hypot(p.x - 0.6, std::hypot(p.y, p.z) - 0.8), support::measured(1.23) * h);
}

TEST(Creases, NeedFlatFacesBesideThem) {
  TriMesh roof;  // two faces at a right angle, 1 and 0.5 wide
  roof.positions = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(0.5, 1, 0), V3d(0.5, 0, 0.5)};
  roof.triangles = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_NEAR(flatBesideEdges(roof), 0.5, support::doubleRounding(4));
  roof.positions[3] = V3d(0.5, -1, 0.5);  // less than 45 degrees
  EXPECT_EQ(flatBesideEdges(roof), 0);
}

}  // namespace surface_difference_test
