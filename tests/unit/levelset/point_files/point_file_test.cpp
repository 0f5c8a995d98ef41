#include "levelset/point_files/point_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"
#include "tests/support/meshes.h"

namespace point_file_test {

using Imath::V3d;
using Imath::V3f;
using Imath::V4f;
using levelset::CoordinatePrecision;
using levelset::InvalidInput;
using levelset::PointCloud;
using levelset::readPoints;
using levelset::UsageError;
using levelset::writePoints;
using support::refusal;
using support::TemporaryFolder;
using support::writeText;

PointCloud smallCloud(bool hasAttributes) {
  PointCloud cloud;
  cloud.positions = {V3d(0.1, -2.5e-7, 1e6), V3d(1.0 / 3, 4, -5), V3d(7, 8, 9)};
  if (!hasAttributes) return cloud;
  cloud.normals = {V3f(0, 0, 1), V3f(0.6f, -0.8f, 0), V3f(0)};
  cloud.colors = {V4f(1, 0, 0.2f, 1), V4f(0, 1, 0, 1), V4f(3.0f / 255, 2.0f / 255, 0, 1)};
  cloud.radii = {0.5f, 1e-3f, 2};
  cloud.weights = {0, 1, 0.25f};
  return cloud;
}

PointCloud readText(const TemporaryFolder& folder, const char* name, const std::string& text) {
  writeText(folder / name, text);
  return readPoints(folder / name);
}

std::string refused(const TemporaryFolder& folder, const char* name, const std::string& text) {
  writeText(folder / name, text);
  return refusal<InvalidInput>([&] { (void)readPoints(folder / name); });
}

TEST(PointFiles, RoundTripsKeepEachAttributeThatTheFormatHolds) {
  const TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.obj", "a.xyz", "a.csv", "a.pts", "a.ply.gz", "a.csv.gz"})
    for (const bool hasAttributes : {false, true}) {
      SCOPED_TRACE(name);
      const PointCloud cloud = smallCloud(hasAttributes);
      writePoints(folder / name, cloud);
      const PointCloud read = readPoints(folder / name);
      const std::string lost = levelset::unwritableAttributes(name, cloud);
      EXPECT_EQ(read.positions, cloud.positions);
      EXPECT_EQ(read.precision, CoordinatePrecision::Double);
      const auto isLost = [&](const char* what) { return lost.find(what) != std::string::npos; };
      EXPECT_EQ(read.normals, isLost("normals") ? decltype(read.normals)() : cloud.normals);
      EXPECT_EQ(read.colors, isLost("colours") ? decltype(read.colors)() : cloud.colors);
      EXPECT_EQ(read.radii, isLost("radii") ? decltype(read.radii)() : cloud.radii);
      EXPECT_EQ(read.weights, isLost("weights") ? decltype(read.weights)() : cloud.weights);
    }
  EXPECT_EQ(levelset::unwritableAttributes("a.ply", smallCloud(true)), "");
  EXPECT_EQ(levelset::unwritableAttributes("a.obj", smallCloud(true)), "radii and weights");
  EXPECT_EQ(levelset::unwritableAttributes("a.pts", smallCloud(true)),
            "normals, radii and weights");
}

TEST(PointFiles, FloatsStayFloats) {
  const TemporaryFolder folder;
  PointCloud cloud = smallCloud(false);
  for (V3d& p : cloud.positions) p = V3d(V3f(p));
  cloud.precision = CoordinatePrecision::Float;
  for (const char* name : {"a.ply", "a.obj", "a.xyz", "a.csv", "a.pts"}) {
    writePoints(folder / name, cloud);
    const PointCloud read = readPoints(folder / name);
    EXPECT_EQ(read.positions, cloud.positions) << name;
    EXPECT_EQ(read.precision, CoordinatePrecision::Float) << name;
  }
}

TEST(PointFiles, ColumnsFollowFromTheirNumber) {
  const TemporaryFolder folder;
  const PointCloud three = readText(folder, "a.xyz", "# a scan\n\n1 2 3\r\n4\t5 6e0\n+7, -8, .5");
  EXPECT_EQ(three.positions, (std::vector{V3d(1, 2, 3), V3d(4, 5, 6), V3d(7, -8, 0.5)}));
  EXPECT_EQ(readText(folder, "a.xyz", "1 2 3 -400\n4 5 6 7\n").size(), 2u);
  const PointCloud normals = readText(folder, "a.xyz", "1 2 3 0 0 1\n4 5 6 1 0 0\n");
  EXPECT_EQ(normals.normals, (std::vector{V3f(0, 0, 1), V3f(1, 0, 0)}));
  EXPECT_TRUE(normals.colors.empty());
  const PointCloud colors = readText(folder, "a.xyz", "1 2 3 0 0 1\n4 5 6 255 51 0\n");
  EXPECT_TRUE(colors.normals.empty());
  EXPECT_EQ(colors.colors[1], V4f(1, 0.2f, 0, 1));
  EXPECT_EQ(colors.colors[0], V4f(0, 0, 1.0f / 255, 1));
  const PointCloud seven = readText(folder, "a.xyz", "1 2 3 99 0.5 0.25 1\n");
  EXPECT_EQ(seven.colors[0], V4f(0.5f, 0.25f, 1, 1));
  const PointCloud nine = readText(folder, "a.csv", "1,2,3,0,1,0,255,0,0\n");
  EXPECT_EQ(nine.normals[0], V3f(0, 1, 0));
  EXPECT_EQ(nine.colors[0], V4f(1, 0, 0, 1));
}

TEST(PointFiles, ColumnsFollowFromNames) {
  const TemporaryFolder folder;
  writeText(folder / "a.csv",
            "time,\"Z\",X,y,Red,green,BLUE,a,Radius,confidence\n9,3,1,2,255,0,51,0,0.5,0.75\n");
  std::vector<std::string> notes;
  const PointCloud cloud = readPoints(folder / "a.csv", {.notes = &notes});
  EXPECT_EQ(cloud.positions[0], V3d(1, 2, 3));
  EXPECT_EQ(cloud.colors[0], V4f(1, 0, 0.2f, 0));
  EXPECT_EQ(cloud.radii[0], 0.5f);
  EXPECT_EQ(cloud.weights[0], 0.75f);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_SAYS(notes[0], "'time'");
  // The name of a column may stand in a comment, as other programs write it.
  const PointCloud commented = readText(folder, "a.xyz", "//X Y Z R G B\n1 2 3 0 0 1\n");
  EXPECT_EQ(commented.colors[0], V4f(0, 0, 1, 1));
  // A normal with two coordinates is none.
  EXPECT_TRUE(readText(folder, "a.csv", "x,y,z,nx,ny\n1,2,3,4,5\n").normals.empty());
}

TEST(PointFiles, DecimalCommasAreRefused) {
  const TemporaryFolder folder;
  for (const char* text : {"1,5;2,5;3,5\n", "1;2;3\n1;2,5;3\n", "1,5 2,5 3,5\n", "x;y;z\n1,5;2;3\n",
                           "1 2,5\t3\n", "1,5;2,5;\n"})
    EXPECT_SAYS(refused(folder, "a.csv", text), "decimal commas") << text;
  EXPECT_SAYS(refused(folder, "a.pts", "1\n1,5 2,5 3,5\n"), "decimal commas");
  EXPECT_EQ(readText(folder, "a.csv", "1 , 2,\t3 \n4;5; 6\n").positions,
            (std::vector{V3d(1, 2, 3), V3d(4, 5, 6)}));
}

TEST(PointFiles, AllLineEndsAreKnown) {
  const TemporaryFolder folder;
  const std::vector points = {V3d(1, 2, 3), V3d(4, 5, 6), V3d(7, 8, 9)};
  for (const std::string end : {"\n", "\r\n", "\r"})
    for (const bool isLast : {false, true}) {
      const std::string text =
          "1 2 3" + end + end + "4 5 6" + end + "7 8 9" + (isLast ? end : std::string());
      EXPECT_EQ(readText(folder, "a.xyz", "# a scan" + end + text).positions, points);
      EXPECT_EQ(readText(folder, "a.pts", "3" + end + text).positions, points);
      EXPECT_SAYS(refused(folder, "a.xyz", text + end + "0 x 0"), isLast ? "line 6" : "line 5");
    }
  EXPECT_EQ(readText(folder, "a.xyz", "1 2 3\r4 5 6\n7 8 9\r\n").positions, points);
}

TEST(PointFiles, CommentsDoNotShiftColumns) {
  const TemporaryFolder folder;
  // As many words as columns, with a label before the names.
  EXPECT_EQ(readText(folder, "a.xyz", "# format: x y z\n1 2 3 4\n").positions[0], V3d(1, 2, 3));
  EXPECT_EQ(readText(folder, "a.xyz", "# axes = x y z up\n1 2 3 0 0 1\n").positions[0],
            V3d(1, 2, 3));
  // Names with the coordinates in front, whatever follows.
  const PointCloud named =
      readText(folder, "a.xyz", "# y x z nx ny nz intensity(dB)\n1 2 3 0 0 1 -9\n");
  EXPECT_EQ(named.positions[0], V3d(2, 1, 3));
  EXPECT_EQ(named.normals[0], V3f(0, 0, 1));
  EXPECT_EQ(readText(folder, "a.xyz", "# x nx y ny z nz\n1 0 2 0 3 1\n").positions[0],
            V3d(1, 2, 3));
  // Either the names of four columns, or a text.
  EXPECT_SAYS(refused(folder, "a.xyz", "# time x y z\n9 1 2 3\n"), "may name the columns or not");
  EXPECT_EQ(readText(folder, "a.xyz", "time x y z\n9 1 2 3\n").positions[0], V3d(1, 2, 3));
}

TEST(PointFiles, TheNumberOfPointsMayStandBeforeThem) {
  const TemporaryFolder folder;
  const std::vector points = {V3d(1, 2, 3), V3d(4, 5, 6)};
  for (const std::string head : {"//X Y Z\n2\n", "2\n", "X Y Z\n2\n", "2\nX,Y,Z\n"}) {
    EXPECT_EQ(readText(folder, "a.xyz", head + "1 2 3\n4 5 6\n").positions, points) << head;
    EXPECT_EQ(levelset::pointFileInfo(folder / "a.xyz").points, 2u) << head;
    EXPECT_SAYS(refused(folder, "a.xyz", head + "1 2 3\n"), "promises 2 points and holds 1");
    EXPECT_SAYS(refused(folder, "a.xyz", head), "holds no points");
  }
}

TEST(PointFiles, DarkColorsKeepTheirBytes) {
  const TemporaryFolder folder;
  PointCloud cloud = smallCloud(false);
  const float one = 1.0f / 255;
  for (const V4f& brightest : {V4f(0, 0, 0, 1), V4f(one, 0, 0, 1), V4f(2 * one, one, 0, 1),
                               V4f(one, 0, one, one), V4f(1, 0, 0, one)})
    for (const char* name : {"a.ply", "a.obj", "a.xyz", "a.csv", "a.pts"}) {
      const std::string text = name;
      const bool hasAlpha =
          brightest[3] == 1 || text == "a.ply" || text == "a.obj" || text == "a.csv";
      if (!hasAlpha) continue;
      cloud.colors = {V4f(0, one, 0, 1), brightest, V4f(0, 0, 0, 1)};
      if (brightest[3] != 1) cloud.colors[0][3] = cloud.colors[2][3] = 0;
      writePoints(folder / name, cloud);
      EXPECT_EQ(readPoints(folder / name).colors, cloud.colors) << name << brightest;
    }
}

TEST(PointFiles, ObjColorsMayBeBytes) {
  const TemporaryFolder folder;
  EXPECT_EQ(readText(folder, "a.obj", "v 1 0 0 51 0 0\nv 2 0 0\nv 3 0 0 1 0 255\nv 4 0 0\n").colors,
            (std::vector{V4f(0.2f, 0, 0, 1), V4f(1), V4f(1.0f / 255, 0, 1, 1), V4f(1)}));
  EXPECT_EQ(readText(folder, "a.obj", "v 1 0 0 51 0 0 255\nv 2 0 0 0 0 0 0\n").colors,
            (std::vector{V4f(0.2f, 0, 0, 1), V4f(0)}));
  EXPECT_SAYS(refused(folder, "a.obj", "v 1 0 0 256 0 0\n"), "between 0 and 255");
  EXPECT_SAYS(refused(folder, "a.obj", "v 1 0 0 0 -1 0\n"), "between 0 and 255");
  // Intensities above 1 are limited, so that they are not taken for bytes.
  PointCloud bright = smallCloud(false);
  bright.colors = {V4f(1.5f, 0.25f, 0, 1), V4f(-1, 0, 0, 1), V4f(1)};
  writePoints(folder / "a.obj", bright);
  EXPECT_EQ(readPoints(folder / "a.obj").colors[0], V4f(1, 0.25f, 0, 1));
  EXPECT_EQ(readPoints(folder / "a.obj").colors[1], V4f(0, 0, 0, 1));
}

TEST(PointFiles, PtsHasBlocksWithCounts) {
  const TemporaryFolder folder;
  const PointCloud cloud =
      readText(folder, "a.pts", "2\n1 2 3 -100 255 0 0\n4 5 6 7 0 51 0\n1\n7 8 9 0 0 0 0\n");
  EXPECT_EQ(cloud.size(), 3u);
  EXPECT_EQ(cloud.colors[1], V4f(0, 0.2f, 0, 1));
  EXPECT_SAYS(refused(folder, "a.pts", "3\n1 2 3\n4 5 6\n"), "ends after 2 of 3");
  EXPECT_SAYS(refused(folder, "a.pts", "1\n1 2 3\n4 5 6\n"), "number of points is missing");
  EXPECT_SAYS(refused(folder, "a.pts", "1 2 3\n4 5 6\n"), "with --format xyz");
  // Six columns are a colour, since PTS has no normals.
  EXPECT_EQ(readText(folder, "a.pts", "1\n1 2 3 0 0 1\n").colors[0], V4f(0, 0, 1, 1));
  EXPECT_SAYS(refused(folder, "a.pts", "3\n1 2 3\n4 5 6\n2\n"), "only 2 of 3 points");
  EXPECT_SAYS(refused(folder, "a.pts", "99999\n1 2 3\n"), "more than the file can hold");
  EXPECT_SAYS(refused(folder, "a.pts", "1\n1 2\n"), "3, 4, 6 or 7");
}

TEST(PointFiles, PlyOfAScannerIsRead) {
  const TemporaryFolder folder;
  const PointCloud cloud = readText(
      folder, "a.ply",
      "ply\nformat ascii 1.0\ncomment scan\nelement camera 1\nproperty list uchar float pose\n"
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "intensity\nproperty float confidence\nproperty ushort red\nproperty ushort green\nproperty "
      "ushort blue\nend_header\n2 1 2\n0.1 2 3 0.5 0.25 65535 0 13107\n4 5 6 0 1 0 0 0\n");
  EXPECT_EQ(cloud.positions[0], V3d(double(0.1f), 2, 3));
  EXPECT_EQ(cloud.weights, (std::vector{0.25f, 1.0f}));
  EXPECT_EQ(cloud.colors[0], V4f(1, 0, 0.2f, 1));
  EXPECT_EQ(cloud.precision, CoordinatePrecision::Float);
}

TEST(PointFiles, BigEndianPlyIsRead) {
  const TemporaryFolder folder;
  std::string text =
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double x\nproperty double y\n"
      "property double z\nend_header\n";
  for (const double number : {1.5, -2.0, 3e10}) {
    char bytes[8];
    std::memcpy(bytes, &number, 8);
    text.append(std::reverse_iterator(bytes + 8), std::reverse_iterator(bytes));
  }
  EXPECT_EQ(readText(folder, "a.ply", text).positions[0], V3d(1.5, -2, 3e10));
}

TEST(PointFiles, FilesWithoutFacesAreClouds) {
  const TemporaryFolder folder;
  const levelset::TriMesh mesh = support::boxMesh(V3d(0), V3d(1));
  for (const char* name : {"a.ply", "a.obj", "a.ply.gz", "a.obj.gz"}) {
    writePoints(folder / name, smallCloud(true));
    EXPECT_TRUE(levelset::lacksFaces(folder / name)) << name;
    levelset::writeMesh(folder / name, mesh);
    EXPECT_FALSE(levelset::lacksFaces(folder / name)) << name;
    // The vertices of a mesh can be read as points.
    EXPECT_EQ(readPoints(folder / name).positions, mesh.positions) << name;
  }
  EXPECT_FALSE(levelset::lacksFaces(folder / "none.ply"));
  EXPECT_FALSE(levelset::lacksFaces(folder / "a.stl"));
  writeText(folder / "a.obj", "vn 0 0 1\n  v 1 2 3\nfoo 1\n#f 1 2 3\n");
  EXPECT_TRUE(levelset::lacksFaces(folder / "a.obj"));
}

TEST(PointFiles, ObjNormalsNeedOneForEachPoint) {
  const TemporaryFolder folder;
  writeText(folder / "a.obj", "v 1 2 3\nv 4 5 6 0.5 1 0\nvn 0 0 1\n");
  std::vector<std::string> notes;
  const PointCloud cloud = readPoints(folder / "a.obj", {.notes = &notes});
  EXPECT_TRUE(cloud.normals.empty());
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_SAYS(notes[0], "1 normals");
  EXPECT_EQ(cloud.colors, (std::vector{V4f(1), V4f(0.5f, 1, 0, 1)}));
}

TEST(PointFiles, AttributesCanBeLeftOut) {
  const TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.obj", "a.xyz", "a.csv", "a.pts"}) {
    writePoints(folder / name, smallCloud(true));
    const PointCloud read = readPoints(folder / name, {.attributes = false});
    EXPECT_EQ(read.positions, smallCloud(true).positions) << name;
    EXPECT_EQ(describe(read), "") << name;
  }
}

TEST(PointFiles, InfoReadsTheHeaderOnly) {
  const TemporaryFolder folder;
  writePoints(folder / "a.ply", smallCloud(true));
  EXPECT_EQ(levelset::pointFileInfo(folder / "a.ply").points, 3u);
  EXPECT_EQ(levelset::pointFileInfo(folder / "a.ply").attributes,
            "normals, colours, radii and weights");
  writePoints(folder / "a.csv", smallCloud(true));
  EXPECT_EQ(levelset::pointFileInfo(folder / "a.csv").attributes,
            "normals, colours, radii and weights");
  writePoints(folder / "a.pts", smallCloud(true));
  EXPECT_EQ(levelset::pointFileInfo(folder / "a.pts").points, 3u);
}

TEST(PointFiles, DamagedFilesAreRefusedWithThePlace) {
  const TemporaryFolder folder;
  EXPECT_SAYS(refused(folder, "a.xyz", ""), "empty");
  EXPECT_SAYS(refused(folder, "a.xyz", "# nothing\n"), "holds no points");
  EXPECT_SAYS(refused(folder, "a.csv", "x,y,z\n"), "holds no points");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3\n1 2 nan\n"), "line 2");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3\n1 2 nan\n"), "nan is not a finite number");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 inf\n"), "not a finite number");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 1e999\n"), "not a finite number");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 1e39\n"), "beyond the range of float");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3\n1 2\n"), "has 2 numbers");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3\n1 2 x\n"), "other than numbers");
  EXPECT_SAYS(refused(folder, "a.csv", "1,,3\n1,2,3\n"), "an empty field");
  EXPECT_SAYS(refused(folder, "a.csv", "1,2,3\n1,2,\n"), "line 2: the line has an empty field");
  EXPECT_SAYS(refused(folder, "a.csv", "1,2,3,\n4,5,6,\n"), "an empty field");
  EXPECT_SAYS(refused(folder, "a.csv", ";1;2;3\n"), "an empty field");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3 4 5\n"), "only 3, 4, 6, 7 or 9");
  EXPECT_SAYS(refused(folder, "a.csv", "a,b,c\n1,2,3\n"), "names x, y and z");
  EXPECT_SAYS(refused(folder, "a.csv", "x,y,z,r,g,b\n1,2,3,256,0,0\n"), "between 0 and 255");
  EXPECT_SAYS(refused(folder, "a.csv", "x,y,z,radius\n1,2,3,0\n"), "the radius is 0");
  EXPECT_SAYS(refused(folder, "a.csv", "x,y,z,weight\n1,2,3,-1\n"), "the weight is -1");
  EXPECT_SAYS(refused(folder, "a.xyz", "1 2 3 nan 0 0\n"), "a normal holds nan");
  EXPECT_SAYS(refused(folder, "a.xyz", std::string("1 2 3\0", 6)), "binary data");
  EXPECT_SAYS(refused(folder, "a.obj", "v 1 2\n"), "coordinate");
  EXPECT_SAYS(refused(folder, "a.obj", "vn 1 2 3\n"), "holds no points");
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n";
  EXPECT_SAYS(refused(folder, "a.ply", head + "end_header\n1 2\n3 4\n"), "no element 'vertex'");
  const std::string whole = head + "property float z\nend_header\n1 2 3\n";
  EXPECT_SAYS(refused(folder, "a.ply", whole + "4.25 5\n"), "ends within");
  EXPECT_SAYS(refused(folder, "a.ply", whole + "4 5 nan\n"), "line 9");
  EXPECT_SAYS(refused(folder, "a.ply", whole + "4 5 6\n7\n"), "has data after");
  EXPECT_SAYS(refused(folder, "a.ply", whole + "4 5 6 7\n"), "more values on the line");
}

TEST(PointFiles, UnknownNamesAndMissingFilesAreRefused) {
  const TemporaryFolder folder;
  EXPECT_SAYS(refusal<UsageError>([&] { (void)readPoints(folder / "a.png"); }), "names no format");
  EXPECT_SAYS(refusal<levelset::IoError>([&] { (void)readPoints(folder / "a.xyz"); }),
              "there is no file");
  EXPECT_SAYS(refusal<InvalidInput>([&] { writePoints(folder / "a.ply", PointCloud()); }),
              "no points");
  PointCloud cloud = smallCloud(true);
  cloud.normals.pop_back();
  EXPECT_SAYS(refusal<InvalidInput>([&] { writePoints(folder / "a.ply", cloud); }),
              "2 normals for 3 points");
}

TEST(PointFiles, MemoryIsLimited) {
  const TemporaryFolder folder;
  PointCloud cloud;
  cloud.positions.assign(200000, V3d(1, 2, 3));
  for (const char* name : {"a.ply", "a.xyz", "a.obj", "a.pts"}) {
    writePoints(folder / name, cloud);
    (void)refusal<levelset::ResourceLimit>(
        [&] { (void)readPoints(folder / name, {.maxMemory = std::size_t{4} << 20}); });
    EXPECT_EQ(readPoints(folder / name, {.maxMemory = std::size_t{40} << 20}).size(), 200000u);
  }
}

TEST(PointFiles, MutatedFilesAreReadOrRefused) {
  const TemporaryFolder folder;
  const char* names[] = {"a.ply", "a.obj", "a.xyz", "a.csv", "a.pts", "a.csv.gz", "a.vdb"};
  std::mt19937 random(1);
  std::size_t readable = 0, refusals = 0;
  for (const char* name : names) {
    writePoints(folder / name, smallCloud(true));
    const std::string seed = support::readText(folder / name);
    for (int round = 0; round < 60; ++round) {
      writeText(folder / name, support::mutated(seed, random));
      (void)levelset::lacksFaces(folder / name);
      (void)levelset::holdsPointGrid(folder / name);
      try {
        const PointCloud cloud = readPoints(folder / name, {.maxMemory = std::size_t{64} << 20});
        EXPECT_FALSE(cloud.isEmpty());
        requirePoints(cloud);
        ++readable;
      } catch (const levelset::Error& error) {
        EXPECT_TRUE(error.exitCode() == levelset::ExitCode::Input ||
                    error.exitCode() == levelset::ExitCode::Resource)
            << error.what();
        ++refusals;
      }
    }
  }
  // Both outcomes occur often, so the mutations reach the readers and their checks.
  EXPECT_GT(readable, 60u);
  EXPECT_GT(refusals, 60u);
}

}  // namespace point_file_test
