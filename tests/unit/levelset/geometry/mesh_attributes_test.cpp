#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/transform/transform.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/mesh_files.h"
#include "tests/support/meshes.h"

namespace mesh_attributes_test {

using Imath::M44d;
using Imath::V2d;
using Imath::V3d;
using Imath::V4f;
using levelset::ColorPrecision;
using levelset::CoordinatePrecision;
using levelset::InvalidInput;
using levelset::readMesh;
using levelset::TriMesh;
using support::parse;
using support::refusal;
using support::TemporaryFolder;
using support::writeText;

/// Tetrahedron with all attributes.
TriMesh dressed(CoordinatePrecision precision, ColorPrecision colors, bool hasAlpha) {
  TriMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0.25, -2.25}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  mesh.precision = precision;
  const bool isFloat = precision == CoordinatePrecision::Float;
  const double third = isFloat ? static_cast<double>(1.f / 3) : 1.0 / 3;
  mesh.attributes.normals = {{third, 0, 1}, {-1, third, 0}, {0, 0, 0}, {0, -third, 2}};
  mesh.attributes.uvs = {{0, third}, {1, 0}, {-0.5, 7}, {third, 0.125}};
  mesh.attributes.precision = precision;
  for (int i = 0; i < 4; ++i) {
    const auto part = [&](int k) {
      return colors == ColorPrecision::Byte ? static_cast<float>(60 * i + k) / 255.f
                                            : 0.1f + static_cast<float>(i * k) * 1.7f;
    };
    mesh.attributes.colors.emplace_back(part(0), part(1), part(2), hasAlpha ? part(3) : 1.f);
  }
  mesh.attributes.colorPrecision = colors;
  mesh.attributes.hasAlpha = hasAlpha;
  return mesh;
}

void expectEqual(const TriMesh& a, const TriMesh& b, const std::string& name) {
  EXPECT_EQ(a.positions, b.positions) << name;
  EXPECT_EQ(a.triangles, b.triangles) << name;
  EXPECT_EQ(a.attributes.normals, b.attributes.normals) << name;
  EXPECT_EQ(a.attributes.uvs, b.attributes.uvs) << name;
  EXPECT_EQ(a.attributes.colors, b.attributes.colors) << name;
  EXPECT_EQ(a.attributes.precision, b.attributes.precision) << name;
  EXPECT_EQ(a.attributes.colorPrecision, b.attributes.colorPrecision) << name;
  EXPECT_EQ(a.attributes.hasAlpha, b.attributes.hasAlpha) << name;
}

// === Files

TEST(MeshAttributes, FilesKeepAttributesToTheBit) {
  const TemporaryFolder folder;
  for (const auto precision : {CoordinatePrecision::Float, CoordinatePrecision::Double})
    for (const auto colors : {ColorPrecision::Byte, ColorPrecision::Float})
      for (const bool hasAlpha : {false, true}) {
        const TriMesh mesh = dressed(precision, colors, hasAlpha);
        for (const std::string name : {"a.ply", "a.obj", "a.ply.gz", "a.obj.gz"}) {
          levelset::writeMesh(folder / name, mesh);
          expectEqual(readMesh(folder / name), mesh, name);
        }
      }
}

TEST(MeshAttributes, EachAttributeAloneIsKept) {
  const TemporaryFolder folder;
  const TriMesh all = dressed(CoordinatePrecision::Double, ColorPrecision::Byte, false);
  for (int kept = 0; kept < 3; ++kept) {
    TriMesh mesh = all;
    if (kept != 0) mesh.attributes.normals.clear();
    if (kept != 1) mesh.attributes.uvs.clear();
    if (kept != 2) mesh.attributes.colors.clear();
    if (kept == 2) mesh.attributes.precision = CoordinatePrecision::Float;
    for (const std::string name : {"a.ply", "a.obj"}) {
      levelset::writeMesh(folder / name, mesh);
      expectEqual(readMesh(folder / name), mesh, name);
    }
    EXPECT_EQ(levelset::meshFileInfo(folder / "a.ply").attributes, describe(mesh.attributes));
  }
  EXPECT_EQ(describe(all.attributes), "normals, texture coordinates and colours");
}

TEST(MeshAttributes, AllByteValuesOfColoursAreKept) {
  // Text in OBJ, then bytes again in PLY.
  const TemporaryFolder folder;
  TriMesh mesh;
  for (int i = 0; i < 256; ++i) {
    mesh.positions.emplace_back(i, i % 3, i % 5);
    mesh.attributes.colors.emplace_back(static_cast<float>(i) / 255.f, 0, 1, 1);
  }
  mesh.triangles = {{0, 1, 2}};
  levelset::writeMesh(folder / "a.obj", mesh);
  const TriMesh text = readMesh(folder / "a.obj");
  EXPECT_EQ(text.attributes.colorPrecision, ColorPrecision::Byte);
  levelset::writeMesh(folder / "a.ply", text);
  EXPECT_EQ(readMesh(folder / "a.ply").attributes.colors, mesh.attributes.colors);
}

TEST(MeshAttributes, PlyOfOtherProgramsIsRead) {
  const TriMesh mesh = parse(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty uchar red\nproperty float x\n"
      "property float y\nproperty float z\nproperty float quality\nproperty uchar green\n"
      "property uchar blue\nproperty double nx\nproperty double ny\nproperty double nz\n"
      "property float texture_u\nproperty float texture_v\nproperty float u\nproperty float v\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "255 0 0 0 7 51 0 0 0 1 0.5 0.25 8 8\n0 1 0 0 7 0 102 0 1 0 0 1 8 8\n"
      "0 0 1 0 7 0 0 0.1 0 0 1 0 8 8\n3 0 1 2\n");
  EXPECT_EQ(mesh.precision, CoordinatePrecision::Float);
  EXPECT_EQ(mesh.attributes.precision, CoordinatePrecision::Double);
  EXPECT_EQ(mesh.attributes.normals, (std::vector<V3d>{{0, 0, 1}, {0, 1, 0}, {0.1, 0, 0}}));
  EXPECT_EQ(mesh.attributes.uvs, (std::vector<V2d>{{0.5, 0.25}, {0, 1}, {1, 0}}));
  EXPECT_EQ(mesh.attributes.colors,
            (std::vector<V4f>{{1, 0.2f, 0, 1}, {0, 0, 0.4f, 1}, {0, 0, 0, 1}}));
  EXPECT_FALSE(mesh.attributes.hasAlpha);
}

TEST(MeshAttributes, IncompleteGroupsAreIgnored) {
  const TriMesh mesh =
      parse("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
            "property float z\nproperty float nx\nproperty float s\nproperty int red\n"
            "property int green\nproperty int blue\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n"
            "0 0 0 1 1 9 9 9\n1 0 0 1 1 9 9 9\n0 1 0 1 1 9 9 9\n3 0 1 2\n");
  EXPECT_TRUE(mesh.attributes.isEmpty());
}

TEST(MeshAttributes, InvalidValuesAreRefusedWithTheirPosition) {
  const auto ply = [](const char* type, const char* names, const std::string& values) {
    std::string header =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\n";
    for (const char* p = names; *p; p += std::strlen(p) + 1)
      header += fmt::format("property {} {}\n", type, p);
    return header + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
           "0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 " + values + "\n3 0 1 2\n";
  };
  const std::string nans = ply("float", "nx\0ny\0nz\0", "0 nan 1");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)parse("a.ply", nans); }),
              "line 15: a normal holds nan");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)parse("a.ply", nans); }), "--no-attributes");
  EXPECT_TRUE(parse("a.ply", nans, {.attributes = false}).attributes.isEmpty());
  EXPECT_SAYS(refusal<InvalidInput>(
                  [&] { (void)parse("a.ply", ply("uchar", "red\0green\0blue\0", "0 256 1")); }),
              "a colour holds 256");
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto refused = [&](const std::string& more) {
    return refusal<InvalidInput>([&] { (void)parse("a.obj", obj + more); });
  };
  EXPECT_SAYS(refused("vn 0 0 nan\nf 1//1 2//1 3//1\n"), "line 4: a coordinate of a normal is nan");
  EXPECT_SAYS(refused("vn 0 0\nf 1//1 2//1 3//1\n"), "a coordinate of a normal is missing");
  EXPECT_SAYS(refused("vt 0 inf\nf 1/1 2/1 3/1\n"), "a texture coordinate is inf");
  EXPECT_SAYS(refused("vt 0 0\nvt 1 0\nf 1/1 2/2 3/3\n"),
              "line 6: a face refers to texture coordinate 3, but the file has only 2");
  EXPECT_SAYS(refused("vn 0 0 1\nf 1//1 2//-2 3//1\n"), "refers to normal -2, but only 1 precede");
  EXPECT_SAYS(refused("vn 0 0 1\nf 1//0 2//1 3//1\n"), "refers to normal 0, but OBJ counts from 1");
  EXPECT_SAYS(refused("v 1 1 1 0.5 oops 0\nf 1 2 3\n"), "found 'oops' where a weight or colour");
  EXPECT_SAYS(refused("vn 0 0 1\nf 1//1 2//1 9//1\n"),
              "vertex 8 (counted from 0), but the mesh has 3");
  EXPECT_EQ(parse("a.obj", obj + "vn 0 0 nan\nf 1//1 2//7 3//1\n", {.attributes = false})
                .triangles.size(),
            1u);
}

TEST(MeshAttributes, ListsOfWrongLengthAreRefused) {
  const TemporaryFolder folder;
  const TriMesh mesh = dressed(CoordinatePrecision::Float, ColorPrecision::Byte, false);
  TriMesh bad = mesh;
  bad.attributes.normals.pop_back();
  EXPECT_SAYS(refusal<InvalidInput>([&] { levelset::writeMesh(folder / "a.ply", bad); }),
              "the mesh has 3 normals for 4 vertices");
  EXPECT_THROW((void)transform(bad, M44d()), InvalidInput);
  bad = mesh;
  bad.attributes.uvs[2].y = std::numeric_limits<double>::infinity();
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)transform(bad, M44d()); }),
              "the texture coordinate of vertex 2 holds inf");
  bad = mesh;
  bad.attributes.colors[1].w = std::numeric_limits<float>::quiet_NaN();
  EXPECT_SAYS(refusal<InvalidInput>([&] { levelset::writeMesh(folder / "a.obj", bad); }),
              "the colour of vertex 1 holds nan");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.obj"));
}

TEST(MeshAttributes, ObjSplitsVerticesAtSeams) {
  // Two triangles that share an edge. Both ends of the edge have two normals, and one end has two
  // texture coordinates.
  const TriMesh mesh = parse("a.obj",
                             "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nv 1 1 0\nvt 0 0\nvt 1 1\n"
                             "vn 0 0 1\nvn 0 0 2\nvn 7 7 7\n"
                             "f 1/1/1 2/1/1 3/1/1\nf 3/1/2 2/2/2 4//2\n");
  EXPECT_EQ(mesh.positions,
            (std::vector<V3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {4, 5, 3}}));
  EXPECT_EQ(mesh.attributes.normals,
            (std::vector<V3d>{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 2}, {0, 0, 2}, {0, 0, 2}}));
  EXPECT_EQ(mesh.attributes.uvs,
            (std::vector<V2d>{{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 1}}));
  // Vertices without a colour are white; a split vertex keeps the colour of the original.
  EXPECT_EQ(
      mesh.attributes.colors,
      (std::vector<V4f>{
          {1, 0, 0, 1}, {1, 1, 1, 1}, {0, 0, 1, 1}, {1, 1, 1, 1}, {0, 0, 1, 1}, {1, 1, 1, 1}}));
}

/// A cube with a normal for each face, as polygons. All edges are seams.
std::string cubeObj() {
  return "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
         "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n"
         "f 1//1 3//1 4//1 2//1\nf 5//2 6//2 8//2 7//2\nf 1//3 2//3 6//3 5//3\n"
         "f 3//4 7//4 8//4 4//4\nf 1//5 5//5 7//5 3//5\nf 2//6 4//6 8//6 6//6\n";
}

TEST(MeshAttributes, SeamsKeepASolidClosed) {
  const TriMesh mesh = parse("a.obj", cubeObj()),
                bare = parse("a.obj", cubeObj(), {.attributes = false});
  EXPECT_EQ(bare.positions.size(), 8u);
  ASSERT_EQ(mesh.positions.size(), 24u);
  for (const auto& t : mesh.triangles) {
    const V3d normal = (mesh.positions[t[1]] - mesh.positions[t[0]])
                           .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (const std::uint32_t v : t) EXPECT_EQ(mesh.attributes.normals[v], normal);
  }
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  const levelset::Measurement m = measure(mesh);
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.euler, 2);
  EXPECT_DOUBLE_EQ(m.meanCurvature, measure(bare).meanCurvature);
  const auto band = levelset::meshToBand(mesh, 0.1), plain = levelset::meshToBand(bare, 0.1);
  EXPECT_TRUE(band.certificate.closed);
  EXPECT_EQ(band.band.contentHash(), plain.band.contentHash());
}

TEST(MeshAttributes, ManyPairsAtOneVertexAreFast) {
  // A fan whose hub has a texture coordinate for each face.
  std::string text = "v 0 0 0\n";
  const int count = 20000;
  for (int i = 0; i < count; ++i)
    text += fmt::format("v {} {} 0\nvt {} 0\n", std::cos(6.28 * i / count),
                        std::sin(6.28 * i / count), i);
  for (int i = 1; i < count; ++i) text += fmt::format("f 1/{0} {1}/{0} {2}/{0}\n", i, i + 1, i + 2);
  const TriMesh mesh = parse("a.obj", text);
  EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(count - 1));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      ASSERT_EQ(mesh.attributes.uvs[v].x, static_cast<double>(i));
}

// === Transforms

TEST(MeshAttributes, TransformKeepsNormalsPerpendicular) {
  const TriMesh mesh = parse("a.obj", cubeObj());
  M44d matrix;
  matrix.setScale(V3d(2, 0.5, -1));  // mirrors
  M44d shear;
  shear[1][0] = 0.7;
  const TriMesh moved = transform(mesh, matrix * shear);
  EXPECT_GT(levelset::signedVolume(moved), 0);
  for (const auto& t : moved.triangles) {
    const V3d normal = (moved.positions[t[1]] - moved.positions[t[0]])
                           .cross(moved.positions[t[2]] - moved.positions[t[0]])
                           .normalized();
    for (const std::uint32_t v : t)
      EXPECT_LT((moved.attributes.normals[v] - normal).length(), support::doubleRounding(1));
  }
  TriMesh full = dressed(CoordinatePrecision::Float, ColorPrecision::Byte, true);
  const TriMesh shifted = transform(full, M44d().setTranslation(V3d(1, 2, 3)));
  EXPECT_EQ(shifted.attributes.normals, full.attributes.normals);
  const TriMesh turned = transform(full, M44d().setAxisAngle(V3d(0, 0, 1), 1.0));
  EXPECT_EQ(turned.attributes.uvs, full.attributes.uvs);
  EXPECT_EQ(turned.attributes.colors, full.attributes.colors);
  EXPECT_EQ(turned.attributes.normals[2], V3d(0));  // has no direction, as before
}

TEST(MeshAttributes, CarriedNormalsSurviveAnyScale) {
  const V3d n(1, 2, -3);
  for (const double scale : {1e-150, 1.0, 1e150})
    EXPECT_LT((levelset::transformedNormal(
                   n * scale, {V3d(scale, 0, 0), V3d(0, scale, 0), V3d(0, 0, scale)}, 1) -
               n.normalized())
                  .length(),
              support::doubleRounding(1));
  // A map with a small extent in one direction is not flat.
  EXPECT_EQ(
      levelset::transformedNormal({1, 0, 0}, {V3d(1, 0, 0), V3d(0, 1e-9, 0), V3d(0, 0, 1e-9)}, 1),
      V3d(1, 0, 0));
  EXPECT_EQ(
      levelset::transformedNormal({0, 0, 1}, {V3d(1, 2, 0.1), V3d(3, 6, 0.3), V3d(0, 0, 1)}, 1),
      V3d(0));
}

TEST(MeshAttributes, AppendKeepsCommonAttributes) {
  TriMesh all;
  const TriMesh mesh = dressed(CoordinatePrecision::Float, ColorPrecision::Byte, false);
  append(all, mesh);
  append(all, mesh);
  EXPECT_EQ(all.positions.size(), 8u);
  EXPECT_EQ(all.triangles[4], (std::array<std::uint32_t, 3>{4, 5, 6}));
  EXPECT_EQ(all.attributes.normals[7], mesh.attributes.normals[3]);
  TriMesh bald = mesh;
  bald.attributes.uvs.clear();
  append(all, bald);
  EXPECT_TRUE(all.attributes.uvs.empty());
  EXPECT_EQ(all.attributes.colors.size(), 12u);
}

}  // namespace mesh_attributes_test
