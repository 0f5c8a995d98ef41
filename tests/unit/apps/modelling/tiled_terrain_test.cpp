#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace tiled_terrain_test {

using Json = nlohmann::json;

/// A ground of 41x25 samples, whole numbers with a hole. Positions are 10 times the samples.
std::string groundText() {
  std::string text =
      "ncols 41\nnrows 25\nxllcenter 0\nyllcenter 0\ncellsize 10\nNODATA_value -9999\n";
  for (int row = 0; row < 25; ++row)
    for (int column = 0; column < 41; ++column)
      text += row == 3 && column == 4 ? "-9999 "
                                      : std::to_string((column * row) % 17 + 3 * column) + " ";
  return text;
}

class TiledTerrain : public support::ActionTest {
 protected:
  void SetUp() override {
    ActionTest::SetUp();
    writeFile("ground.asc", groundText());
    writeFile("ground.prj", "PROJCS[\"UTM 32\"]");
  }
};

TEST_F(TiledTerrain, WriteAndReadKeepTheTerrain) {
  const Json info = json("read ground.asc ! write a.lst ! info --json");
  const Json again = json("read a.lst ! info --json");
  EXPECT_EQ(again["hash"], info["hash"]);
  EXPECT_EQ(again["coordinate_system"], "UTM 32");
  EXPECT_EQ(again["missing"], 1);
  EXPECT_EQ(json("read a.lst ! measure --above 3 --json"),
            json("read ground.asc ! measure --above 3 --json"));
}

TEST_F(TiledTerrain, MeshOfAPictureReadsOnlyItsPatches) {
  // The file and the terrain in memory have patches of the same size, so they have the same mesh.
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst --cells 32").code, 0);
  const std::string camera = " --from 200,-90,160 --to 200,120,20 --pixel-error 3";
  ASSERT_EQ(levelsmith("tiled-terrain-mesh a.lst" + camera + " ! write tiled.ply").code, 0);
  ASSERT_EQ(levelsmith("read ground.asc ! terrain-mesh" + camera + " ! write whole.ply").code, 0);
  EXPECT_EQ(support::readText(folder_ / "tiled.ply"), support::readText(folder_ / "whole.ply"));
  // A complete mesh without a camera of its own, and plans.
  EXPECT_GT(json("tiled-terrain-mesh a.lst ! info --json")["triangles"], 100);
  EXPECT_EQ(levelsmith("--dry-run tiled-terrain-mesh a.lst ! info").code, 0);
  EXPECT_EQ(levelsmith("--explain tiled-terrain-mesh a.lst ! info").code, 0);
  expectRefusal("tiled-terrain-mesh ground.asc", 2, "ends in .lst");
  expectRefusal("tiled-terrain-mesh none.lst", 6, "none.lst");
  expectRefusal("tiled-terrain-mesh a.lst --from 4,-9,9 --to 4,-20,9", 3, "shows no ground");
  expectRefusal("tiled-terrain-mesh a.lst --to 1,2,3", 2, "--from");
  writeFile("bad.lst", "no tiles");
  expectRefusal("tiled-terrain-mesh bad.lst", 3, "bad.lst");
}

TEST_F(TiledTerrain, ReadTakesAPartAndALevel) {
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst --cells 4").code, 0);
  EXPECT_EQ(json("read a.lst --box '100,50,0 305,120,1' ! info --json")["hash"],
            json("read ground.asc ! terrain --crop '100,50,0 305,120,1' ! info --json")["hash"]);
  const Json coarse = json("read a.lst --level 2 ! info --json");
  EXPECT_EQ(coarse["columns"], 11);
  EXPECT_EQ(coarse["rows"], 7);
  EXPECT_EQ(coarse["spacing"], (Json{40.0, 40.0}));
  expectRefusal("read a.lst --level 9", 2, "has no level 9; give 0 to 4");
  expectRefusal("read a.lst --box '900,0,0 901,1,1'", 3, "has no sample");
  expectRefusal("read ground.asc --level 1", 2, "--level is for tiled terrains");
  expectRefusal("read ground.asc ! write b.asc --tolerance 1", 2, "--tolerance is for tiled");
  expectRefusal("read ground.asc ! write b.lst --cells 5", 2, "power of two");
  expectRefusal("read ground.asc ! write b.lst --tolerance 0", 2, "--tolerance");
  expectRefusal("read - --format lst <a.lst", 2, "give a file, not -");
}

/// A dry run plans a part without its heights.
TEST_F(TiledTerrain, PlansFromTheIndex) {
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst").code, 0);
  const support::Outcome plan =
      levelsmith("--dry-run read a.lst --box '100,50,0 305,120,1' ! terrain --scale 2");
  EXPECT_EQ(plan.code, 0) << plan.err;
}

TEST_F(TiledTerrain, InfoReadsTheIndexOnly) {
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst --cells 4 --tolerance 0.5").code, 0);
  const Json info = json("info a.lst --json");
  EXPECT_EQ(info["columns"], 41);
  EXPECT_EQ(info["cells"], 4);
  EXPECT_EQ(info["tolerance"], 0.5);
  EXPECT_EQ(info["bytes"], std::filesystem::file_size(folder_ / "a.lst"));
  EXPECT_EQ(info["levels"].size(), 5u);
  EXPECT_EQ(info["levels"][0]["patches"], (Json{10, 6}));
  EXPECT_EQ(info["levels"][0]["known"], 60);
  EXPECT_EQ(info["levels"][0]["error"], 0.5);
  EXPECT_TRUE(info["levels"][4]["error"].is_null());  // covers a missing sample
  // Heights are not decoded: damage in them is found by read alone.
  std::string bytes = support::readText(folder_ / "a.lst");
  bytes[160] = static_cast<char>(bytes[160] ^ 0x20);
  writeFile("b.lst", bytes);
  EXPECT_EQ(json("info b.lst --json")["hash"], info["hash"]);
  expectRefusal("read b.lst", 3, "of level 0 is damaged, as its checksum differs");
  writeFile("cut.lst", bytes.substr(0, 1000));
  expectRefusal("info cut.lst", 3, "has 1000 bytes of");
}

TEST_F(TiledTerrain, TileTerrainConvertsByRows) {
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst").code, 0);
  ASSERT_EQ(levelsmith("tile-terrain ground.asc b.lst").code, 0);
  EXPECT_EQ(json("read b.lst ! info --json")["hash"], json("read a.lst ! info --json")["hash"]);
  ASSERT_EQ(levelsmith("tile-terrain - --format asc c.lst <ground.asc").code, 0);
  EXPECT_EQ(json("read c.lst ! info --json")["missing"], 1);
  ASSERT_EQ(levelsmith("tile-terrain ground.asc d.lst --tolerance 2 --cells 8").code, 0);
  EXPECT_EQ(json("info d.lst --json")["tolerance"], 2);
  EXPECT_EQ(json("info d.lst --json")["cells"], 8);
  writeFile("a.raw", std::string("\1\2\3\4\5\6", 6));
  ASSERT_EQ(levelsmith("tile-terrain a.raw r.lst --size 3,2,1 --type u8 --no-data 5 --flip "
                       "--spacing 2,3,1 --origin 5,6,0")
                .code,
            0);
  ASSERT_EQ(levelsmith("read r.lst ! write r.asc").code, 0);
  EXPECT_NE(support::readText(folder_ / "r.asc").find("\n1 2 3\n4 -9999 6\n"), std::string::npos);
  EXPECT_EQ(json("info r.lst --json")["spacing"], (Json{2.0, 3.0}));
}

TEST_F(TiledTerrain, TileTerrainRefusesOtherFiles) {
  writeFile("a.raw", "123456");
  expectRefusal("tile-terrain ground.asc b.asc", 2, "ends in .lst");
  expectRefusal("tile-terrain ground.ply b.lst", 2, "no format that is read by rows");
  expectRefusal("tile-terrain ground.tif b.lst", 2, "no format that is read by rows");
  expectRefusal("tile-terrain a.raw b.lst", 2, "give --size and --type");
  expectRefusal("tile-terrain a.raw b.lst --size 3,1,2 --type u8", 2, "has 2 layers");
  expectRefusal("tile-terrain a.raw b.lst --size 3,3,1 --type u8", 3, "9 follow from its size");
  expectRefusal("tile-terrain a.raw b.lst --size 3,2,1 --type f16", 2, "'f16' is not one of u8");
  expectRefusal("tile-terrain ground.asc b.lst --flip", 2, "--flip describes a .raw file");
  expectRefusal("tile-terrain none.asc b.lst", 6, "none.asc");
  // A place that no reader accepts is refused before an old file is replaced.
  ASSERT_EQ(levelsmith("tile-terrain ground.asc old.lst").code, 0);
  const std::string old = support::readText(folder_ / "old.lst");
  writeFile(
      "far.asc", "ncols 100\nnrows 2\nxllcorner 1e308\nyllcorner 0\ncellsize 1e307\n" + [] {
        std::string heights;
        for (int n = 0; n < 200; ++n) heights += "0 ";
        return heights;
      }());
  expectRefusal("tile-terrain far.asc old.lst", 3, "not finite");
  EXPECT_EQ(support::readText(folder_ / "old.lst"), old);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b.lst"));
}

class SlowTiledTerrain : public TiledTerrain {};

/// A terrain that is larger than the memory limit is converted, and read in parts.
TEST_F(SlowTiledTerrain, WorksBeyondTheMemoryLimit) {
  constexpr int kSide = 8193;
  std::ofstream raw(folder_ / "large.raw", std::ios::binary);
  std::string line(2 * kSide, '\0');
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      line[static_cast<std::size_t>(2 * column)] = static_cast<char>((column + row) / 64);
      line[static_cast<std::size_t>(2 * column + 1)] = 0;
    }
    raw << line;
  }
  raw.close();
  const std::string limit = "--max-memory 150MB ";
  expectRefusal(limit + "read large.raw --size 8193,8193,1 --type i16 ! terrain", 4, "memory");
  ASSERT_EQ(levelsmith(limit + "tile-terrain large.raw a.lst --size 8193,8193,1 --type i16").code,
            0);
  expectRefusal(limit + "read a.lst", 4, "give --box, or a coarser --level");
  const Json part = json(limit + "read a.lst --box '6000,6000,0 6100,6050,1' ! info --json");
  EXPECT_EQ(part["columns"], 101);
  EXPECT_EQ(part["range"], (Json{187.0, 189.0}));
  EXPECT_EQ(json(limit + "read a.lst --level 3 ! info --json")["columns"], 1025);
}

TEST_F(TiledTerrain, CachesByTheContentOfTheFile) {
  const std::string chain = "--cache c read a.lst ! terrain --scale 2 ! measure --json";
  ASSERT_EQ(levelsmith("read ground.asc ! write a.lst").code, 0);
  const Json first = json(chain);
  EXPECT_EQ(json(chain), first);
  ASSERT_EQ(levelsmith("read ground.asc ! terrain --scale 3 ! write a.lst").code, 0);
  EXPECT_NE(json(chain)["highest"], first["highest"]);
}

}  // namespace tiled_terrain_test
