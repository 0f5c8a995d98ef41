#include "levelset/convert/pseudonormals.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/measured.h"

namespace pseudonormals_test {

using Imath::V3d;
using levelset::convert::LocalMesh;
using levelset::convert::Pseudonormals;

/// Corner of a cube at the origin. The face on z = 0 is split into `parts` triangles at the corner,
/// the two others into one each.
LocalMesh cubeCorner(std::uint32_t parts) {
  LocalMesh mesh;
  mesh.points = {V3d(0), V3d(0, 0, -1)};
  for (std::uint32_t i = 0; i <= parts; ++i) {
    const double angle = M_PI / 2 * i / parts;
    mesh.points.emplace_back(-std::cos(angle), -std::sin(angle), 0);
  }
  const std::uint32_t first = 2, last = 2 + parts;
  for (std::uint32_t i = first; i < last; ++i) mesh.triangles.push_back({0, i, i + 1});
  mesh.triangles.push_back({0, 1, first});  // y = 0
  mesh.triangles.push_back({0, last, 1});   // x = 0
  return mesh;
}

TEST(Pseudonormals, DoNotDependOnTheTriangulation) {
  for (const std::uint32_t parts : {1u, 2u, 7u}) {
    const LocalMesh mesh = cubeCorner(parts);
    const Pseudonormals normals(mesh);
    EXPECT_FALSE(normals.unorientedEdge());
    EXPECT_LT((normals.at(0, 0).normal - V3d(1).normalized()).length(), support::doubleRounding(8))
        << parts;
    // The edge along x, between the faces on z = 0 and on y = 0.
    EXPECT_LT((normals.at(0, 3).normal - V3d(0, 1, 1).normalized()).length(),
              support::doubleRounding(4));
    EXPECT_EQ(normals.at(0, 6).normal, V3d(0, 0, 1));
  }
}

}  // namespace pseudonormals_test
