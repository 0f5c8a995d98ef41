// Segmentations on the command line: segment, extract, and the actions that take them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace segment_actions_test {

using Json = nlohmann::json;

class SegmentActions : public support::ActionTest {};

// A ball of radius 1 in a box, and one that covers a part of it.
constexpr const char* kThree =
    "box --size 4,4,4 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! sphere --radius 1 --center "
    "0.8,0,0 "
    "--voxel 0.1 ! segment ";
constexpr double kBall = 4 * std::numbers::pi / 3;
/// Volume of the intersection of the two balls.
constexpr double kLens = 0.576 * std::numbers::pi;

TEST_F(SegmentActions, LaterSolidsWin) {
  const Json m = json(std::string(kThree) + "! measure --json");
  ASSERT_EQ(m["materials"].size(), 3u);
  EXPECT_EQ(m["components"], 1);
  EXPECT_EQ(m["euler"], 2);
  EXPECT_NEAR(m["bounds"]["max"][0].get<double>(), 2, 0.01);
  EXPECT_NEAR(m["materials"][2]["bounds"]["max"][0].get<double>(), 1.8, 0.01);
  const double expected[3] = {64 - 2 * kBall + kLens, kBall - kLens, kBall};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(m["materials"][k]["label"], k + 1);
    EXPECT_NEAR(m["materials"][k]["volume"].get<double>(), expected[k], 0.3) << k;  // edges: 0.12
  }
  EXPECT_NEAR(m["volume"].get<double>(), 64, 0.3);
  // The box against the void and both balls, and the balls against each other.
  ASSERT_EQ(m["interfaces"].size(), 4u);
  EXPECT_EQ(m["interfaces"][0]["labels"], Json::array({0, 1}));
  EXPECT_NEAR(m["interfaces"][0]["area"].get<double>(), 96, 2);
  EXPECT_EQ(m["interfaces"][3]["labels"], Json::array({2, 3}));
  // A cap of height 0.6, and its circle.
  EXPECT_NEAR(m["interfaces"][3]["area"].get<double>(), 1.2 * std::numbers::pi, 0.03);
  EXPECT_NEAR(m["junction_length"].get<double>(), 2 * std::numbers::pi * std::sqrt(0.84), 0.05);
  const Json text = json(std::string(kThree) + "--labels 7,300,65535 ! info --json");
  EXPECT_EQ(text["kind"], "segmentation");
  EXPECT_EQ(text["labels"], Json::array({7, 300, 65535}));
}

TEST_F(SegmentActions, WritesAndReadsFilesOfGrids) {
  const Json made = json(std::string(kThree) +
                         "--labels 7,300,65535 ! write parts.vdb ! info "
                         "--json"),
             read = json("read parts.vdb ! info --json");
  EXPECT_EQ(read["kind"], "segmentation");
  EXPECT_EQ(read["hash"], made["hash"]);
  EXPECT_EQ(json("read parts.vdb --grid distance ! info --json")["kind"], "field");
  expectRefusal(std::string(kThree) + "! write parts.vdb --name parts", 2,
                "the grids of a segmentation have names of their own");
  expectRefusal(std::string(kThree) + "! write parts.nvdb", 2, "write .vdb, .ply or .obj");
}

TEST_F(SegmentActions, TransformMovesAndScalesRegions) {
  const Json before = json(std::string(kThree) + "! measure --json"),
             after = json(std::string(kThree) +
                          "! transform --scale 2 --rotate 30 --translate 1,0,0 ! measure --json");
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(after["materials"][k]["volume"].get<double>(),
                8 * before["materials"][k]["volume"].get<double>(), 1e-3);
  EXPECT_NEAR(after["junction_length"].get<double>(), 2 * before["junction_length"].get<double>(),
              1e-4);
  expectRefusal(std::string(kThree) + "! transform --mirror x", 3,
                "transform the parts before 'segment'");
  expectRefusal(std::string(kThree) + "! transform --scale 2 --bake", 2,
                "--bake does not apply to a segmentation");
}

TEST_F(SegmentActions, NamedOperandsHaveTheirOwnOrder) {
  const std::string named =
      "sphere --radius 1 --voxel 0.1 --as a ! sphere --radius 1 --center 0.8,0,0 "
      "--voxel 0.1 --as b ! ";
  const Json ab = json(named + "segment @a @b ! measure --json"),
             ba = json(named + "segment @b @a ! measure --json");
  EXPECT_NEAR(ab["materials"][1]["volume"].get<double>(), kBall, 0.06);
  EXPECT_NEAR(ba["materials"][1]["volume"].get<double>(), kBall, 0.06);
  EXPECT_NEAR(ab["materials"][0]["volume"].get<double>(), kBall - kLens, 0.06);
  // Another kind of value ends what is taken from the stack.
  EXPECT_EQ(json("sphere --radius 1 --voxel 0.1 ! mesh ! sphere --radius 1 --voxel 0.1 ! segment ! "
                 "info --json")["labels"],
            Json::array({1}));
}

TEST_F(SegmentActions, ExtractsSolids) {
  const Json band = json(std::string(kThree) + "! extract 2 ! measure --json");
  EXPECT_NEAR(band["volume"].get<double>(), kBall - kLens, 0.06);
  EXPECT_EQ(band["half_width"], 3);
  EXPECT_EQ(levelsmith(std::string(kThree) + "! extract 1 ! check").code, 0);
  const Json mesh = json(std::string(kThree) + "! mesh --label 2 ! measure --json");
  EXPECT_EQ(mesh["closed_manifold"], true);
  EXPECT_NEAR(mesh["volume"].get<double>(), kBall - kLens, 0.06);
  const Json all = json(std::string(kThree) + "! mesh ! measure --json");
  EXPECT_EQ(all["boundary_edges"], 0);
  EXPECT_GT(all["non_manifold_edges"].get<int>(), 10);
}

TEST_F(SegmentActions, WriteTheLabelsOfBothSides) {
  const Json all =
      json(std::string(kThree) + "! write a.ply ! write a.obj ! write a.ply.gz ! measure --json");
  for (const char* name : {"a.ply", "a.obj", "a.ply.gz"}) {
    const Json read = json("read " + std::string(name) + " ! info --json");
    EXPECT_EQ(read["kind"], "mesh");
    EXPECT_EQ(read["triangles"], all["triangles"]) << name;
  }
  const support::Outcome groups = shell("grep ^g a.obj");
  EXPECT_EQ(groups.out, "g interface_0_1\ng interface_1_2\ng interface_1_3\ng interface_2_3\n");
  const support::Outcome header = shell("head -c 500 a.ply | grep -a -c 'property ushort'");
  EXPECT_EQ(header.out, "2\n");
  expectRefusal(std::string(kThree) + "! write a.stl", 2, "write .vdb, .ply or .obj");
}

TEST_F(SegmentActions, AreDrawn) {
  EXPECT_EQ(levelsmith(std::string(kThree) + "! render a.png --size 64x48").code, 0);
  EXPECT_TRUE(exists("a.png"));
}

TEST_F(SegmentActions, ReadVolumesOfLabels) {
  // A block of 12 x 12 x 9 samples with label 1, and a layer of three with label 2 on it.
  std::string text =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 16 16 16\nencoding: raw\nspace: RAS\n"
      "space directions: (1,0,0) (0,1,0) (0,0,1)\n\n";
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x) {
        const bool isIn = std::min({x, y, z}) >= 2 && std::max({x, y, z}) < 14;
        text += static_cast<char>(isIn ? (z < 11 ? 1 : 2) : 0);
      }
  writeFile("atlas.nrrd", text);
  const Json m = json("read atlas.nrrd ! segment ! measure --json");
  ASSERT_EQ(m["materials"].size(), 2u);
  EXPECT_NEAR(m["materials"][0]["volume"].get<double>(), 12 * 12 * 9, 30);  // edges are cut off
  EXPECT_NEAR(m["materials"][1]["volume"].get<double>(), 12 * 12 * 3, 30);
  expectRefusal("read atlas.nrrd ! segment --labels 1", 2, "--labels is for level sets");
}

TEST_F(SegmentActions, ReadMeshesWithWalls) {
  const Json all = json(std::string(kThree) + "! write a.ply ! measure --json");
  const Json again = json("read a.ply ! segment --voxel 0.1 ! measure --json");
  ASSERT_EQ(again["materials"].size(), 3u);  // by decreasing volume: the box, a ball, the other
  const std::size_t order[3] = {0, 2, 1};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(again["materials"][k]["volume"].get<double>(),
                all["materials"][order[k]]["volume"].get<double>(), 0.05)
        << k;
  expectRefusal("read a.ply ! segment", 2, "--voxel");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! segment --voxel 0.1", 2, "--voxel is for a mesh");
}

TEST_F(SegmentActions, ReportRegionsThatVanish) {
  const support::Outcome outcome = levelsmith(
      "sphere --radius 0.5 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! segment ! info");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("region 1 is empty: later solids cover it"), std::string::npos)
      << outcome.err;
  // A plate of half a voxel remains of the box.
  const support::Outcome thin = levelsmith(
      "box --size 2,2,2 --voxel 0.1 ! box --size 2,2,2 --center 0,0,0.05 --voxel 0.1 ! segment ! "
      "info");
  EXPECT_EQ(thin.code, 0);
  EXPECT_NE(thin.err.find("region 1 is thinner than a voxel"), std::string::npos) << thin.err;
}

TEST_F(SegmentActions, RefuseWhatDoesNotApply) {
  expectRefusal("segment", 2, "operand");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! segment --labels 1,2", 2, "2 labels for 1");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! segment --labels 0", 2, "not a label");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! segment --smooth 1", 2,
                "--smooth is for a volume");
  expectRefusal(std::string(kThree) + "! extract 9", 3, "has no region 9; its labels are 1, 2, 3");
  expectRefusal(std::string(kThree) + "! extract", 2, "label");
  expectRefusal(std::string(kThree) + "! smooth --sigma 1", 2, "put 'extract LABEL' before it");
  expectRefusal(std::string(kThree) + "! mesh --sharp", 2, "not to a segmentation");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! mesh --label 1", 2,
                "--label is for a segmentation");
}

}  // namespace segment_actions_test
