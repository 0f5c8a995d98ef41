// The action deform on the command line: level sets, meshes, point clouds, lattice files, refusals.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tests/support/action_test.h"
#include "tests/support/files.h"

namespace deform_action_test {

using Json = nlohmann::json;

class DeformAction : public support::ActionTest {
 protected:
  /// Writes a lattice of degree 1 around [-2, 2]³ whose control points have x scaled by `scale`.
  void writeLattice(const std::string& name, double scale) {
    Json json = {{"format", "levelsmith lattice"},
                 {"version", 1},
                 {"degree", {1, 1, 1}},
                 {"count", {2, 2, 2}},
                 {"min", {-2, -2, -2}},
                 {"max", {2, 2, 2}}};
    for (const double x : {-2.0, 2.0})
      for (const double y : {-2.0, 2.0})
        for (const double z : {-2.0, 2.0}) json["points"].push_back({scale * x, y, z});
    writeFile(name, json.dump());
  }

  /// Details of the step `deform` in report.json.
  [[nodiscard]] Json reportedDetails() const {
    const Json report = Json::parse(support::readText(folder_ / "report.json"));
    Json details;
    for (const Json& step : report["steps"])
      if (step["action"] == "deform") details = step["details"];
    return details;
  }
};

constexpr const char* kCapsule = "capsule --from 0,0,-1.5 --to 0,0,1.5 --radius 0.5 --voxel 0.1 ! ";
constexpr double kVolume = std::numbers::pi * (0.75 + 0.5 / 3);

TEST_F(DeformAction, BendsAndTwistsKeepTheVolume) {
  const Json bent =
      json(std::string(kCapsule) + "deform --bend 80 --towards 1,0,0 ! measure --json");
  EXPECT_NEAR(bent["volume"].get<double>() / kVolume, 1, 1e-3);
  // The box is 4.4 long, so lines along the axis become arcs about a line at x = 3.15.
  EXPECT_NEAR(bent["bounds"]["max"][2].get<double>(), 1.958, 0.01);
  EXPECT_NEAR(bent["bounds"]["max"][0].get<double>(), 0.842, 0.01);
  EXPECT_NEAR(bent["bounds"]["min"][0].get<double>(), -0.5, 0.01);
  const Json twisted = json(std::string(kCapsule) + "deform --twist 80 ! measure --json");
  EXPECT_NEAR(twisted["volume"].get<double>() / kVolume, 1, 1e-3);
}

TEST_F(DeformAction, StretchesAndTapers) {
  const Json stretched =
      json("sphere --radius 1 --voxel 0.1 ! deform --stretch 2 --axis 1,0,0 ! measure --json");
  EXPECT_NEAR(stretched["volume"].get<double>() / (8 * std::numbers::pi / 3), 1, 1e-3);
  EXPECT_NEAR(stretched["bounds"]["max"][0].get<double>(), 2, 0.01);
  EXPECT_NEAR(stretched["bounds"]["max"][1].get<double>(), 1, 0.01);
  // The integral of a linear scale squared, from 1 to 1/2: 7/12. The box reaches two voxels beyond.
  const Json tapered =
      json("box --size 1,1,4 --voxel 0.05 ! mesh --sharp ! deform --taper 0.5 ! measure --json");
  EXPECT_NEAR(tapered["volume"].get<double>(), 4 * 7 / 12.0, 0.01);
}

TEST_F(DeformAction, TakesMeshesAndPoints) {
  const Json mesh = json(
      "box --size 1,1,4 --voxel 0.1 ! mesh --sharp ! deform --bend 60 --tolerance 0.001 ! measure "
      "--json");
  EXPECT_NEAR(mesh["volume"].get<double>(), 4, 0.02);
  const Json points = json(
      "sphere --radius 1 --voxel 0.1 ! mesh ! sample --spacing 0.2 ! deform --stretch 3 ! info "
      "--json");
  EXPECT_EQ(points["kind"], "point cloud");
  EXPECT_NEAR(points["bounds"]["max"][2].get<double>(), 3, 0.05);
}

TEST_F(DeformAction, ReadsLatticeFiles) {
  writeLattice("wide.json", 1.5);
  const Json wide =
      json("sphere --radius 1 --voxel 0.1 ! deform --lattice wide.json ! measure --json");
  EXPECT_NEAR(wide["bounds"]["max"][0].get<double>(), 1.5, 0.01);
  // The identity keeps every bit.
  writeLattice("same.json", 1);
  const Json same = json(
      "sphere --radius 1 --voxel 0.1 --as a ! deform --lattice same.json --as b ! compare @a @b "
      "--json");
  EXPECT_EQ(same, json("sphere --radius 1 --voxel 0.1 --as a ! compare @a @a --json"));
  writeLattice("fold.json", -1);
  expectRefusal("sphere --radius 1 --voxel 0.1 ! deform --lattice fold.json", 3, "folds");
  writeFile("broken.json", "{\"format\": \"levelsmith lattice\"");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! deform --lattice broken.json", 3, "truncated");
  expectRefusal("sphere --radius 1 --voxel 0.1 ! deform --lattice none.json", 6, "none.json");
}

TEST_F(DeformAction, MovesByCages) {
  const auto writeCage = [&](const std::string& name, double scale) {
    std::string text = "OFF\n8 12 0\n";
    for (const double z : {-3.0, 3.0})
      for (const double y : {-3.0, 3.0})
        for (const double x : {-3.0, 3.0})
          text +=
              std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(scale * z) + "\n";
    for (const char* t : {"0 2 1", "1 2 3", "4 5 6", "5 7 6", "0 1 4", "1 5 4", "2 6 3", "3 6 7",
                          "0 4 2", "2 4 6", "1 3 5", "3 7 5"})
      text += std::string("3 ") + t + "\n";
    writeFile(name, text);
  };
  writeCage("rest.off", 1);
  writeCage("long.off", 1.5);
  writeCage("turned.off", -0.5);
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! ";
  const Json bounds =
      json(ball + "deform --cage rest.off --to long.off ! measure --json")["bounds"]["max"];
  EXPECT_NEAR(bounds[2].get<double>(), 1.5, 0.01);
  EXPECT_NEAR(bounds[0].get<double>(), 1, 0.01);
  const Json mesh = json(
      ball + "mesh ! deform --cage rest.off --to long.off --coordinates green ! measure --json");
  EXPECT_GT(mesh["bounds"]["max"][2].get<double>(), 1.2);
  expectRefusal(ball + "deform --cage rest.off --to turned.off", 3, "the cage folds");
  expectRefusal(ball + "deform --cage rest.off", 2, "--to is missing");
  expectRefusal(ball + "deform --bend 10 --to long.off", 2, "--to is for --cage");
  expectRefusal(ball + "deform --bend 10 --coordinates green", 2, "--coordinates is for --cage");
  expectRefusal("sphere --radius 3.2 --voxel 0.2 ! deform --cage rest.off --to long.off", 3,
                "leaves it near");
}

TEST_F(DeformAction, Untangles) {
  const std::string chain = "sphere --radius 1 --voxel 0.1 ! deform --bend 170";
  expectRefusal(chain, 3, "folds");
  const support::Outcome run =
      levelsmith("--report report.json " + chain + " --untangle ! measure");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json details = reportedDetails();
  EXPECT_EQ(details["certificate"]["verdict"], "certified");
  EXPECT_GT(details["untangle"]["largest_move"].get<double>(), 0);
}

TEST_F(DeformAction, PlansAndReports) {
  const support::Outcome plan =
      levelsmith("--dry-run " + std::string(kCapsule) + "deform --bend 80 ! measure");
  EXPECT_EQ(plan.code, 0) << plan.err;
  EXPECT_SAYS(plan.out + plan.err, "deform");
  const support::Outcome run =
      levelsmith("--report report.json " + std::string(kCapsule) + "deform --twist 90 ! measure");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json details = reportedDetails();
  EXPECT_EQ(details["certificate"]["verdict"], "certified");
  EXPECT_FALSE(details["certificate"]["overlaps"].get<bool>());
  EXPECT_NEAR(details["certificate"]["least_jacobian_high"].get<double>(), 1, 1e-6);
  EXPECT_GT(details["certificate"]["least_jacobian_low"].get<double>(), 0.989);
  EXPECT_LT(details["lattice_error"].get<double>(), 1e-7);
}

TEST_F(DeformAction, RefusesFoldsAndOptionsThatExcludeEachOther) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! ";
  expectRefusal(ball + "deform --bend 170", 3, "folds");
  expectRefusal("box --size 0.5,0.5,10 --voxel 0.1 ! deform --bend 400", 3, "overlaps itself");
  expectRefusal(ball + "deform", 2, "--bend, --twist, --taper, --stretch, --lattice or --cage");
  expectRefusal(ball + "deform --bend 10 --twist 10", 2, "exclude each other");
  expectRefusal(ball + "deform --twist 10 --towards 1,0,0", 2, "--towards is for --bend");
  expectRefusal(ball + "deform --bend 10 --towards 0,0,1", 2, "parallel to the axis");
  expectRefusal(ball + "deform --twist 10 --axis 0,0,0", 2, "no direction");
  expectRefusal(ball + "deform --taper -1", 2, "taper");
  expectRefusal(ball + "deform --twist 10 --tolerance 0.1", 2, "--tolerance is for meshes");
  expectRefusal(ball + "mesh ! deform --twist 10 --voxel 0.1", 2, "--voxel is for level sets");
  expectRefusal(ball + "deform --lattice a.json --axis 1,0,0", 2, "--axis does not apply");
}

}  // namespace deform_action_test
