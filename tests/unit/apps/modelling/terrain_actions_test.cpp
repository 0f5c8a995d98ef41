#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/action_test.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace terrain_actions_test {

using Json = nlohmann::json;

/// A plane of slope 1/2 along x, over 8 × 4.
constexpr const char* kPlane =
    "ncols 5\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 2\nNODATA_value -9999\n"
    "0 1 2 3 4\n0 1 2 3 4\n0 1 2 3 4\n";
/// The same with a hole.
constexpr const char* kHole =
    "ncols 5\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 2\nNODATA_value -9999\n"
    "0 1 2 3 4\n0 1 -9999 3 4\n0 1 2 3 4\n";

class TerrainActions : public support::ActionTest {
 protected:
  void SetUp() override {
    ActionTest::SetUp();
    writeFile("plane.asc", kPlane);
    writeFile("hole.asc", kHole);
  }
};

TEST_F(TerrainActions, ReadDescribesATerrain) {
  writeFile("hole.prj", "PROJCS[\"UTM 32\"]");
  for (const char* chain : {"read hole.asc ! info --json", "info hole.asc --json"}) {
    const Json info = json(chain);
    EXPECT_EQ(info["columns"], 5);
    EXPECT_EQ(info["rows"], 3);
    EXPECT_EQ(info["origin"], (Json{0.0, 0.0}));
    EXPECT_EQ(info["spacing"], (Json{2.0, 2.0}));
    EXPECT_EQ(info["range"], (Json{0.0, 4.0}));
    EXPECT_EQ(info["missing"], 1);
    EXPECT_EQ(info["coordinate_system"], "UTM 32");
    EXPECT_EQ(info["geographic"], false);
  }
  EXPECT_EQ(json("read hole.asc ! info --json")["kind"], "terrain");
  EXPECT_EQ(json("read - --format asc <plane.asc ! info --json")["missing"], 0);
}

TEST_F(TerrainActions, TerrainMeshHasTheTrianglesOfAPicture) {
  // A plane needs one patch, whose triangles are those of the samples.
  const Json all = json("read plane.asc ! terrain-mesh --from 4,-9,9 ! info --json");
  EXPECT_EQ(all["kind"], "mesh");
  EXPECT_EQ(all["triangles"], 16);
  // Triangles with a missing corner are left out.
  EXPECT_EQ(json("read hole.asc ! terrain-mesh --from 4,-9,9 ! info --json")["triangles"], 10);
  expectRefusal("read plane.asc ! terrain-mesh --from 4,-9,9 --to 4,-20,9", 3, "shows no ground");
  expectRefusal("read plane.asc ! terrain-mesh --pixel-error 0", 2, "--pixel-error");
  expectRefusal("read plane.asc ! terrain-mesh --to 1,2,3", 2, "--from");
}

TEST_F(TerrainActions, TerrainPlacesAndFills) {
  const Json info =
      json("read hole.asc ! terrain --spacing 4,3 --origin 10,-20 --scale 2 --fill ! info --json");
  EXPECT_EQ(info["origin"], (Json{10.0, -20.0}));
  EXPECT_EQ(info["spacing"], (Json{4.0, 3.0}));
  EXPECT_EQ(info["range"], (Json{0.0, 8.0}));
  EXPECT_EQ(info["missing"], 0);
  const Json part = json("read plane.asc ! terrain --crop '3,-1,0 8,3,1' ! info --json");
  EXPECT_EQ(part["columns"], 3);
  EXPECT_EQ(part["rows"], 2);
  EXPECT_EQ(part["origin"], (Json{4.0, 0.0}));
  EXPECT_EQ(json("read plane.asc ! terrain --no-data 3 ! info --json")["missing"], 3);
  expectRefusal("read plane.asc ! terrain --metric", 3, "not degrees");
  expectRefusal("read plane.asc ! terrain --scale 0", 2, "factor other than 0");
  expectRefusal("read plane.asc ! terrain --spacing 1,1 --metric", 2, "leave one out");
  expectRefusal("read plane.asc ! terrain --spacing 1", 2, "--spacing");
  expectRefusal("read plane.asc ! terrain --spacing 1,0", 2, "--spacing");
  expectRefusal("read plane.asc ! terrain --crop '90,0,0 91,1,1'", 3, "has no sample");
  expectRefusal("read hole.asc ! terrain --crop '4,2,0 4.5,2.5,1' --fill", 3, "no sample has data");
}

TEST_F(TerrainActions, TerrainTakesARawVolume) {
  std::ofstream(folder_ / "a.raw", std::ios::binary).write("\1\2\3\4\5\6", 6);
  const std::string read = "read a.raw --size 3,2,1 --type u8 --spacing 2,4,1 ! terrain";
  EXPECT_EQ(json(read + " ! info --json")["spacing"], (Json{2.0, 4.0}));
  EXPECT_EQ(levelsmith(read + " ! write up.asc ").code, 0);
  EXPECT_NE(support::readText(folder_ / "up.asc").find("\n4 5 6\n1 2 3\n"), std::string::npos);
  EXPECT_EQ(levelsmith(read + " --flip ! write down.asc").code, 0);
  EXPECT_NE(support::readText(folder_ / "down.asc").find("\n1 2 3\n4 5 6\n"), std::string::npos);
  expectRefusal("read a.raw --size 3,1,2 --type u8 ! terrain", 3, "has 2 layers");
}

/// Bytes in hexadecimal digits.
std::string bytesOf(const std::string& digits) {
  std::string bytes;
  for (std::size_t n = 0; n < digits.size(); n += 2)
    bytes += static_cast<char>(std::stoi(digits.substr(n, 2), nullptr, 16));
  return bytes;
}

// PNGs of 16 bits. Above: black and white, below: 1/5 and 2/5.
constexpr const char* kGrey =
    "89504e470d0a1a0a0000000d4948445200000002000000021000000000074d8ebb0000001249444154789c63606"
    "0f8ff9fc1d8382d0d000f9403316da0037c0000000049454e44ae426082";
// Black, and a pixel that is transparent; the same with one that is partly transparent.
constexpr const char* kTransparent =
    "89504e470d0a1a0a0000000d49484452000000020000000110040000000ebb6b420000000f49444154789c63606"
    "0f80f040c0c0011f703fdabb502040000000049454e44ae426082";
constexpr const char* kPartly =
    "89504e470d0a1a0a0000000d49484452000000020000000110040000000ebb6b420000000f49444154789c63606"
    "0f80f040cc900125a0460e87a95e00000000049454e44ae426082";

TEST_F(TerrainActions, ReadTakesAGreyPicture) {
  writeFile("grey.png", bytesOf(kGrey));
  ASSERT_EQ(levelsmith("read grey.png ! terrain --spacing 30,30 --scale 100 ! write a.asc").code,
            0);
  const std::string grid = support::readText(folder_ / "a.asc");
  EXPECT_NE(grid.find("cellsize 30"), std::string::npos);
  EXPECT_NE(grid.find("\n0 100\n20 40\n"), std::string::npos) << grid;
  writeFile("some.png", bytesOf(kTransparent));
  EXPECT_EQ(json("read some.png ! info --json")["missing"], 1);
  writeFile("some.png", bytesOf(kPartly));
  expectRefusal("read some.png", 3, "column 2 and row 1 is partly transparent");
  writeFile("cut.png", bytesOf(kGrey).substr(0, 50));
  expectRefusal("read cut.png", 3, "cut.png");
  ASSERT_EQ(levelsmith("read plane.asc ! hillshade shade.png").code, 0);
  EXPECT_EQ(json("read shade.png ! info --json")["missing"], 12);  // the border has no slope
  ASSERT_EQ(levelsmith("read plane.asc ! render colour.png --size 8x8 --up 0,0,1").code, 0);
  expectRefusal("read colour.png", 3, "convert it to grey");
  expectRefusal("read - --format png <grey.png", 2, "give a file, not -");
}

TEST_F(TerrainActions, MeasureHasExactAreasAndVolumes) {
  const Json m = json("read plane.asc ! measure --above 1 --json");
  EXPECT_NEAR(m["area"], 32 * std::sqrt(1.25), support::doubleRounding(64));
  EXPECT_EQ(m["projected_area"], 32);
  EXPECT_EQ(m["volume_above"], 36);  // 6 × 3 / 2 × 4
  EXPECT_EQ(m["volume_below"], 4);
  EXPECT_EQ(m["mean_height"], 2);
  EXPECT_NEAR(m["mean_slope"], std::atan(0.5) * 180 / M_PI, 1e-5);
  EXPECT_EQ(m["triangles"], 16);
  EXPECT_EQ(json("read hole.asc ! measure --json")["triangles"], 10);
  const support::Outcome text = levelsmith("read plane.asc ! measure");
  EXPECT_NE(text.out.find("projected_area"), std::string::npos);
  expectRefusal("sphere --radius 1 --voxel 0.2 ! measure --above 1", 2, "--above is for terrains");
  expectRefusal("read plane.asc ! measure --sharp", 2, "--sharp is for level sets");
  writeFile("plane.prj", "GEOGCS[\"WGS 84\"]");
  expectRefusal("read plane.asc ! measure", 3, "terrain --metric");
  EXPECT_GT(json("read plane.asc ! terrain --metric ! measure --json")["area"], 1e11);
}

TEST_F(TerrainActions, SlopeMakesATerrain) {
  ASSERT_EQ(levelsmith("read plane.asc ! slope --edges ! write slope.asc").code, 0);
  const Json slope = json("info slope.asc --json");
  EXPECT_NEAR(slope["range"][0], std::atan(0.5) * 180 / M_PI, 1e-5);
  EXPECT_EQ(slope["missing"], 0);
  EXPECT_EQ(json("read plane.asc ! slope ! info --json")["missing"], 12);
  EXPECT_EQ(json("read plane.asc ! slope --aspect --edges ! info --json")["range"],
            (Json{270.0, 270.0}));
}

TEST_F(TerrainActions, HillshadeWritesAPicture) {
  ASSERT_EQ(levelsmith("read plane.asc ! hillshade a.png --edges ! hillshade b.png --edges "
                       "--azimuth 90")
                .code,
            0);
  EXPECT_NE(support::readText(folder_ / "a.png"), support::readText(folder_ / "b.png"));
  expectRefusal("read plane.asc ! hillshade a.jpg", 2, "ends in .png");
  expectRefusal("read plane.asc ! hillshade a.png --altitude 91", 2, "give 0 to 90");
  expectRefusal("read plane.asc ! hillshade a.png --exaggeration 0", 2, "--exaggeration");
}

TEST_F(TerrainActions, ContoursWriteLines) {
  const Json lines = json("read plane.asc ! contours - --format geojson --interval 1 --base 0.5");
  EXPECT_EQ(lines["type"], "FeatureCollection");
  ASSERT_EQ(lines["features"].size(), 4u);
  const Json& first = lines["features"][0];
  EXPECT_EQ(first["properties"]["height"], 0.5);
  EXPECT_EQ(first["geometry"]["coordinates"],
            (Json{{1.0, 4.0, 0.5}, {1.0, 2.0, 0.5}, {1.0, 0.0, 0.5}}));
  ASSERT_EQ(
      levelsmith("read plane.asc ! contours a.svg --interval 1 ! contours b.SVG --interval 1").code,
      0);
  const std::string svg = support::readText(folder_ / "a.svg");
  EXPECT_NE(svg.find("viewBox=\"0 0 1000.00 500.00\""), std::string::npos);
  EXPECT_EQ(support::readText(folder_ / "b.SVG"), svg);
  EXPECT_NE(svg.find("M250.00 0.00L250.00 250.00L250.00 500.00"), std::string::npos);
  expectRefusal("read plane.asc ! contours a.txt --interval 1", 2, "use geojson or svg");
  expectRefusal("read plane.asc ! contours a.svg", 2, "--interval");
  expectRefusal("read plane.asc ! contours a.svg --interval 1e-9", 2, "larger interval");
  const support::Outcome none = levelsmith("read plane.asc ! contours c.svg --interval 100");
  EXPECT_EQ(none.code, 0);
  EXPECT_NE(none.err.find("no line crosses the terrain"), std::string::npos);
}

TEST_F(TerrainActions, SolidifyMakesASolid) {
  const Json m = json("read plane.asc ! solidify --base -1 --voxel 0.1 ! measure --json");
  // A level set rounds each edge by about half a voxel².
  EXPECT_NEAR(m["volume"], 32 * 3, support::measured(0.278));
  EXPECT_EQ(m["components"], 1);
  EXPECT_EQ(levelsmith("read plane.asc ! solidify --base -1 --voxel 0.25 ! check").code, 0);
  const Json bounds = json("read plane.asc ! solidify --resolution 40 ! info --json")["bounds"];
  EXPECT_NEAR(bounds["min"][2], -0.4, 1e-3);  // a twentieth of the longer side
  // The volume of a hole with walls: six of 16 triangles are missing.
  const Json holed =
      json("read hole.asc ! solidify --base -1 --voxel 0.1 --allow-missing ! measure --json");
  EXPECT_NEAR(holed["volume"], 20 * 3, support::measured(0.395));
  expectRefusal("read hole.asc ! solidify --voxel 0.1", 3, "1 of 15 samples have no data");
  expectRefusal("read plane.asc ! solidify --base 0 --voxel 0.1", 3, "give a lower base");
  expectRefusal("read plane.asc ! solidify --base -1", 2, "--voxel");
  ASSERT_EQ(levelsmith("--report r.json read plane.asc ! solidify --base -1 --voxel 0.2").code, 0);
  const Json report = Json::parse(support::readText(folder_ / "r.json"));
  EXPECT_EQ(report["steps"][1]["certificate"]["closed"], true);
}

TEST_F(TerrainActions, SolidifyLowersTheEdges) {
  const auto volume = [&](const std::string& options) {
    return json("read plane.asc ! solidify --base -1 --voxel 0.1 " + options +
                " ! measure --json")["volume"]
        .get<double>();
  };
  // A prism below a triangle has the mean height of its corners. The three inner samples have 18 of
  // the 48 corners, and the border has 30.
  EXPECT_NEAR(volume("") - volume("--lower-edges 0.4"), 0.4 * 32 * 30 / 48, 0.1);
  EXPECT_NEAR(volume("--lower-edges 4vx"), volume("--lower-edges 0.4"), 1e-9);
  expectRefusal("read plane.asc ! solidify --base -1 --voxel 0.1 --lower-edges=-1", 2,
                "lower-edges");
  expectRefusal("read plane.asc ! solidify --base -1 --voxel 0.1 --lower-edges 2", 3, "base");
}

TEST_F(TerrainActions, SurfaceBandTakesABox) {
  const std::string band = "read plane.asc ! surface-band --voxel 0.1 --half-width 5";
  const Json whole = json(band + " ! info --json"),
             part = json(band + " --box '1,1,0 3,3,4' ! info --json");
  EXPECT_EQ(whole["kind"], "surface band");
  EXPECT_EQ(part["kind"], "surface band");
  EXPECT_LT(part["active_voxels"], whole["active_voxels"]);
  // Patches stand upwards, on the positive side.
  const Json patch = json(
      "read plane.asc ! surface-band --voxel 0.1 --half-width 12 --as land ! "
      "patch @land --at 4,2,2 --size 1,1 --height 0.4 ! mesh ! measure --json");
  EXPECT_GT(patch["bounds"]["max"][2], 2.3);
  expectRefusal("read hole.asc ! surface-band --voxel 0.1 --half-width 5", 3, "have no data");
  EXPECT_EQ(
      levelsmith("read hole.asc ! surface-band --voxel 0.1 --half-width 5 --allow-missing").code,
      0);
  expectRefusal(
      "sphere --radius 1 --voxel 0.2 ! mesh ! surface-band --voxel 0.1 --box '0,0,0 1,1,1'", 2,
      "--box is for terrains");
}

TEST_F(TerrainActions, ScatterFollowsSlopeAndHeight) {
  // Level ground at x < 20 and x > 40, with a slope of 45 degrees between them.
  std::string rows;
  for (int j = 0; j < 31; ++j) {
    for (int i = 0; i < 31; ++i)
      rows += std::to_string(i < 10 ? 0 : i > 20 ? 20 : 2 * (i - 10)) + " ";
    rows += "\n";
  }
  writeFile("step.asc", "ncols 31\nnrows 31\nxllcenter 0\nyllcenter 0\ncellsize 2\n" + rows);
  const auto placed = [&](const std::string& density) {
    return json(
        "read step.asc ! surface-band --voxel 1 --half-width 5 --as ground ! scatter @ground "
        "--count 20 --size 2,2 --particles spline --height 2 --layers 2 --density \"" +
        density +
        "\" --as places ! box --size 1,1,1 --voxel 0.25 ! mesh --as stone "
        "! texture @ground @stone @places --map mesh ! measure --json")["bounds"];
  };
  const Json steep = placed("acos(nz)*180/pi > 30");
  EXPECT_GT(steep["min"][0], 16);
  EXPECT_LT(steep["max"][0], 44);
  const Json high = placed("nz > 0.95 && z > 10");
  EXPECT_GT(high["min"][0], 36);
  const Json low = placed("(nz > 0.95) * (z < 10)");
  EXPECT_LT(low["max"][0], 24);
  const std::string scatter =
      "sphere --radius 4 --voxel 0.5 ! scatter --count 3 --size 1,1 --height 1 --density ";
  expectRefusal(scatter + "k", 2, "the curvature k");
  expectRefusal(scatter + "t", 2, "the time t");
  expectRefusal(scatter + "\"sqrt(nz - 2)\"", 2, "not a number");
}

TEST_F(TerrainActions, MeshAndRenderShowTheGround) {
  EXPECT_EQ(json("read plane.asc ! mesh ! measure --json")["triangles"], 16);
  EXPECT_EQ(json("read hole.asc ! mesh --allow-missing ! measure --json")["triangles"], 10);
  expectRefusal("read hole.asc ! mesh", 3, "have no data");
  expectRefusal("read plane.asc ! mesh --sharp", 2,
                "--sharp applies to a level set, not to a terrain");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! mesh --allow-missing", 2, "is for a terrain");
  EXPECT_EQ(levelsmith("read hole.asc ! render a.png --size 32x24 --up 0,0,1").code, 0);
  EXPECT_EQ(
      levelsmith("read hole.asc ! render a.exr --size 32x24 --up 0,0,1 --renderer both --facets")
          .code,
      0);
  expectRefusal("sphere --radius 1 --voxel 0.2 ! render a.png --facets", 2,
                "--facets is for terrains");
  expectRefusal("read plane.asc ! render a.png --outside '0,0,1 8,4,2'", 3, "beyond the heights");
  expectRefusal("read plane.asc ! terrain --crop '-1,-1,0 1,9,9' ! render a.png", 3,
                "at least 2x2");
}

TEST_F(TerrainActions, SceneReplacesGroundByASolid) {
  const std::string scene =
      "read plane.asc --as land ! solidify --base -2 --voxel 0.5 --as earth ! scene @land @earth ";
  const Json info = json(scene + "--outside '-1,-1,-9 9,5,9' ! info --json");
  EXPECT_EQ(info["terrains"][0]["name"], "land");
  EXPECT_EQ(info["terrains"][0]["columns"], 5);
  EXPECT_EQ(info["solids"][0]["name"], "earth");
  ASSERT_EQ(levelsmith(scene + "! write a.json").code, 0);
  EXPECT_EQ(levelsmith("read a.json ! render a.png --size 32x24 --up 0,0,1").code, 0);
  expectRefusal(scene + "--opacities '0.5 1'", 2, "transparent");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! scene --outside '0,0,0 1,1,1'", 2,
                "--outside is for terrains");
}

TEST_F(TerrainActions, SculptChangesHeights) {
  const Json raised = json(
      "read plane.asc ! sculpt --brush raise --at 4,2,0 --radius 1.5 "
      "--strength 3 ! info --json");
  EXPECT_EQ(raised["range"], (Json{0.0, 5.0}));  // only the sample (4, 2) of height 2
  // A road along the middle row, with heights that rise to the east.
  const Json road = json(
      "read plane.asc ! sculpt --brush flatten --at '0,2,10 8,2,14' --stroke "
      "--to-points --radius 0.5 --strength 1 ! info --json");
  EXPECT_EQ(road["range"], (Json{0.0, 14.0}));
  EXPECT_EQ(levelsmith("read hole.asc ! sculpt --brush noise --at 4,2,0 --radius 4 --strength 1 "
                       "--wavelength 3 --seed 2 ! sculpt --brush smooth --at 4,2,0 --radius 4 "
                       "--strength 1 ! sculpt --brush erode --at 4,2,0 --radius 4 --strength 1 "
                       "--talus 5 --passes 3 ! info")
                .code,
            0);
  const support::Outcome beside =
      levelsmith("read plane.asc ! sculpt --brush raise --at 99,2,0 --radius 1 --strength 3");
  EXPECT_EQ(beside.code, 0);
  EXPECT_NE(beside.err.find("no sample is below the brush"), std::string::npos);
  // Along a straight line, the middle rises by the strength; further points of the line do not
  // count.
  std::string flat = "ncols 101\nnrows 41\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
  for (int n = 0; n < 101 * 41; ++n) flat += "0 ";
  writeFile("flat.asc", flat);
  for (const char* line : {"0,20,0 100,20,0", "0,20,0 1,20,0 2,20,0 50.5,20,0 100,20,0"}) {
    const Json stroke = json(std::string("read flat.asc ! sculpt --brush raise --stroke --radius 8 "
                                         "--strength 3 --at '") +
                             line + "' ! terrain --crop '30,19.5,-9 70,20.5,9' ! info --json");
    EXPECT_NEAR(stroke["range"][0], 3, support::measured(0.006));
    EXPECT_NEAR(stroke["range"][1], 3, support::measured(0.006));
  }
  const std::string brush = "read plane.asc ! sculpt --at 4,2,0 --radius 1 --strength 0.5 --brush ";
  expectRefusal(brush + "raise --talus 3", 2, "--talus has no meaning for --brush raise");
  expectRefusal(brush + "erode --talus 90", 2, "--talus");
  expectRefusal(brush + "smooth --passes 0", 2, "1 to 1000");
  expectRefusal(brush + "flatten --level 1 --to-points", 2, "leave one out");
  expectRefusal("read plane.asc ! sculpt --brush smooth --at 4,2,0 --radius 1 --strength 2", 2,
                "0 to 1");
  expectRefusal(
      "read plane.asc ! sculpt --brush raise --at '0,0,0 8,0,0' --stroke --radius 1e-9 "
      "--strength 2",
      2, "larger --radius");
  expectRefusal("read plane.asc ! sculpt --brush raise --at 4,2,0 --stroke --radius 3 --strength 2",
                2, "at least two positions");
}

TEST_F(TerrainActions, SculptKeepsItsEditsInAFile) {
  const std::string sculpted = "sculpt --brush raise --at 4,2,0 --radius 3 --strength 2";
  const Json direct = json("read plane.asc ! " + sculpted + " --edits a.edits ! info --json");
  const Json again = json("read plane.asc ! terrain --edits a.edits ! info --json");
  EXPECT_EQ(again["hash"], direct["hash"]);
  EXPECT_NE(direct["hash"], json("read plane.asc ! info --json")["hash"]);
  expectRefusal("read hole.asc ! terrain --edits a.edits", 3, "other heights");
  expectRefusal("read plane.asc ! terrain --edits plane.asc", 3, "no file of terrain edits");
  expectRefusal("read plane.asc ! terrain --edits none.edits", 6, "none.edits");
}

TEST_F(TerrainActions, WriteKeepsWhatTheFormatHolds) {
  ASSERT_EQ(levelsmith("read hole.asc ! write again.asc").code, 0);
  EXPECT_EQ(json("read again.asc ! info --json")["hash"],
            json("read hole.asc ! info --json")["hash"]);
  expectRefusal("read plane.asc ! write a.ply", 2, "write .asc or .lst, or put 'mesh' before it");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! write a.asc", 2, "a level set cannot be written");
  expectRefusal("read plane.asc ! write a.hgt", 2, "no known format");
  writeFile("plane.prj", "PROJCS[\"UTM 32\"]");
  const support::Outcome warned = levelsmith("read plane.asc ! write b.asc");
  EXPECT_NE(warned.err.find("does not store the coordinate system 'UTM 32'"), std::string::npos);
}

/// The cache knows the files beside a grid, and that the name of a tile is its place.
TEST_F(TerrainActions, CachesWhatIsBesideTheFile) {
  const std::string measure = "--cache c read plane.asc ! measure --json";
  EXPECT_EQ(json(measure)["volume_above"], 64);
  EXPECT_EQ(json(measure)["volume_above"], 64);
  writeFile("plane.prj", "GEOGCS[\"WGS 84\"]");
  expectRefusal(measure, 3, "terrain --metric");
  writeFile("a.flt", std::string(16, '\0'));
  const std::string header = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize ";
  for (const double size : {1.0, 3.0}) {
    writeFile("a.hdr", header + std::to_string(size));
    EXPECT_EQ(json("--cache c read a.flt ! measure --json")["area"], size * size);
  }
  for (const char* name : {"N00E000.hgt", "N05E000.hgt"}) {
    writeFile(name, std::string(2 * 1201 * 1201, '\0'));
    EXPECT_EQ(json(std::string("--cache c read ") + name + " ! info --json")["origin"][1],
              name[2] - '0');
  }
}

TEST_F(TerrainActions, PlansWithoutRunning) {
  for (const char* chain :
       {"read plane.asc ! terrain --spacing 30,30 ! solidify --base -9 --voxel 1",
        "read plane.asc ! terrain --crop '0,0,0 5,5,5' ! surface-band --resolution 50",
        "read plane.asc ! slope ! terrain --scale 2 ! info"})
    EXPECT_EQ(levelsmith(std::string("--dry-run ") + chain).code, 0) << chain;
}

TEST_F(TerrainActions, ExplainShowsTheBoxesThatBecomeVolumes) {
  const auto plan = levelsmith(
      "--explain read plane.asc --as land ! terrain --crop \"2,0,0 6,4,9\" ! solidify --base -9 "
      "--voxel 0.5 --lower-edges 0.5vx --as cut ! surface-band @land --box \"0,0,0 4,3,9\" --voxel "
      "0.5 "
      "! info ! scene @land @cut --outside \"2,0,-9 6,4,9\" ! render a.png");
  ASSERT_EQ(plan.code, 0) << plan.err;
  const std::string text = plan.out + plan.err;
  EXPECT_NE(text.find("; 5x3 samples"), std::string::npos) << text;
  EXPECT_NE(text.find("; 3x3 samples"), std::string::npos) << text;
  EXPECT_NE(text.find("; a volume from 2,0,-9 to 6,4,4"), std::string::npos) << text;
  EXPECT_NE(text.find("; a volume from 0,0,0 to 4,3,4"), std::string::npos) << text;
}

}  // namespace terrain_actions_test
