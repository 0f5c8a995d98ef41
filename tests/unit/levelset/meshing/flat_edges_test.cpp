#include "levelset/meshing/sharp/flat_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace flat_edges_test {

using namespace levelset;
using Imath::V3d;
using openvdb::Vec3d;

/// Exact distances of a cube of half edge 12 around the origin, or of its complement, index space.
NarrowBand cube(double side) {
  const auto distance = [=](const V3d& p) {
    const V3d q(std::abs(p.x) - 12, std::abs(p.y) - 12, std::abs(p.z) - 12);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return side * (out.length() + std::min(0.0, std::max({q.x, q.y, q.z})));
  };
  return support::sampleBand(distance, {V3d(-16), V3d(16)}, 1);
}

SharpVertex edgeVertex(const Vec3d& position, const Vec3d& n0, const Vec3d& n1) {
  SharpVertex vertex{position, {}};
  vertex.sheets.count = 2;
  vertex.sheets.normal[0] = openvdb::Vec3f(n0);
  vertex.sheets.normal[1] = openvdb::Vec3f(n1);
  return vertex;
}

TEST(FlatEdges, FitsThePlanesBesideAConvexAndAConcaveEdge) {
  for (const bool isConvex : {true, false}) {
    const double side = isConvex ? 1 : -1;
    const NarrowBand solid = cube(side);
    const auto& grid = vdb(solid);
    // A vertex that is slightly off, with normals that are slightly off.
    Vec3d n(side, 0.004 * side, 0);
    n.normalize();
    const auto edge =
        flatEdge(edgeVertex({12.01, 11.99, 0.3}, n, {0, side, 0}), grid, grid.getConstAccessor());
    ASSERT_TRUE(edge);
    EXPECT_EQ(edge->isConvex, isConvex);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(edge->faces[i].normal[static_cast<int>(i)], side, 1e-6);
      EXPECT_NEAR(edge->faces[i].offset, 12 * side, 1e-5);
    }
  }
}

TEST(FlatEdges, RefusesRoundFaces) {
  // A cylinder of radius 40: its flat end meets the round side at a right angle.
  const auto distance = [](const V3d& p) {
    const double side = std::hypot(p.x, p.y) - 40, end = std::abs(p.z) - 8;
    return std::hypot(std::max(side, 0.0), std::max(end, 0.0)) + std::min(0.0, std::max(side, end));
  };
  const NarrowBand solid = support::sampleBand(distance, {V3d(-44), V3d(44)}, 1);
  const auto& grid = vdb(solid);
  EXPECT_FALSE(
      flatEdge(edgeVertex({40, 0, 8}, {1, 0, 0}, {0, 0, 1}), grid, grid.getConstAccessor()));
}

TEST(FlatEdges, MeasuresConvexPolyhedra) {
  // A corner with three oblique faces: the nearest of many points of the boundary.
  std::vector<FlatFace> faces;
  for (Vec3d n : {Vec3d(1, 0.2, 0.1), Vec3d(-0.3, 1, 0.2), Vec3d(0.1, -0.4, 1)}) {
    n.normalize();
    faces.push_back({n, 0.1 * static_cast<double>(faces.size())});
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-2, 2);
  for (int i = 0; i < 200; ++i) {
    const Vec3d x(coordinate(random), coordinate(random), coordinate(random));
    const PolyhedronPoint found = nearestOnPolyhedron(faces, x);
    double top = -INFINITY, inside = -INFINITY;
    for (const FlatFace& face : faces) {
      top = std::max(top, face.above(found.point));
      inside = std::max(inside, face.above(x));
    }
    EXPECT_NEAR(top, 0, 1e-9);  // on the boundary
    EXPECT_NEAR((x - found.point).length(), std::abs(found.distance), 1e-9);
    EXPECT_EQ(found.distance < 0, inside < 0);
    // No point of the polyhedron is nearer: the direction to x separates it [convexity].
    if (inside > 0)
      for (int k = 0; k < 50; ++k) {
        const Vec3d y(coordinate(random), coordinate(random), coordinate(random));
        if (faces[0].above(y) > 0 || faces[1].above(y) > 0 || faces[2].above(y) > 0) continue;
        EXPECT_LE((y - found.point).dot(x - found.point), 1e-9);
      }
  }
}

}  // namespace flat_edges_test
