#include "levelset/convert/closest_triangles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "tests/support/measured.h"
#include "tests/support/sigg_meshes.h"
#include "tests/support/threads.h"

namespace closest_triangles_test {

using namespace levelset;
using namespace support;

double distanceTo(const TriMesh& mesh, std::size_t t, const V3d& p) {
  const auto& corners = mesh.triangles[t];
  return (closestPoint(mesh.positions[corners[0]], mesh.positions[corners[1]],
                       mesh.positions[corners[2]], p) -
          p)
      .length();
}

/// Compares all grid points around the mesh with brute force.
void expectClosest(const TriMesh& mesh, double h, double halfWidth) {
  const ClosestTriangles result = closestTriangles(mesh, h, {.halfWidth = halfWidth});
  auto index = result.triangle.shared()->scalar->getConstAccessor();
  auto vector = result.vector.shared()->vector->getConstAccessor();
  const Imath::Box3d box = bounds(mesh);
  const double reach = halfWidth * h;
  const auto first = [&](double x) { return static_cast<int>(std::floor((x - reach) / h)); };
  const auto last = [&](double x) { return static_cast<int>(std::ceil((x + reach) / h)); };
  std::size_t active = 0, notClosest = 0;
  double worst = 0;
  for (int x = first(box.min.x); x <= last(box.max.x); ++x)
    for (int y = first(box.min.y); y <= last(box.max.y); ++y)
      for (int z = first(box.min.z); z <= last(box.max.z); ++z) {
        const openvdb::Coord at(x, y, z);
        const V3d p = V3d(x, y, z) * h;
        const double exact = unsignedDistance(mesh, p);
        if (std::abs(exact - reach) < 1e-9) continue;
        ASSERT_EQ(index.isValueOn(at), exact < reach) << p;
        ASSERT_EQ(vector.isValueOn(at), exact < reach) << p;
        if (exact >= reach) {
          ASSERT_EQ(index.getValue(at), ClosestTriangles::kNoTriangle);
          continue;
        }
        ++active;
        const auto t = static_cast<std::size_t>(index.getValue(at));
        notClosest += distanceTo(mesh, t, p) > exact + doubleRounding(16);
        const openvdb::Vec3s v = vector.getValue(at);
        const V3d foot = p + V3d(static_cast<double>(v.x()), static_cast<double>(v.y()),
                                 static_cast<double>(v.z()));
        worst = std::max(
            {worst, distanceTo(mesh, t, foot), std::abs(static_cast<double>(v.length()) - exact)});
      }
  EXPECT_EQ(notClosest, 0u);
  EXPECT_LT(worst, rounding(2) * reach);
  EXPECT_EQ(result.triangle.activeVoxelCount(), active);
}

TEST(ClosestTriangles, AreThoseOfBruteForce) {
  expectClosest(torusMesh(1, 0.4, 24, 12, V3d(0.013, -0.021, 0.007)), 0.11, 3.5);
  expectClosest(transformed(trefoilTube(0.5, 40, 8), [](const V3d& p) { return p * 0.4; }), 0.13,
                4);
}

TEST(ClosestTriangles, AcceptAnySetOfTriangles) {
  TriMesh mesh = soup(torusMesh(1, 0.4, 10, 6), 0.02);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {V3d(2, 0, 0), V3d(2, 1, 0), V3d(2, 0.3, 0)});
  mesh.triangles.push_back({first, first + 1, first + 2});  // no area
  mesh.triangles.push_back({first, first, first});          // no extent
  expectClosest(mesh, 0.2, 2.5);
}

TEST(ClosestTriangles, NumberTheTrianglesOfTheMesh) {
  // Two squares, each of two triangles with their own vertices.
  TriMesh mesh = soup(boxMesh(V3d(-4), V3d(4)));
  const ClosestTriangles result = closestTriangles(mesh, 1, {.halfWidth = 2});
  auto index = result.triangle.shared()->scalar->getConstAccessor();
  // Faces of the box in the order of boxMesh(), at points inside their triangles.
  EXPECT_EQ(index.getValue({-2, -1, -5}), 0);
  EXPECT_EQ(index.getValue({1, 2, -5}), 1);
  EXPECT_EQ(index.getValue({5, 1, 2}), 11);
  EXPECT_EQ(result.vector.shared()->vector->getConstAccessor().getValue({5, 1, 2}),
            openvdb::Vec3s(-1, 0, 0));
}

TEST(ClosestTriangles, AreTheSameOnAnyNumberOfThreads) {
  const TriMesh mesh = trefoilTube(0.4, 60, 10);
  const auto on = [&](std::size_t threads) {
    return onThreads(threads, [&] {
      const ClosestTriangles r = closestTriangles(mesh, 0.1, {.halfWidth = 5});
      return std::pair(r.triangle.contentHash(), r.vector.contentHash());
    });
  };
  EXPECT_EQ(on(1), on(4));
}

TEST(ClosestTriangles, RefuseUnsuitableInput) {
  const TriMesh box = boxMesh(V3d(-1), V3d(1));
  EXPECT_THROW((void)closestTriangles(box, 0), UsageError);
  EXPECT_THROW((void)closestTriangles(box, 0.1, {.halfWidth = 0.5}), UsageError);
  EXPECT_THROW((void)closestTriangles(box, 3), InvalidInput);
  EXPECT_THROW((void)closestTriangles(TriMesh{}, 0.1), InvalidInput);
  EXPECT_THROW((void)closestTriangles(box, 0.1, {.progress = [](double) { return false; }}),
               Cancelled);
}

}  // namespace closest_triangles_test
