// Actions that change segmentations on the command line.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tests/support/action_test.h"

namespace segment_edit_actions_test {

using Json = nlohmann::json;
using std::numbers::pi;

class SegmentEditActions : public support::ActionTest {};

// A ball of radius 0.6 inside one of radius 1. Meshes of this voxel size lose 1 % of their volume.
constexpr const char* kNested =
    "sphere --radius 1 --voxel 0.1 ! sphere --radius 0.6 --voxel 0.1 ! segment ";
double ballVolume(double radius) {
  return 4 * pi / 3 * radius * radius * radius;
}
double volumeOf(const Json& measured, int label) {
  for (const Json& material : measured["materials"])
    if (material["label"] == label) return material["volume"].get<double>();
  return 0;
}

TEST_F(SegmentEditActions, UnionAddsALevelSetToARegion) {
  const std::string ball = std::string(kNested) + "! sphere --radius 0.8 --voxel 0.1 ! union ";
  const Json all = json(ball + "--label 5 ! measure --json");
  EXPECT_NEAR(volumeOf(all, 5), ballVolume(0.8), 0.03);
  EXPECT_EQ(volumeOf(all, 2), 0);
  EXPECT_NEAR(volumeOf(all, 1), ballVolume(1) - ballVolume(0.8), 0.03);
  const Json outer = json(ball + "--label 5 --over 1,void ! measure --json");
  EXPECT_NEAR(volumeOf(outer, 2), ballVolume(0.6), 0.03);
  EXPECT_NEAR(volumeOf(outer, 5), ballVolume(0.8) - ballVolume(0.6), 0.03);
  expectRefusal(ball + "! measure", 2, "needs --label");
  expectRefusal(ball + "--label 0 ! measure", 2, "is not a label");
  expectRefusal(ball + "--label 5 --over 9 ! measure", 2, "has no region 9");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! sphere --radius 0.8 --voxel 0.1 ! union --label 3",
                2, "is for a segmentation");
}

TEST_F(SegmentEditActions, DifferenceCutsALevelSetOut) {
  const std::string ball = std::string(kNested) + "! sphere --radius 0.8 --voxel 0.1 ! difference ";
  const Json all = json(ball + "! measure --json");
  EXPECT_EQ(all["materials"].size(), 1u);
  EXPECT_NEAR(volumeOf(all, 1), ballVolume(1) - ballVolume(0.8), 0.03);
  EXPECT_NEAR(volumeOf(json(ball + "--over 1 ! measure --json"), 2), ballVolume(0.6), 0.03);
}

TEST_F(SegmentEditActions, OffsetMovesOneRegion) {
  const std::string offset = std::string(kNested) + "! offset ";
  const Json grown = json(offset + "0.2 --label 2 ! measure --json");
  EXPECT_NEAR(volumeOf(grown, 2), ballVolume(0.8), 0.03);
  EXPECT_NEAR(grown["volume"].get<double>(), ballVolume(1), 0.04);
  const Json shrunk = json(offset + "-2vx --label 2 --cost void ! measure --json");
  EXPECT_NEAR(volumeOf(shrunk, 2), ballVolume(0.4), 0.03);
  EXPECT_EQ(shrunk["cavities"], 1);
  expectRefusal(offset + "0.2 ! measure", 2, "needs --label");
  expectRefusal(offset + "0.2 --label 7 ! measure", 2, "has no region 7");
  expectRefusal(offset + "--by x --label 2 ! measure", 2, "--by does not apply");
}

TEST_F(SegmentEditActions, CurvatureFlowMovesAllInterfaces) {
  const Json free = json(std::string(kNested) + "! curvature-flow 0.05 ! measure --json");
  EXPECT_NEAR(volumeOf(free, 2), ballVolume(0.4), 0.03);
  EXPECT_NEAR(free["volume"].get<double>(), ballVolume(std::sqrt(0.8)),
              0.1);  // measured 0.077: radius and mesh
  const Json fixed =
      json(std::string(kNested) + "! curvature-flow 0.05 --fixed void ! measure --json");
  EXPECT_NEAR(fixed["volume"].get<double>(), ballVolume(1), 0.06);
  expectRefusal(std::string(kNested) + "! curvature-flow 0.05 --scheme implicit ! measure", 2,
                "--scheme does not apply");
}

TEST_F(SegmentEditActions, MorphAndRelabel) {
  const Json ball = json(
      "sphere --radius 1 --voxel 0.1 ! segment ! sphere --radius 1.4 --voxel 0.1 ! segment ! morph "
      "--until 0.5 ! measure --json");
  EXPECT_NEAR(volumeOf(ball, 1), ballVolume(1.2), 0.06);
  const Json merged = json(std::string(kNested) + "! relabel 2=1 ! measure --json");
  EXPECT_EQ(merged["interfaces"].size(), 1u);
  EXPECT_NEAR(volumeOf(merged, 1), ballVolume(1), 0.04);
  EXPECT_EQ(json(std::string(kNested) + "! relabel 1=7,2=void ! measure --json")["cavities"], 1);
  expectRefusal(std::string(kNested) + "! relabel 1 ! measure", 2, "is not OLD=NEW");
  expectRefusal(std::string(kNested) + "! relabel 8=1 ! measure", 2, "has no region 8");
}

}  // namespace segment_edit_actions_test
