#include "levelset/mesh_files/mesh_file.h"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/mesh_files.h"

namespace mesh_file_test {

using levelset::CoordinatePrecision;
using levelset::InvalidInput;
using levelset::readMesh;
using levelset::TriMesh;
using support::append;
using support::kAsciiPly;
using support::parse;
using support::refusal;
using support::refused;
using support::says;
using support::TemporaryFolder;
using support::tetrahedron;
using support::writeText;

/// Triangles as nine numbers each, rotated so that the smallest corner leads, and sorted.
std::vector<std::array<double, 9>> canonical(const TriMesh& mesh) {
  std::vector<std::array<double, 9>> result;
  for (const auto& t : mesh.triangles) {
    std::array<std::array<double, 3>, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = {mesh.positions[t[k]].x, mesh.positions[t[k]].y, mesh.positions[t[k]].z};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::array<double, 9> flat;
    for (std::size_t k = 0; k < 9; ++k) flat[k] = corners[k / 3][k % 3];
    result.push_back(flat);
  }
  std::sort(result.begin(), result.end());
  return result;
}

// === Round trips

TEST(MeshFile, PreservesMeshesThroughWritingAndReading) {
  const TemporaryFolder folder;
  for (const auto precision : {CoordinatePrecision::Float, CoordinatePrecision::Double}) {
    const TriMesh mesh = tetrahedron(precision);
    for (const std::string name : {"a.ply", "a.obj", "a.off", "a.ply.gz", "A.OBJ.GZ", "a.off.gz"}) {
      levelset::writeMesh(folder / name, mesh);
      const TriMesh again = readMesh(folder / name);
      EXPECT_EQ(again.positions, mesh.positions) << name;
      EXPECT_EQ(again.triangles, mesh.triangles) << name;
      EXPECT_EQ(again.precision, precision) << name;
    }
  }
}

TEST(MeshFile, WritesStlAndMergesItsVertices) {
  const TemporaryFolder folder;
  for (const std::string name : {"a.stl", "a.stl.gz"}) {
    levelset::writeMesh(folder / name, tetrahedron());
    const TriMesh again = readMesh(folder / name);
    EXPECT_EQ(again.positions.size(), 4u) << name;
    EXPECT_EQ(canonical(again), canonical(tetrahedron())) << name;
    EXPECT_EQ(again.precision, CoordinatePrecision::Float) << name;
  }
  EXPECT_EQ(std::filesystem::file_size(folder / "a.stl"), 84u + 4 * 50);
}

TEST(MeshFile, RefusesStlIfSinglePrecisionIsTooCoarse) {
  const TemporaryFolder folder;
  TriMesh far = tetrahedron(CoordinatePrecision::Double);
  for (auto& p : far.positions) p.x += 1e8;
  TriMesh huge = tetrahedron(CoordinatePrecision::Double);
  for (auto& p : huge.positions) p *= 1e90;
  for (const TriMesh* mesh : {&far, &huge}) {
    EXPECT_THROW(levelset::writeMesh(folder / "far.stl", *mesh), levelset::InvalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder / "far.stl"));
  }
  // Coordinates that came from single precision are written unchanged.
  far.precision = CoordinatePrecision::Float;
  levelset::writeMesh(folder / "far.stl", far);
  EXPECT_TRUE(std::filesystem::exists(folder / "far.stl"));
}

TEST(MeshFile, WritesTheSameBytesTwice) {
  const TemporaryFolder folder;
  for (const std::string name : {"a.ply", "a.ply.gz", "a.obj", "a.stl"}) {
    levelset::writeMesh(folder / name, tetrahedron());
    const std::string first = support::readText(folder / name);
    levelset::writeMesh(folder / name, tetrahedron());
    EXPECT_EQ(support::readText(folder / name), first) << name;
  }
}

TEST(MeshFile, ReadsLargeFilesThroughManyBuffers) {
  TriMesh mesh;
  for (std::uint32_t i = 0; i < 200000; ++i) {
    mesh.positions.emplace_back(i, 0.25 * i, i % 7);
    if (i >= 2) mesh.triangles.push_back({i - 2, i - 1, i});
  }
  mesh.precision = CoordinatePrecision::Float;
  const TemporaryFolder folder;
  for (const std::string name : {"a.ply", "a.obj.gz", "a.stl", "a.off"}) {
    levelset::writeMesh(folder / name, mesh);
    const TriMesh again = readMesh(folder / name);
    EXPECT_EQ(again.positions, mesh.positions) << name;
    EXPECT_EQ(again.triangles, mesh.triangles) << name;
  }
}

// === OBJ

TEST(MeshFile, ReadsEveryFormOfObj) {
  const std::string text =
      "\xEF\xBB\xBF# made by hand\r\nmtllib a.mtl\r\no thing\\\r\n\r\n"
      "v 0 0 0\r\nv 1 0 0 0.5 0.5 0.5\r\n v\t1 \\\r\n 1 0 # corner\r\nv 0 1 0 1\r\n"
      "vt 0 0\r\nvn 0 0 1\r\ns off\r\n"
      "f 1 2 3\r\nf 1/1 2/1 3/1\r\nf 1//1 2//1 3//1\r\nf 1/1/1 2/1/1 3/1/1\r\n"
      "f -4 -3 -2\r\nf 1 2 \\\r\n3\r\nf -1/-1/-1 1// 3/\r\nf 1 2\r\nf\r\n"
      "f 1 2 3 4 # quad\r\nl 1 2\r\nf 1 2 3";
  // Two of the first three vertices have pairs of vt and vn that differ from the first pair.
  const TriMesh whole = parse("a.obj", text), mesh = parse("a.obj", text, {.attributes = false});
  ASSERT_EQ(whole.positions.size(), 4u + 3 * 2);
  ASSERT_EQ(whole.triangles.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(whole.positions[whole.triangles[i][k]], mesh.positions[mesh.triangles[i][k]]) << i;
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.positions[2], Imath::V3d(1, 1, 0));
  ASSERT_EQ(mesh.triangles.size(), 10u);
  for (const std::size_t i : {0, 1, 2, 3, 4, 5, 7, 9})
    EXPECT_EQ(mesh.triangles[i], (std::array<std::uint32_t, 3>{0, 1, 2})) << i;
  EXPECT_EQ(mesh.triangles[6], (std::array<std::uint32_t, 3>{3, 0, 2}));
  EXPECT_EQ(mesh.triangles[8], (std::array<std::uint32_t, 3>{0, 2, 3}));
}

TEST(MeshFile, ReadsObjWithFacesFirstAndLongLines) {
  EXPECT_EQ(parse("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").triangles.size(), 1u);
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n# " + std::string(3000000, 'x') + "\nf 1 2" +
                          std::string(1000000, ' ') + "3\n";
  EXPECT_EQ(parse("a.obj", obj).triangles.size(), 1u);
}

TEST(MeshFile, RefusesBrokenObj) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 4\n"), "line 4: a face refers to vertex 3");
  EXPECT_SAYS(refused("a.obj", vertices + "f 0 1 2\n"), "line 4: a face refers to vertex 0");
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 -4\n"), "line 4: a face refers to vertex -4");
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 99999999999\n"), "vertex 99999999998");
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 9999999999999999999999\n"), "line 4");
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 x\n"), "line 4: found 'x' where the index");
  EXPECT_SAYS(refused("a.obj", vertices + "f 1 2 3.5\n"), "line 4");
  EXPECT_SAYS(refused("a.obj", "v 0 0\n" + vertices + "f 1 2 3\n"),
              "line 1: a coordinate is missing");
  EXPECT_SAYS(refused("a.obj", "v 0 0 inf\n" + vertices + "f 1 2 3\n"),
              "line 1: the coordinate inf");
  EXPECT_SAYS(refused("a.obj", vertices), "3 vertices and no triangle");
  EXPECT_SAYS(refused("a.obj", "hello\n"), "no triangle");
  EXPECT_SAYS(refused("a.obj", std::string("v 0 0 0\n\0\1", 10)), "binary data");
}

TEST(MeshFile, ReportsThePrecisionOfText) {
  const std::string rest = "v 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(parse("a.obj", "v 0.5 0 0\n" + rest).precision, CoordinatePrecision::Float);
  EXPECT_EQ(parse("a.obj", "v 0.1 0 0\n" + rest).precision, CoordinatePrecision::Double);
}

// === STL

const std::string kAsciiStl =
    "solid a thing\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
    "   vertex 0 1 -0.0\n  endloop\n endfacet\n FACET NORMAL nan nan nan\n  OUTER LOOP\n"
    "   VERTEX -0 -0 0\n   VERTEX 0 1 0\n   VERTEX 0 0 1\n  ENDLOOP\n ENDFACET\nendsolid a thing\n";

std::string binaryStl(const std::string& header, const std::vector<std::array<float, 9>>& triangles,
                      std::uint32_t promised) {
  std::string stl = header;
  stl.resize(80, '\0');
  append(stl, promised, false);
  for (const auto& triangle : triangles) {
    stl.append(12, '\0');
    for (const float number : triangle) append(stl, number, false);
    stl.append(2, '\0');
  }
  return stl;
}

TEST(MeshFile, ReadsAsciiStl) {
  const TriMesh mesh = parse("a.stl", kAsciiStl);
  EXPECT_EQ(mesh.positions.size(), 4u);  // −0 is 0
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_FALSE(std::signbit(mesh.positions[2].z));
  EXPECT_EQ(parse("a.stl", kAsciiStl + kAsciiStl).triangles.size(), 4u);
}

TEST(MeshFile, ReadsBinaryStlWithAnyHeader) {
  const std::array<float, 9> triangle = {0, 0, 0, 1, 0, 0, 0, 1, -0.f};
  for (const std::string header : {"made by hand", "solid made by hand", "solid a\nfacet normal"}) {
    const TriMesh mesh = parse("a.stl", binaryStl(header, {triangle, triangle}, 2));
    EXPECT_EQ(mesh.positions.size(), 3u) << header;
    EXPECT_EQ(mesh.triangles.size(), 2u) << header;
    EXPECT_EQ(parse("a.stl", binaryStl(header, {triangle, triangle}, 2) + "\r\n").triangles.size(),
              2u);
    EXPECT_SAYS(refused("a.stl", binaryStl(header, {triangle, triangle}, 2) + "tail"),
                "has data after the 2 triangles");
    EXPECT_SAYS(refused("a.stl", binaryStl(header, {triangle, triangle}, 1)),
                "has data after the 1 triangles that its header promises (the file can hold 2)");
  }
}

TEST(MeshFile, RefusesBrokenStl) {
  const std::array<float, 9> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  EXPECT_SAYS(refused("a.stl", binaryStl("x", {triangle}, 2)),
              "promises 2 triangles but can hold only 1");
  EXPECT_SAYS(refused("a.stl", binaryStl("solid", {triangle}, 4000000000u)), "promises 4000000000");
  EXPECT_SAYS(refused("a.stl", binaryStl("x", {}, 0)), "no triangle");
  EXPECT_SAYS(refused("a.stl", "short"), "neither text");
  auto bad = triangle;
  bad[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_SAYS(refused("a.stl", binaryStl("x", {triangle, bad}, 2)),
              "triangle 1: the coordinate nan");
  bad[4] = -std::numeric_limits<float>::infinity();
  EXPECT_SAYS(refused("a.stl", binaryStl("x", {bad}, 1)), "triangle 0: the coordinate -inf");
  for (std::size_t size = 1; size + 15 < kAsciiStl.size(); ++size)
    ASSERT_FALSE(refused("a.stl", kAsciiStl.substr(0, size)).empty()) << size;
  EXPECT_SAYS(refused("a.stl", "solid x\nfacette\n"), "line 2: 'facette' is not a keyword");
}

// === OFF

TEST(MeshFile, ReadsOff) {
  const std::string body =
      "# counts\n4 2 0\n0 0 0 # first\n1 0 0 255 0 0\n\n1 1 0\n0 1 0\n"
      "3 0 1 2 0.5 0.5 0.5\n4 0 1 2 3\n";
  for (const std::string keyword : {"OFF\n", "OFF ", "COFF\r\n", "NOFF\n", "STCNOFF\n"}) {
    if (keyword.size() > 7) continue;
    const TriMesh mesh = parse("a.off", keyword + body);
    EXPECT_EQ(mesh.positions.size(), 4u) << keyword;
    EXPECT_EQ(mesh.positions[2], Imath::V3d(1, 1, 0)) << keyword;
    EXPECT_EQ(mesh.triangles.size(), 3u) << keyword;
  }
}

TEST(MeshFile, RefusesBrokenOff) {
  const std::string body = "\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(parse("a.off", "OFF" + body).triangles.size(), 1u);
  EXPECT_SAYS(refused("a.off", "4OFF" + body), "another dimension");
  EXPECT_SAYS(refused("a.off", "OFF BINARY" + body), "binary OFF");
  EXPECT_SAYS(refused("a.off", body), "does not begin with 'OFF'");
  EXPECT_SAYS(refused("a.off", "OFF\n3000000000 1 0\n0 0 0\n"), "promises 3000000000 vertices");
  EXPECT_SAYS(refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "refers to vertex 3");
  EXPECT_SAYS(refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n"),
              "non-negative integer");
  EXPECT_SAYS(refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1"), "the file ends");
}

// === Any format

TEST(MeshFile, RefusesEmptyMissingAndUnreadable) {
  const TemporaryFolder folder;
  for (const std::string extension : {"ply", "obj", "stl", "off", "ply.gz"}) {
    EXPECT_SAYS(refused("a." + extension, ""), "is empty") << extension;
    const auto sentence = refusal<levelset::IoError>(
        [&] { static_cast<void>(readMesh(folder / ("missing." + extension))); });
    EXPECT_SAYS(sentence, "there is no file");
  }
  std::filesystem::create_directory(folder / "folder.ply");
  EXPECT_SAYS(
      refusal<levelset::IoError>([&] { static_cast<void>(readMesh(folder / "folder.ply")); }),
      "is a directory");
  EXPECT_THROW(static_cast<void>(readMesh(folder / "a.xyz")), levelset::UsageError);
  EXPECT_THROW(static_cast<void>(readMesh("-")), levelset::UsageError);
  EXPECT_THROW(static_cast<void>(parse("a.ply", kAsciiPly, {.format = "xyz"})),
               levelset::UsageError);
}

TEST(MeshFile, ReadsByTheGivenFormat) {
  EXPECT_EQ(parse("noname", kAsciiPly, {.format = "ply"}).triangles.size(), 2u);
  EXPECT_EQ(parse("a.obj", kAsciiPly, {.format = "ply.gz"}).triangles.size(), 2u);
}

TEST(MeshFile, RecognizesFormatsByName) {
  for (const char* name : {"x.ply", "x.PLY.gz", "ply", "dir.x/a.obj", "stl.gz", "a.b.off"})
    EXPECT_TRUE(levelset::isMeshFormat(name)) << name;
  for (const char* name : {"x.vdb", "x.ply.bz2", "", "x", "x.gz", "a.ply/x"})
    EXPECT_FALSE(levelset::isMeshFormat(name)) << name;
}

std::string gzip(const std::string& text) {
  const TemporaryFolder folder;
  const gzFile file = gzopen((folder / "a.gz").c_str(), "wb");
  EXPECT_EQ(gzwrite(file, text.data(), static_cast<unsigned>(text.size())),
            static_cast<int>(text.size()));
  gzclose(file);
  return support::readText(folder / "a.gz");
}

TEST(MeshFile, RefusesDamagedCompression) {
  const std::string whole = gzip(kAsciiPly);
  EXPECT_EQ(parse("a.ply.gz", whole).triangles.size(), 2u);
  EXPECT_EQ(parse("a.ply.gz", gzip(kAsciiPly.substr(0, 50)) + gzip(kAsciiPly.substr(50)))
                .triangles.size(),
            2u);
  EXPECT_EQ(parse("a.ply.gz", whole + std::string(512, '\0')).triangles.size(), 2u);
  for (std::size_t size = 2; size < whole.size(); ++size)
    ASSERT_PRED2(says, refused("a.ply.gz", whole.substr(0, size)), "compressed data");
  std::string damaged = whole;
  damaged[whole.size() - 6] = static_cast<char>(damaged[whole.size() - 6] ^ 1);  // the checksum
  EXPECT_SAYS(refused("a.ply.gz", damaged), "is damaged");
}

TEST(MeshFile, StopsAGzipBombAtTheMemoryLimit) {
  const std::string bomb = gzip(std::string(64 << 20, '\n'));
  EXPECT_LT(bomb.size(), 100000u);
  const auto sentence = refusal<levelset::ResourceLimit>(
      [&] { static_cast<void>(parse("a.obj.gz", bomb, {.maxMemory = 16 << 20})); });
  EXPECT_SAYS(sentence, "when decompressed exceeds the memory limit");
}

TEST(MeshFile, RespectsTheMemoryLimit) {
  std::string obj;
  for (int i = 0; i < 200000; ++i) obj += "v 0 0 0\n";
  obj += "f 1 2 3\n";
  EXPECT_EQ(parse("a.obj", obj).positions.size(), 200000u);
  EXPECT_THROW(static_cast<void>(parse("a.obj", obj, {.maxMemory = 3000000})),
               levelset::ResourceLimit);
  EXPECT_THROW(static_cast<void>(parse("a.obj", obj, {.maxMemory = 1000})),
               levelset::ResourceLimit);
}

TEST(MeshFile, ReportsProgressAndCancels) {
  std::string obj;
  for (int i = 0; i < 300000; ++i) obj += "v 0 0 0\n";
  obj += "f 1 2 3\n";
  std::vector<double> seen;
  static_cast<void>(parse("a.obj", obj, {.progress = [&](double fraction) {
                            seen.push_back(fraction);
                            return true;
                          }}));
  EXPECT_GE(seen.size(), 5u);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1);
  EXPECT_THROW(
      static_cast<void>(parse("a.obj", obj, {.progress = [](double f) { return f < 0.5; }})),
      levelset::Cancelled);
}

TEST(MeshFile, ReportsTheContentsOfHeaders) {
  const TemporaryFolder folder;
  const auto info = [&](const std::string& name) { return levelset::meshFileInfo(folder / name); };
  for (const std::string name : {"a.ply", "a.ply.gz", "a.stl", "a.obj", "a.off"})
    levelset::writeMesh(folder / name, tetrahedron());
  EXPECT_EQ(info("a.ply").format, "ply, binary little endian");
  EXPECT_EQ(info("a.ply.gz").vertices, 4u);
  EXPECT_EQ(info("a.stl").format, "stl, binary");
  EXPECT_EQ(info("a.stl").faces, 4u);
  EXPECT_EQ(info("a.off").vertices, 4u);
  EXPECT_EQ(info("a.obj").vertices, 0u);
  EXPECT_THROW(static_cast<void>(info("missing.ply")), levelset::IoError);
}

TEST(MeshFile, SkipsControlCharacters) {
  const auto mesh = support::parse("a.obj", "v 0 0 0 \x02\nv 1 0 0\nv 0 1 0 \\ \nf 1 2 3 \x01\n",
                                   {.attributes = false});
  EXPECT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST(MeshFile, NamesTheFaceWithAnInvalidIndex) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n"
      "property uchar z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
  const auto sentence = refusal<levelset::InvalidInput>(
      [&] { (void)parse("a.ply", header + std::string("\0\0\0\3\0\0\7", 7)); });
  EXPECT_SAYS(sentence, "face 0: a face refers to vertex 7");
}

TEST(MeshFile, RefusesMeshesWithoutFacesOnceSeamsAreClosed) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "property float s\nproperty float t\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  const auto sentence = refusal<levelset::InvalidInput>([&] {
    (void)parse("a.ply", header + "1 0 0 0 0\n1 0 0 0 1\n1 0 0 1 1\n3 0 1 2\n",
                {.attributes = false});
  });
  EXPECT_SAYS(sentence, "none remains");
}

TEST(MeshFile, ReportsThatTheDiskIsFull) {
  const auto sentence = refusal<levelset::IoError>(
      [] { levelset::writeMesh("/dev/full", tetrahedron(), {.format = "ply"}); });
  EXPECT_SAYS(sentence, "No space left");
  const TemporaryFolder folder;
  EXPECT_THROW(levelset::writeMesh(folder / "missing/a.ply", tetrahedron()), levelset::IoError);
  EXPECT_THROW(levelset::writeMesh(folder / "a.xyz", tetrahedron()), levelset::UsageError);
}

}  // namespace mesh_file_test
