#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/transform/transform.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/mesh_files.h"
#include "tests/support/meshes.h"

namespace mesh_seams_test {

using Imath::M44d;
using Imath::V2d;
using Imath::V3d;
using levelset::InvalidInput;
using levelset::readMesh;
using levelset::TriMesh;
using support::parse;
using support::refusal;
using support::TemporaryFolder;
using support::writeText;

/// The cube [0, 1]³ with a normal for each face. All edges are seams.
TriMesh cube() {
  return parse("a.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
               "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n"
               "f 1//1 3//1 4//1 2//1\nf 5//2 6//2 8//2 7//2\nf 1//3 2//3 6//3 5//3\n"
               "f 3//4 7//4 8//4 4//4\nf 1//5 5//5 7//5 3//5\nf 2//6 4//6 8//6 6//6\n");
}

void expectCubes(const TriMesh& mesh, std::size_t count) {
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  const levelset::Measurement m = measure(mesh);
  EXPECT_EQ(m.components, count);
  EXPECT_EQ(m.euler, 2 * static_cast<long>(count));
  EXPECT_NEAR(m.volume, static_cast<double>(count), support::doubleRounding(12.5));
}

TEST(MeshSeams, AreClosedWhenAttributesAreDropped) {
  const TemporaryFolder folder;
  ASSERT_EQ(cube().positions.size(), 24u);
  levelset::writeMesh(folder / "c.off", cube());
  levelset::writeMesh(folder / "c.ply", cube());
  for (const TriMesh& mesh :
       {readMesh(folder / "c.off"), readMesh(folder / "c.ply", {.attributes = false})}) {
    EXPECT_EQ(mesh.positions.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_TRUE(mesh.attributes.isEmpty());
    expectCubes(mesh, 1);
  }
  EXPECT_EQ(readMesh(folder / "c.ply").positions.size(), 24u);
}

TEST(MeshSeams, OfTouchingPartsStayApart) {
  const auto with = [](std::initializer_list<V3d> places) {
    TriMesh mesh;
    for (const V3d& place : places) append(mesh, transform(cube(), M44d().setTranslation(place)));
    return mesh;
  };
  const TemporaryFolder folder;
  for (const TriMesh& mesh : {with({V3d(0), V3d(1, 1, 0)}),     // along an edge
                              with({V3d(0), V3d(1, 1, 1)}),     // at a corner
                              with({V3d(0), V3d(0, 0, 1)})}) {  // at a face
    expectCubes(mesh, 2);
    levelset::writeMesh(folder / "c.off", mesh);
    expectCubes(readMesh(folder / "c.off"), 2);
  }
}

TEST(MeshSeams, OfTouchingClosedMeshesAreKept) {
  // No seam to close: two balls that share points, with vertex normals.
  TriMesh mesh = support::sphereMesh(1, V3d(0), 8), other = support::sphereMesh(1, V3d(0, 0, 2), 8);
  mesh.attributes.normals.assign(mesh.positions.size(), V3d(0, 0, 1));
  other.attributes.normals.assign(other.positions.size(), V3d(0, 0, 1));
  append(mesh, other);
  EXPECT_FALSE(withoutSeams(mesh));
  EXPECT_EQ(measure(mesh).components, 2u);
}

TEST(MeshSeams, FinsAndFlippedFacesAreReported) {
  // Every triangle with its own corners and normals.
  const auto soup = [](const std::vector<std::array<V3d, 3>>& triangles) {
    TriMesh mesh;
    for (const auto& t : triangles) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.triangles.push_back({first, first + 1, first + 2});
      for (const V3d& p : t) {
        mesh.positions.push_back(p);
        mesh.attributes.normals.push_back((t[1] - t[0]).cross(t[2] - t[0]));
      }
    }
    return mesh;
  };
  const V3d a(0), b(1, 0, 0), c(0, 1, 0), d(0, -1, 0), e(0, 0, 1);
  EXPECT_EQ(manifoldness(soup({{a, b, c}, {b, a, d}})).boundaryEdges, 4u);
  EXPECT_EQ(manifoldness(soup({{a, b, c}, {b, a, d}, {a, b, e}})).nonManifoldEdges, 1u);
  EXPECT_EQ(manifoldness(soup({{a, b, c}, {a, b, d}})).misorientedEdges, 1u);
  EXPECT_THROW((void)withoutSeams(cube(), 100), levelset::ResourceLimit);
}

TEST(MeshSeams, ObjSplitsByValue) {
  // Each corner has its own vt and vn, all equal at a vertex.
  const TriMesh mesh = parse("a.obj",
                             "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
                             "vt 0 0\nvt 1 0\nvt 0 1\nvt 1 0\nvt 1 1\nvt 0 1\n"
                             "vn 0 0 1\nvn 0 0 1\n"
                             "f 1/1/1 2/2/1 3/3/1\nf 2/4/2 4/5/2 3/6/2\n");
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(mesh.attributes.uvs, (std::vector<V2d>{{0, 0}, {1, 0}, {0, 1}, {1, 1}}));
}

TEST(MeshSeams, MemoryOfSplitsIsBounded) {
  // A strip of 4000 faces, each with its own texture coordinates. 4002 vertices become 12000.
  std::string text;
  const int count = 4000;
  for (int i = 0; i < count + 2; ++i) text += fmt::format("v {} {} 0\n", i, i % 2);
  for (int i = 0; i < count; ++i) text += fmt::format("vt {} 0\n", i);
  for (int i = 1; i <= count; ++i)
    text += fmt::format("f {1}/{0} {2}/{0} {3}/{0}\n", i, i, i + 1, i + 2);
  EXPECT_EQ(parse("a.obj", text).positions.size(), 12000u);
  // Less than the sum of the text, the values of both lists and the final lists.
  EXPECT_THROW((void)parse("a.obj", text, {.maxMemory = text.size() + 12000 * (16 + 8 + 16)}),
               levelset::ResourceLimit);
  EXPECT_EQ(parse("a.obj", text, {.maxMemory = 8 << 20}).positions.size(), 12000u);
}

std::string ply(const std::string& properties, const std::string& values,
                const std::string& ofFaces = "", const std::string& behind = "") {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\n" +
      properties +
      "element face 1\n"
      "property list uchar int vertex_indices\n" +
      ofFaces + "end_header\n";
  for (const char* at : {"0 0 0 ", "1 0 0 ", "0 1 0 "}) text += at + values + "\n";
  return text + "3 0 1 2" + behind + "\n";
}

TEST(MeshSeams, PlyUsesTheFirstCompletePairOfTextureCoordinates) {
  const auto uvOf = [](const std::string& names, const std::string& values) {
    std::string properties;
    for (std::size_t i = 0; i < names.size(); i += 2)
      properties += std::string("property float ") + names[i] + "\n";
    const TriMesh mesh = parse("a.ply", ply(properties, values));
    return mesh.attributes.uvs.empty() ? V2d(-1) : mesh.attributes.uvs[1];
  };
  EXPECT_EQ(uvOf("s u v t", "1 2 3 4"), V2d(1, 4));
  EXPECT_EQ(uvOf("s u v", "1 2 3"), V2d(2, 3));
  EXPECT_EQ(uvOf("v t u", "1 2 3"), V2d(3, 1));
  EXPECT_EQ(uvOf("s v", "1 2"), V2d(-1));
}

TEST(MeshSeams, PlyWithUnknownTypesIsRefused) {
  const std::string normal = "property float nx\nproperty double ny\nproperty float nz\n";
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)parse("a.ply", ply(normal, "1e39 0 1")); }),
              "1e+39 exceeds the range");
  EXPECT_EQ(parse("a.ply", ply(normal, "0 1e39 1")).attributes.normals[0].y, 1e39);
  EXPECT_EQ(parse("a.ply", ply(normal, "1e39 0 1"), {.attributes = false}).triangles.size(), 1u);
  const std::string twice =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "9 9 9\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n";
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)parse("a.ply", twice); }),
              "the element 'vertex' occurs twice");
}

TEST(MeshSeams, IgnoredPropertiesAreReported) {
  std::vector<std::string> told;
  (void)parse("a.ply",
              ply("", "",
                  "property list uchar float texcoord\nproperty uchar red\nproperty uchar green\n"
                  "property uchar blue\n",
                  " 6 0 0 1 0 0 1 255 0 0"),
              {.unsupported = &told});
  EXPECT_EQ(told, (std::vector<std::string>{"colours of faces", "texture coordinates of faces"}));
  told.clear();
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n";
  (void)parse("a.obj", obj + "f 1/1 2/1 3/1\n", {.unsupported = &told});
  EXPECT_EQ(told, (std::vector<std::string>{"1 of 2 texture coordinates, which no face refers to",
                                            "1 of 1 normals, which no face refers to"}));
  told.clear();
  (void)parse("a.obj", obj + "f 1/1/1 2/2/1 3/1/1\n", {.unsupported = &told});
  (void)parse("a.obj", obj + "f 1 2 3\n", {.attributes = false, .unsupported = &told});
  EXPECT_TRUE(told.empty());
}

TEST(MeshSeams, AppendedMeshesUseTheCoarserPrecision) {
  TriMesh all = support::sphereMesh(1, V3d(0), 4), coarse = all;
  all.spacing = 1e-9;
  coarse.precision = levelset::CoordinatePrecision::Float;
  coarse.spacing = 1e-3;
  append(all, coarse);
  EXPECT_EQ(all.precision, levelset::CoordinatePrecision::Float);
  EXPECT_EQ(all.spacing, 1e-3);
  TriMesh first;
  append(first, coarse);
  EXPECT_EQ(first.precision, levelset::CoordinatePrecision::Float);
}

}  // namespace mesh_seams_test
