// Mesh attributes and open meshes as bases, on the command line.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/command_line.h"

namespace open_mesh_command_test {

using Json = nlohmann::json;

class OpenMesh : public support::ShellTest {
 protected:
  void SetUp() override {
    ShellTest::SetUp();
    writeFile("hills.txt", "0 1 0 2\n1 3 1 0\n0 2 0 1\n");
    writeFile("sheet.obj",
              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 0 nan\n"
              "f 1/1/1 2/1/1 3/2/1 4/2/1\n");
  }
  Json info(const std::string& chain) {
    const auto outcome = levelsmith(chain + " ! info --json");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(OpenMesh, AttributesAreReportedAndOptional) {
  const auto refused = levelsmith("read sheet.obj ! info");
  EXPECT_EQ(refused.code, 3);
  EXPECT_NE(refused.err.find("line 8: a coordinate of a normal is nan"), std::string::npos)
      << refused.err;
  EXPECT_FALSE(info("read sheet.obj --bare").dump().find("attributes") != std::string::npos);
  const auto made = levelsmith(
      "heightmap --image hills.txt --size 4,4 --height 1 --voxel 0.5 --sheet ! write a.ply "
      "! write a.stl");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.err.find("texture coordinates were left out"), std::string::npos) << made.err;
  const auto file = levelsmith("info a.ply");
  EXPECT_NE(file.out.find("texture coordinates"), std::string::npos) << file.out;
  EXPECT_EQ(levelsmith("read a.ply --grid x ! info").code, 2);
  EXPECT_EQ(levelsmith("sphere --radius 1 --voxel 0.2 ! write s.vdb ! keep --largest 1").code, 0);
  EXPECT_EQ(levelsmith("read s.vdb --bare ! info").code, 2);
}

TEST_F(OpenMesh, SeamsAreClosedAndIgnoredPropertiesReported) {
  writeFile("roof.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\nvn 0 -1 0\nvn -1 0 0\nvn 1 1 1\n"
            "vn 9 9 9\nf 1//1 3//1 2//1\nf 1//2 2//2 4//2\nf 1//3 4//3 3//3\nf 2//4 3//4 4//4\n");
  const auto written = levelsmith("read roof.obj ! write roof.off ! write roof.ply");
  EXPECT_EQ(written.code, 0) << written.err;
  const std::string told = "1 of 5 normals, which no face refers to";
  const std::size_t at = written.err.find(told);
  ASSERT_NE(at, std::string::npos) << written.err;
  EXPECT_EQ(written.err.find(told, at + 1), std::string::npos) << written.err;  // once
  for (const char* file : {"roof.off", "roof.ply --bare"}) {
    const auto measured = levelsmith(std::string("read ") + file + " ! measure --json");
    ASSERT_EQ(measured.code, 0) << measured.err;
    const Json m = Json::parse(measured.out);
    EXPECT_EQ(m["vertices"], 4) << file;
    EXPECT_EQ(m["closed_manifold"], true) << file;
  }
}

TEST_F(OpenMesh, DefaultsOfBandAndPatchAreCompatible) {
  const std::string land =
      "heightmap --image hills.txt --size 20,20 --height 4 --voxel 1 --sheet ! surface-band ";
  EXPECT_EQ(levelsmith(land + "--voxel 1 ! patch --at 0,0,0 --size 6,6 --height 5 ! info").code, 0);
  const auto narrow = levelsmith("--dry-run " + land + "--voxel 1 --half-width 3 ! info");
  EXPECT_EQ(narrow.code, 2);
  EXPECT_NE(narrow.err.find("give at least 4"), std::string::npos) << narrow.err;
}

TEST_F(OpenMesh, TreesStandOnTerrain) {
  // The example of docs/texture-mapping.md with fewer trees.
  const auto outcome = levelsmith(
      "heightmap --image hills.txt --size 40,40 --height 8 --base 0 --voxel 0.5 --sheet --as "
      "ground "
      "! surface-band @ground --voxel 0.5 --as land ! scatter @land --count 8 --size 2,2 "
      "--particles "
      "spline --height 6 --levels 3 --as places ! capsule --from 0,0,0 --to 0,0,4 --radius 0.6 "
      "--voxel 0.3 ! mesh --as tree ! texture @land @tree @places --map mesh ! write trees.ply "
      "! measure --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json m = Json::parse(outcome.out);
  EXPECT_EQ(m["components"], 8);
  EXPECT_EQ(m["closed_manifold"], true);
  // A foot may be a voxel beyond the border, and a tree leans by at most its height.
  for (const int axis : {0, 1}) {
    EXPECT_GT(m["bounds"]["min"][axis], -20 - 0.5 - 6);
    EXPECT_LT(m["bounds"]["max"][axis], 20 + 0.5 + 6);
  }
}

TEST_F(OpenMesh, SurfaceBandsAreNoSolids) {
  const std::string land =
      "heightmap --image hills.txt --size 20,20 --height 4 --voxel 1 --sheet ! surface-band "
      "--voxel 1 --as land ! ";
  const auto offset = levelsmith(land + "offset 1 ! write a.vdb");
  EXPECT_EQ(offset.code, 2);
  EXPECT_NE(offset.err.find("operand 1 is a surface band"), std::string::npos) << offset.err;
  EXPECT_NE(offset.err.find("no inside"), std::string::npos);
  EXPECT_EQ(levelsmith(land + "write a.vdb").code, 2);
  EXPECT_EQ(levelsmith(land + "measure").code, 2);
  const std::string onto =
      "patch @land --at 0,0,0 --size 6,6 --height 3 --particles spline --as p ! sphere --radius 1 "
      "--voxel 0.2 --as ball ! texture @land @ball @p";
  const auto joined = levelsmith(land + onto + " ! measure");
  EXPECT_EQ(joined.code, 2);
  EXPECT_NE(joined.err.find("no inside to join"), std::string::npos) << joined.err;
  EXPECT_EQ(levelsmith(land + onto + " --alone ! check").code, 0);
  const auto over =
      levelsmith(land + "patch @land --at 8,0,0 --size 12,6 --height 3 --particles spline ! info");
  EXPECT_EQ(over.code, 3);
  EXPECT_NE(over.err.find("breaks off"), std::string::npos) << over.err;
  const auto narrow = levelsmith(land + "patch @land --at 0,0,0 --size 6,6 --height 12 ! info");
  EXPECT_EQ(narrow.code, 3);
  EXPECT_NE(narrow.err.find("--half-width 18"), std::string::npos) << narrow.err;
  EXPECT_EQ(levelsmith("heightmap --image hills.txt --size 4,4 --height 1 --voxel 0.5 --sheet "
                       "--half-width 4 ! info")
                .code,
            2);
}

}  // namespace open_mesh_command_test
