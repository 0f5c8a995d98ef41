#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"
#include "tests/support/mesh_files.h"

namespace ply_test {

using levelset::CoordinatePrecision;
using levelset::InvalidInput;
using levelset::TriMesh;
using support::append;
using support::kAsciiPly;
using support::parse;
using support::refusal;
using support::refused;
using support::says;
using support::tetrahedron;

void appendAs(std::string& bytes, const std::string& type, double value, bool bigEndian) {
  if (type == "char") return append(bytes, static_cast<std::int8_t>(value), bigEndian);
  if (type == "uchar") return append(bytes, static_cast<std::uint8_t>(value), bigEndian);
  if (type == "short") return append(bytes, static_cast<std::int16_t>(value), bigEndian);
  if (type == "uint16") return append(bytes, static_cast<std::uint16_t>(value), bigEndian);
  if (type == "int") return append(bytes, static_cast<std::int32_t>(value), bigEndian);
  if (type == "uint32") return append(bytes, static_cast<std::uint32_t>(value), bigEndian);
  if (type == "float") return append(bytes, static_cast<float>(value), bigEndian);
  if (type == "float64") return append(bytes, value, bigEndian);
  ADD_FAILURE() << "unknown type " << type;
}

/// PLY of the tetrahedron with unknown properties, another element before the faces, and a fifth
/// face with an empty list of corners.
std::string strangePly(const std::string& count, const std::string& index, const std::string& real,
                       bool bigEndian) {
  std::string ply = fmt::format(
      "ply\r\nformat {} 1.0\r\ncomment made by hand\r\nelement vertex 4\r\nproperty uchar red\r\n"
      "property {} z\r\nproperty list uchar short tags\r\nproperty {} x\r\nproperty {} y\r\n"
      "element edge 2\r\nproperty list {} double weights\r\nelement face 5\r\nproperty uchar "
      "flags\r\n"
      "property list {} {} vertex_index\r\nproperty float quality\r\nend_header\r\n",
      bigEndian ? "binary_big_endian" : "binary_little_endian", real, real, real, count, count,
      index);
  const TriMesh mesh = tetrahedron();
  for (const Imath::V3d& p : mesh.positions) {
    ply += '\xFF';
    appendAs(ply, real, p.z, bigEndian);
    append(ply, std::uint8_t{2}, bigEndian);
    append(ply, std::int32_t{-1}, bigEndian);
    appendAs(ply, real, p.x, bigEndian);
    appendAs(ply, real, p.y, bigEndian);
  }
  for (const int weights : {1, 0}) {
    appendAs(ply, count, weights, bigEndian);
    ply.append(static_cast<std::size_t>(weights) * 8, 'w');
  }
  for (int i = 0; i < 5; ++i) {
    ply += 'f';
    appendAs(ply, count, i < 4 ? 3 : 0, bigEndian);
    if (i < 4)
      for (const std::uint32_t corner : mesh.triangles[static_cast<std::size_t>(i)])
        appendAs(ply, index, corner, bigEndian);
    append(ply, 0.5f, bigEndian);
  }
  return ply;
}

TEST(Ply, ReadsPlyListsOfAnyTypeInBothByteOrders) {
  const std::string types[] = {"char", "uchar",  "short", "uint16",
                               "int",  "uint32", "float", "float64"};
  for (const bool bigEndian : {false, true}) {
    for (const std::string& count : types) {
      for (const std::string& index : types) {
        const TriMesh mesh = parse("a.ply", strangePly(count, index, "float", bigEndian));
        ASSERT_EQ(mesh.positions, tetrahedron().positions) << count << " " << index << bigEndian;
        ASSERT_EQ(mesh.triangles, tetrahedron().triangles) << count << " " << index << bigEndian;
      }
    }
    EXPECT_EQ(parse("a.ply", strangePly("uchar", "int", "float", bigEndian)).precision,
              CoordinatePrecision::Float);
    EXPECT_EQ(parse("a.ply", strangePly("uchar", "int", "float64", bigEndian)).precision,
              CoordinatePrecision::Double);
  }
}

TEST(Ply, ReadsAsciiPly) {
  const TriMesh mesh = parse("a.ply", kAsciiPly);
  EXPECT_EQ(mesh.positions[2], Imath::V3d(1, 1, 0));
  EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(parse("a.ply", kAsciiPly.substr(0, kAsciiPly.size() - 1)).triangles, mesh.triangles);
}

TEST(Ply, RefusesDataBeyondTheHeader) {
  const std::string binary = strangePly("uchar", "int", "float", false);
  for (const std::string& ply : {kAsciiPly, binary}) {
    EXPECT_SAYS(refused("a.ply", ply + "junk"), "has data after the elements");
    EXPECT_NO_THROW((void)parse("a.ply", ply + " \t\r\n\n"));
  }
  std::string ply = binary;
  ply.replace(ply.find("face 5"), 6, "face 4");
  EXPECT_SAYS(refused("a.ply", ply), "has data after the elements");
  ply = kAsciiPly;
  ply.replace(ply.find("face 2"), 6, "face 1");
  EXPECT_SAYS(refused("a.ply", ply), "has data after the elements");
  // Elements that a mesh does not use are read to find the end.
  ply = kAsciiPly + "1 2\n3\n";
  ply.replace(ply.find("end_header"), 10, "element tag 2\nproperty list int int marks\nend_header");
  EXPECT_SAYS(refused("a.ply", ply), "the file ends within the elements 'tag'");
  EXPECT_EQ(parse("a.ply", ply + "5 6 7\n").triangles.size(), 2u);
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_SAYS(refused("a.off", off + "3 0 2 1\n"), "has data after the 3 vertices and 1 faces");
  EXPECT_NO_THROW((void)parse("a.off", off + "\n # the end\n\n"));
}

TEST(Ply, ReadsTextBehindAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(parse("a.ply", mark + kAsciiPly).triangles.size(), 2u);
  EXPECT_EQ(parse("a.ply", mark + strangePly("int", "int", "float", true)).triangles.size(), 4u);
  EXPECT_EQ(parse("a.obj", mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").triangles.size(), 1u);
  EXPECT_EQ(parse("a.off", mark + "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").triangles.size(),
            1u);
  EXPECT_EQ(
      parse("a.stl", mark + "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                            "vertex 0 1 0\nendloop\nendfacet\nendsolid x\n")
          .triangles.size(),
      1u);
  // No other encoding is read.
  EXPECT_SAYS(refused("a.ply", std::string("\xFF\xFEp\0l\0y\0\n\0", 10)),
              "does not begin with 'ply'");
  EXPECT_SAYS(refused("a.obj", std::string("\xFF\xFEv\0 \0", 6)), "binary data");
}

TEST(Ply, RefusesAnyTruncationOfPly) {
  const std::string whole = strangePly("uchar", "int", "float", false);
  for (std::size_t size = 1; size < whole.size() - 4; ++size)  // without the last quality
    ASSERT_FALSE(refused("a.ply", whole.substr(0, size)).empty()) << size;
  for (std::size_t size = 1; size + 2 < kAsciiPly.size(); ++size)
    ASSERT_FALSE(refused("a.ply", kAsciiPly.substr(0, size)).empty()) << size;
}

TEST(Ply, RefusesPlyWithExcessiveCounts) {
  for (const std::string count : {"5000000000", "18446744073709551615", "99"}) {
    std::string ply = kAsciiPly;
    ply.replace(ply.find("vertex 4"), 8, "vertex " + count);
    EXPECT_SAYS(refused("a.ply", ply), "promises " + count);
    ply = strangePly("uchar", "int", "float", false);
    ply.replace(ply.find("face 5"), 6, "face " + count);
    EXPECT_SAYS(refused("a.ply", ply), "promises " + count);
  }
  std::string ply = kAsciiPly;
  ply.replace(ply.find("vertex 4"), 8, "vertex -4");
  EXPECT_SAYS(refused("a.ply", ply), "not a number of elements");
}

TEST(Ply, RefusesBrokenPly) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string ply = kAsciiPly;
    ply.replace(ply.find(from), from.size(), to);
    return refused("a.ply", ply);
  };
  EXPECT_SAYS(with("3 0 2 3", "3 0 2 4"), "line 15: a face refers to vertex 4");
  EXPECT_SAYS(with("3 0 2 3", "3 0 -2 3"), "line 15: the index of a vertex is -2");
  EXPECT_SAYS(with("3 0 2 3", "3 0 2.5 3"), "the index of a vertex is 2.5");
  EXPECT_SAYS(with("3 0 2 3", "-3 0 2 3"), "the length of a list is -3");
  EXPECT_SAYS(with("3 0 2 3", "900000000 0 2 3"), "the file ends");
  EXPECT_SAYS(with("1 1 0", "1 nan 0"), "line 12: the coordinate nan is not a finite number");
  EXPECT_SAYS(with("1 1 0", "1 1e400 0"), "line 12: the coordinate inf");
  EXPECT_SAYS(with("1 1 0", "1 -1e39 0"), "beyond the range of float");
  EXPECT_SAYS(with("1 1 0", "1 1 0 7"), "line 12: there are more values");
  EXPECT_SAYS(with("1 1 0", "1 1,5 0"), "line 12: found '1,5' where a number is expected");
  EXPECT_SAYS(with("property float y", "property real y"), "the type 'real'");
  EXPECT_SAYS(with("property float y\n", ""), "no element 'vertex' with x, y and z");
  EXPECT_SAYS(with("vertex_indices", "something"), "no element 'face'");
  EXPECT_SAYS(with("property float y", "property float x"), "occurs twice");
  EXPECT_SAYS(with("ascii", "ebcdic"), "'ebcdic'");
  EXPECT_SAYS(with("end_header", "property x"), "needs a type and a name");
  EXPECT_SAYS(with("ply", "plx"), "does not begin with 'ply'");
  EXPECT_SAYS(with("element face 2", "element face 0"), "has data after the elements");
}

TEST(Ply, KeepsExtremeButFiniteCoordinates) {
  std::string ply = kAsciiPly;
  ply.replace(ply.find("1 1 0"), 5, "+1e30 1e-400 -1.4e-45");
  const TriMesh mesh = parse("a.ply", ply);
  EXPECT_EQ(mesh.positions[2], Imath::V3d(1e30f, 0, -0x1p-149));
}

}  // namespace ply_test
