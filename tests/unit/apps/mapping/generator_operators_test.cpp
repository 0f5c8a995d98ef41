// Texture generators on the command line, and files for height maps.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace generators_command_test {

using Json = nlohmann::json;

class Generators : public support::ShellTest {
 protected:
  /// Writes a file from bytes in hexadecimal digits.
  void writeHex(const std::string& name, const std::string& digits) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
      bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
    writeFile(name, bytes);
  }
  /// Volume of a plate of 4 × 2 with a base of 1 and a picture of height up to 2.
  double volume(const std::string& options) {
    const auto outcome =
        levelsmith("heightmap --size 4,2 --height 2 --base 1 --interpolation " +
                   std::string("linear --voxel 0.05 ") + options + " ! measure --json");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false).value("volume", 0.0);
  }
};

// Largest volume that the grid removes at edges.
constexpr double kEdges = 0.06;

TEST_F(Generators, ReadGreyPicturesOfAllDepths) {
  // 0, 51, 102 of 255 from left to right.
  writeHex(
      "8.png",
      "89504e470d0a1a0a0000000d4948445200000003000000020800000000b81f39c60000000e4944415478da63"
      "60304e630062000404013381e2ce4a0000000049454e44ae426082");
  EXPECT_NEAR(volume("--image 8.png"), 8 * (1 + 2 * 0.2), kEdges);
  EXPECT_NEAR(volume("--image 8.png --invert"), 8 * (1 + 2 * 0.8), kEdges);
  // 25828 of 65535 everywhere. The high byte alone would be 100 of 255, slightly less.
  writeHex(
      "16.png",
      "89504e470d0a1a0a0000000d4948445200000002000000021000000000074d8ebb000000104944415478da63"
      "487992f2840144000018aa05210d4d6ba10000000049454e44ae426082");
  EXPECT_NEAR(volume("--image 16.png"), 8 * (1 + 2 * 25828.0 / 65535), kEdges);
  // One bit: black, white.
  writeHex(
      "1.png",
      "89504e470d0a1a0a0000000d49484452000000020000000201000000005acd30890000000c4944415478da63"
      "70607000000104008156f0d1030000000049454e44ae426082");
  EXPECT_NEAR(volume("--image 1.png"), 8 * (1 + 2 * 0.5), kEdges);
}

TEST_F(Generators, TakeTransparentPixelsAsTheGround) {
  // White and opaque on the left, white and transparent on the right.
  writeHex(
      "a.png",
      "89504e470d0a1a0a0000000d4948445200000002000000020804000000d8bfc5af000000104944415478da63"
      "f8ffff3f030388000020e905fb594c70ae0000000049454e44ae426082");
  EXPECT_NEAR(volume("--image a.png"), 8 * (1 + 2 * 0.5), kEdges);
  EXPECT_NEAR(volume("--image a.png --invert"), 8, kEdges);
}

TEST_F(Generators, ReadLinesOfNumbers) {
  writeFile("n.txt", "-1, 0,+1\r\n-1;0 1e0\n\n");
  EXPECT_NEAR(volume("--image n.txt"), 8 * (1 + 2 * 0.5), kEdges);
  writeFile("flat.txt", "3 3\n3 3\n");
  EXPECT_NEAR(volume("--image flat.txt"), 8, kEdges);
}

TEST_F(Generators, RefuseInvalidHeightFiles) {
  const std::string heightmap = "heightmap --size 4,2 --height 2 --voxel 0.1 --image ";
  writeHex(
      "c.png",
      "89504e470d0a1a0a0000000d4948445200000002000000020802000000fdd49a73000000114944415478da63"
      "606462666165638050000111002b0512c78f0000000049454e44ae426082");
  EXPECT_REFUSED(levelsmith(heightmap + "c.png"), 3, "is a colour picture");
  writeHex("short.png", "89504e470d0a1a0a0000000d4948445200000003000000020800000000b81f39c6");
  EXPECT_REFUSED(levelsmith(heightmap + "short.png"), 3, "not a complete PNG");
  EXPECT_REFUSED(levelsmith(heightmap + "none.png"), 6, "No such file");
  EXPECT_REFUSED(levelsmith(heightmap + "."), 6, "is a folder");
  for (const auto& [text, part] :
       {std::pair<const char*, const char*>{"1 2\n3\n", "line 2: the line has 1 numbers"},
        {"1 2\n3 nan\n", "line 2: 'nan' is not a finite number"},
        {"1 2\n3 x\n", "'x' is not a finite number"},
        {"1 2 3\n", "3 columns and 1 rows"},
        {"\n", "is empty"}}) {
    writeFile("bad.txt", text);
    EXPECT_REFUSED(levelsmith(heightmap + "bad.txt"), 3, part);
  }
}

TEST_F(Generators, AreRefusedByADryRunLikeByARun) {
  for (const char* run : {"", "--dry-run "}) {
    const std::string start = run;
    EXPECT_REFUSED(levelsmith(start + "knurl --pitch 0.15 --columns 20 --voxel 0.1"), 3,
                   "under two voxels");
    EXPECT_REFUSED(
        levelsmith(start + "ring --radius 1 --tube 0.3 --columns 2 --rows 2 --voxel 0.05"), 2,
        "the clearance between wires is");
    EXPECT_REFUSED(levelsmith(start + "gyroid --cell 1 --thickness 0.3 --voxel 0.02"), 2, "close");
    EXPECT_REFUSED(levelsmith(start + "scales --length 2 --step 3 --voxel 0.05"), 2, "overlap");
    EXPECT_REFUSED(levelsmith(start + "hexagons --size 1 --rounding 1 --voxel 0.05"), 2,
                   "rounding");
  }
}

TEST_F(Generators, ReportTheirPeriod) {
  const auto outcome = levelsmith(
      "knurl --pattern straight --pitch 1 --base 0.5 --columns 2 --rows 3 --overlap 4vx --voxel "
      "0.1 "
      "! measure --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("--texture-box \"-1,-1.5,-0.5 1,1.5,0.5\""), std::string::npos)
      << outcome.err;
  EXPECT_NEAR(Json::parse(outcome.out)["bounds"]["max"][0], 1.4, support::doubleRounding(1.5));
}

}  // namespace generators_command_test
