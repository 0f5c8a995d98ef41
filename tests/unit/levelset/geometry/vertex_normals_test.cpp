#include "levelset/geometry/vertex_normals.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/meshes.h"

namespace vertex_normals_test {

using namespace levelset;
using Imath::V3d;

TEST(VertexNormals, ConvergeOnASphere) {
  double before = 0;
  for (const double voxel : {0.2, 0.1, 0.05}) {
    const TriMesh mesh = bandToMesh(makeSphere(1, V3d(0.01, 0.02, 0.03), voxel));
    const std::vector<V3d> normals = vertexNormals(mesh, 0.5);
    ASSERT_EQ(normals.size(), mesh.positions.size());
    double error = 0;
    for (std::size_t i = 0; i < normals.size(); ++i)
      error = std::max(error, (normals[i] - (mesh.positions[i] - V3d(0.01, 0.02, 0.03))).length());
    if (before > 0) {
      EXPECT_LT(error, 0.7 * before);  // first order
    }
    before = error;
  }
  EXPECT_LT(before, 0.03);
}

TEST(VertexNormals, AreZeroOnCreases) {
  TriMesh mesh;  // two squares that meet at an angle of 90 degrees, and an unused vertex
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}, {9, 9, 9}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {0, 5, 4}};
  const std::vector<V3d> sharp = vertexNormals(mesh, 0.5);
  EXPECT_EQ(sharp[0], V3d(0));
  EXPECT_EQ(sharp[3], V3d(0));
  EXPECT_EQ(sharp[1], V3d(0, 0, 1));
  EXPECT_EQ(sharp[5], V3d(1, 0, 0));
  EXPECT_EQ(sharp[6], V3d(0));
  mesh.positions.push_back({0.5, 1e-5, 1e-5});
  mesh.triangles.push_back({0, 7, 1});  // a sliver that faces another way
  EXPECT_EQ(vertexNormals(mesh, 0.5)[1], V3d(0, 0, 1));
  mesh.triangles.pop_back();
  const std::vector<V3d> smooth = vertexNormals(mesh, 1);
  EXPECT_NEAR((smooth[0] - V3d(1, 0, 1).normalized()).length(), 0, 1e-15);
}

}  // namespace vertex_normals_test
