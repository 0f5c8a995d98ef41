// Segmentations with sheets on the command line.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace segment_sheets_actions_test {

using Json = nlohmann::json;

class SegmentSheetsActions : public support::ActionTest {
 protected:
  void SetUp() override {
    ActionTest::SetUp();
    // A square of side 2, and a box of side 2 with a wall of half its height, which touches the
    // box without sharing edges.
    writeFile("square.obj", "v 0 0 0.03\nv 2 0 0.03\nv 2 2 0.03\nv 0 2 0.03\nf 1 2 3\nf 1 3 4\n");
    writeFile("room.obj",
              "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"
              "v 0.02 -1 -1\nv 0.02 1 -1\nv 0.02 1 0.03\nv 0.02 -1 0.03\n"
              "f 1 3 2\nf 2 3 4\nf 5 6 7\nf 6 8 7\nf 1 2 5\nf 2 6 5\nf 3 7 4\nf 4 7 8\n"
              "f 1 5 3\nf 3 5 7\nf 2 4 6\nf 4 8 6\nf 9 10 11\nf 9 11 12\n");
  }
};

constexpr const char* kSquare = "read square.obj ! segment --sheets --voxel 0.1 ";
constexpr const char* kRoom = "read room.obj ! segment --sheets --voxel 0.1 ";

TEST_F(SegmentSheetsActions, MeasureSheets) {
  const Json square = json(std::string(kSquare) + "! measure --json");
  EXPECT_TRUE(square["materials"].empty());
  ASSERT_EQ(square["interfaces"].size(), 1u);
  EXPECT_EQ(square["interfaces"][0]["labels"], Json::array({0, 0}));
  EXPECT_NEAR(square["sheet_area"].get<double>(), 4, 1e-6);
  EXPECT_NEAR(square["rim_length"].get<double>(), 8, 1e-6);
  EXPECT_EQ(square["components"], 0);
  EXPECT_NEAR(square["bounds"]["max"][0].get<double>(), 2, 1e-6);
  const Json room = json(std::string(kRoom) + "! measure --json");
  ASSERT_EQ(room["materials"].size(), 1u);
  EXPECT_NEAR(room["materials"][0]["sheet_area"].get<double>(), 2 * 1.03, 0.03);
  EXPECT_EQ(room["euler"], 2);
  EXPECT_EQ(room["interfaces"][1]["labels"], Json::array({1, 1}));
  // Without sheets the figures are those of other segmentations.
  const Json ball =
      json("sphere --radius 1 --voxel 0.1 ! mesh ! segment --sheets --voxel 0.1 ! measure --json");
  EXPECT_FALSE(ball.contains("sheet_area"));
  EXPECT_EQ(json(std::string(kRoom) + "! info --json")["sheets"], Json::array({1}));
}

TEST_F(SegmentSheetsActions, WriteSheets) {
  const Json mesh =
      json(std::string(kRoom) + "! write a.ply ! write a.obj ! mesh ! measure --json");
  EXPECT_GT(mesh["boundary_edges"].get<int>(), 20);
  EXPECT_EQ(shell("grep ^g a.obj").out, "g interface_0_1\ng interface_1_1\n");
}

TEST_F(SegmentSheetsActions, AreSeenByRays) {
  const std::string view = "! render a.exr --size 24x18 --samples 1 --renderer both";
  for (const char* scene : {kRoom, kSquare}) {
    const support::Outcome drawn = levelsmith(std::string(scene) + view);
    EXPECT_EQ(drawn.code, 0) << drawn.err;
    EXPECT_NE(drawn.err.find(" triangles of sheets, "), std::string::npos) << drawn.err;
  }
  // The wall remains of a room that is hidden.
  const support::Outcome wall = levelsmith(std::string(kRoom) + view + " --hide 1");
  EXPECT_EQ(wall.code, 0) << wall.err;
  expectRefusal(std::string(kRoom) + "! render a.png --hide 2", 3, "has no region 2 to hide");
  // Other fields do not mention sheets.
  const support::Outcome ball =
      levelsmith("sphere --radius 1 --voxel 0.1 ! segment ! render a.png --size 16x12");
  EXPECT_EQ(ball.code, 0);
  EXPECT_EQ(ball.err.find("sheets"), std::string::npos) << ball.err;
}

TEST_F(SegmentSheetsActions, LeaveSheetsOutOfSolids) {
  const support::Outcome solid = levelsmith(std::string(kRoom) + "! extract 1 ! measure --json");
  EXPECT_EQ(solid.code, 0) << solid.err;
  EXPECT_NEAR(Json::parse(solid.out)["volume"].get<double>(), 8, 0.15);  // edges: 0.11
  EXPECT_NE(solid.err.find("region 1 has sheets inside"), std::string::npos) << solid.err;
  const Json surface = json(std::string(kRoom) + "! mesh --label 1 ! measure --json");
  EXPECT_EQ(surface["closed_manifold"], true);
  expectRefusal(std::string(kSquare) + "! extract 1", 3, "has no region 1");
  expectRefusal(std::string(kSquare) + "! mesh --label 1", 3, "has no region 1");
}

TEST_F(SegmentSheetsActions, AreAskedFor) {
  expectRefusal("read square.obj ! segment --voxel 0.1", 3, "keep such sheets with --sheets");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! segment --sheets", 2, "--sheets is for a mesh");
  const support::Outcome outcome = levelsmith(std::string(kSquare) + "! info");
  EXPECT_NE(outcome.err.find("sheets lie inside region 0; 0 is the void"), std::string::npos)
      << outcome.err;
}

TEST_F(SegmentSheetsActions, NameSheetsThatAreTooClose) {
  writeFile("two.obj",
            "v 0 0 0.03\nv 2 0 0.03\nv 2 2 0.03\nv 0 2 0.03\nv 0 0 0.07\nv 2 0 0.07\nv 2 2 0.07\n"
            "v 0 2 0.07\nf 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n");
  const support::Outcome outcome =
      levelsmith("--report r.json read two.obj ! segment --sheets --voxel 0.1 ! info");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("less than a voxel apart"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("0.04 at"), std::string::npos) << outcome.err;
  const Json certificate =
      Json::parse(support::slurp(folder_ / "r.json"))["steps"][1]["certificate"];
  EXPECT_EQ(certificate["sheets"], Json::array({0}));
  EXPECT_EQ(certificate["rim_edges"], 8);
  ASSERT_EQ(certificate["thin"].size(), 1u);
  EXPECT_NEAR(certificate["thin"][0]["thickness"].get<double>(), 0.04, 1e-6);
  EXPECT_NEAR(certificate["thin"][0]["position"][2].get<double>(), 0.05, 0.02);
}

}  // namespace segment_sheets_actions_test
