// Adaptive fields on the command line: level-set --adaptive, to-band, and the actions that take
// them.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace adaptive_actions_test {

using Json = nlohmann::json;

class AdaptiveActions : public support::ActionTest {
 protected:
  void SetUp() override {
    support::ActionTest::SetUp();
    // A cube with corners at 0 and 10, and one that begins at 5.
    ASSERT_EQ(
        levelsmith("box --size 10,10,10 --center 5,5,5 --voxel 0.5 ! mesh --sharp ! write cube.ply")
            .code,
        0);
    ASSERT_EQ(levelsmith("read cube.ply ! transform --translate 5,5,5 ! write moved.ply").code, 0);
  }
};

// Edges of 120 in all are cut off within the tolerance.
constexpr double kVolumeBound = 5;  // measured up to 3.2 with an offset, 1.5 otherwise
constexpr const char* kCube = "read cube.ply ! level-set --adaptive --tolerance 0.1 ";
constexpr const char* kMoved = "read moved.ply ! level-set --adaptive --tolerance 0.1 ";

TEST_F(AdaptiveActions, MakeMeasureMeshAndConvert) {
  const std::string cube = kCube;
  const Json info = json(cube + "! info --json");
  EXPECT_EQ(info["kind"], "adaptive field");
  EXPECT_EQ(info["tolerance"], 0.1);
  EXPECT_NEAR(info["width"].get<double>(), 0.02 * 10 * std::sqrt(3.0), 1e-9);
  const Json measured = json(cube + "! measure --json");
  EXPECT_NEAR(measured["volume"].get<double>(), 1000, kVolumeBound);
  EXPECT_EQ(measured["euler"], 2);
  const Json mesh = json(cube + "! mesh ! measure --json");
  EXPECT_EQ(mesh["closed_manifold"], true);
  EXPECT_EQ(mesh["volume"], measured["volume"]);
  // measure rounds the edges of a level set: 996.4 for the box of this voxel size.
  const Json band = json(cube + "! to-band --voxel 0.25 ! measure --json");
  const Json box = json("box --size 10,10,10 --voxel 0.25 ! measure --json");
  EXPECT_NEAR(band["volume"].get<double>(), box["volume"].get<double>(), kVolumeBound);
  EXPECT_EQ(levelsmith(cube + "! to-band --voxel 0.25 ! check").code, 0);
  // From a level set, and relative to the size.
  const std::string level = "sphere --radius 5 --voxel 0.25 ";
  const Json ofBand = json(level + "! level-set --adaptive --tolerance 1% ! measure --json");
  EXPECT_NEAR(ofBand["volume"].get<double>(), 500 * std::numbers::pi / 3,
              0.1 * 100 * std::numbers::pi);
}

TEST_F(AdaptiveActions, InterpolateTricubically) {
  const std::string ball =
                        "sphere --radius 5 --voxel 0.25 ! level-set --adaptive --tolerance 0.03 ",
                    tricubic = ball + "--interpolation tricubic ";
  const Json linear = json(ball + "! info --json"), cubic = json(tricubic + "! info --json");
  EXPECT_EQ(linear["interpolation"], "trilinear");
  EXPECT_EQ(cubic["interpolation"], "tricubic");
  EXPECT_LT(cubic["bytes"].get<double>(), linear["bytes"].get<double>() / 6);  // measured 1/12.6
  // The facets of the level set's mesh cut off 2.
  EXPECT_NEAR(json(tricubic + "! measure --json")["volume"].get<double>(),
              500 * std::numbers::pi / 3, 6);
  EXPECT_EQ(json(tricubic + "! mesh ! measure --json")["closed_manifold"], true);
  const Json joined = json(std::string(kCube) + "--interpolation tricubic ! " + kMoved +
                           "--interpolation tricubic ! union ! info --json");
  EXPECT_EQ(joined["interpolation"], "tricubic");
}

TEST_F(AdaptiveActions, CombineAndOffset) {
  const std::string both = std::string(kCube) + "! " + kMoved + "! ";
  EXPECT_NEAR(json(both + "union ! measure --json")["volume"].get<double>(), 1875, kVolumeBound);
  EXPECT_NEAR(json(both + "intersection ! measure --json")["volume"].get<double>(), 125,
              kVolumeBound);
  EXPECT_NEAR(json(both + "difference ! measure --json")["volume"].get<double>(), 875,
              kVolumeBound);
  // The rounded box of an outward offset, and the smaller cube of an inward one.
  constexpr double kPi = std::numbers::pi, kD = 0.2;
  const double grown = 1000 + 600 * kD + 30 * kPi * kD * kD + 4 * kPi / 3 * kD * kD * kD;
  const std::pair<const char*, double> offsets[] = {
      {"0.2", grown}, {"-0.2", 9.6 * 9.6 * 9.6}, {"-0.04", 9.92 * 9.92 * 9.92}};
  for (const auto& [distance, volume] : offsets) {
    const Json moved = json(std::string(kCube) + "! offset " + distance + " ! measure --json");
    EXPECT_EQ(moved["components"], 1) << distance;
    EXPECT_EQ(moved["euler"], 2) << distance;
    EXPECT_NEAR(moved["volume"].get<double>(), volume, kVolumeBound) << distance;
  }
  const Json difference = json(both + "compare --json");
  EXPECT_NEAR(difference["hausdorff"].get<double>(), 5 * std::sqrt(3.0), 0.2);
  EXPECT_NEAR(difference["symmetric_difference"].get<double>(), 1750, 2 * kVolumeBound);
  const Json same = json(std::string(kCube) + "! " + kCube + "! compare --json");
  EXPECT_LT(same["hausdorff"].get<double>(), 1e-9);
}

TEST_F(AdaptiveActions, LeaveTheVoxelSizeToOtherActions) {
  // The global tolerance chooses the voxel size of to-band, and none for the adaptive field.
  const Json m = json(
      "--tolerance 0.1 box --size 4,4,4 --voxel 0.5 ! mesh --sharp ! level-set --adaptive "
      "--tolerance 0.05 ! "
      "to-band ! measure --json");
  EXPECT_NEAR(m["volume"].get<double>(), 64, 2);
}

TEST_F(AdaptiveActions, AreDrawn) {
  EXPECT_EQ(levelsmith(std::string(kCube) + "! render a.png --size 64x48").code, 0);
  EXPECT_TRUE(exists("a.png"));
}

TEST_F(AdaptiveActions, RefuseWhatDoesNotApply) {
  const std::string cube = kCube;
  expectRefusal("read cube.ply ! level-set --adaptive", 2, "--adaptive needs --tolerance");
  expectRefusal("read cube.ply ! level-set --voxel 1 --tolerance 1", 2,
                "--tolerance needs --adaptive");
  expectRefusal("read cube.ply ! level-set --voxel 1 --interpolation tricubic", 2,
                "--interpolation needs --adaptive");
  expectRefusal(cube + "--voxel 1", 2, "--voxel does not apply to --adaptive");
  expectRefusal(cube + "--half-width 4", 2, "--half-width does not apply");
  expectRefusal("read cube.ply ! sample --count 100 ! level-set --adaptive --tolerance 1", 2,
                "point cloud");
  expectRefusal(
      "sphere --radius 1 --voxel 0.1 ! level-set --adaptive --tolerance 0.1 --sign closed", 2,
      "--sign is for meshes");
  expectRefusal(cube + "! write a.vdb", 2, "'to-band' before it");
  expectRefusal(cube + "! smooth --sigma 1", 2, "put 'to-band' before it");
  expectRefusal(cube + "! offset", 2, "--distance is missing");
  expectRefusal(cube + "! offset 3", 2, "put 'to-band' before the offset");
  expectRefusal(cube + "! offset 0.1 --half-width 3", 2, "does not apply to an adaptive field");
  expectRefusal(cube + "! mesh --sharp", 2, "not to an adaptive field");
  expectRefusal(cube + "! sphere --radius 1 --voxel 0.1 ! union", 2, "operand 2 is a level set");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! " + cube + "! compare", 2,
                "operand 2 is an adaptive field");
  expectRefusal(cube + "! to-band", 2, "--voxel");
  expectRefusal(cube + "! to-band --voxel 100", 3, "larger than the object");
  expectRefusal("read cube.ply ! level-set --adaptive --tolerance 1e-7", 2, "tolerance");
}

}  // namespace adaptive_actions_test
