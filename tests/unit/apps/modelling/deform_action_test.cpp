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
  expectRefusal(ball + "deform", 2, "needs 2 operands but has 1");
  expectRefusal(ball + "deform --bend 10 --twist 10", 2, "exclude each other");
  expectRefusal(ball + "deform --twist 10 --towards 1,0,0", 2, "--towards is for --bend");
  expectRefusal(ball + "deform --bend 10 --towards 0,0,1", 2, "parallel to the axis");
  expectRefusal(ball + "deform --twist 10 --axis 0,0,0", 2, "no direction");
  expectRefusal(ball + "deform --taper -1", 2, "taper");
  expectRefusal(ball + "deform --twist 10 --tolerance 0.1", 2, "--tolerance is for meshes");
  expectRefusal(ball + "mesh ! deform --twist 10 --voxel 0.1", 2, "--voxel is for level sets");
  expectRefusal(ball + "deform --lattice a.json --axis 1,0,0", 2, "--axis does not apply");
}

// === Deformations as values

TEST_F(DeformAction, ALatticeIsAValue) {
  const std::string lattice = "lattice --bend 80 --towards 1,0,0 --box '-1,-1,-2.2 1,1,2.2' --as l";
  // The same bits as by the file of the lattice, for each kind of operand.
  const Json written = json(lattice + " ! write bent.lattice.json ! info --json");
  EXPECT_EQ(written["kind"], "deformation");
  EXPECT_EQ(written["form"], "lattice");
  EXPECT_FALSE(written["identity"].get<bool>());
  EXPECT_NEAR(written["origin"][2].get<double>(), -2.2, 1e-8);
  for (const std::string operand : {"", "mesh ! ", "mesh ! sample --spacing 0.3 ! "}) {
    const std::string chain = std::string(kCapsule) + operand;
    const Json byFile = json(chain + "deform --lattice bent.lattice.json ! info --json"),
               byValue = json(lattice + " ! " + chain + "deform @l ! info --json"),
               byStack = json(chain + "read bent.lattice.json ! deform ! info --json");
    EXPECT_EQ(byFile, byValue);
    EXPECT_EQ(byFile, byStack);
  }
  // One lattice moves several operands.
  const Json both = json(lattice + " ! " + kCapsule +
                         "deform @l --as a ! sphere --radius 0.4 --voxel 0.1 ! deform @l --as b ! "
                         "union @a @b ! measure --json");
  EXPECT_NEAR(both["volume"].get<double>() / kVolume, 1, 1e-2);
}

TEST_F(DeformAction, ALatticeAroundAnOperandIsThatOfDeform) {
  const std::string bar = "box --size 1,1,4 --voxel 0.1 --as bar ! ";
  EXPECT_EQ(json(bar + "lattice --twist 50 --as l ! deform @bar @l ! info --json"),
            json(bar + "deform --twist 50 ! info --json"));
  EXPECT_EQ(json(bar + "mesh --as m ! lattice @m --taper 0.5 --as l ! deform @m @l ! info --json"),
            json(bar + "mesh ! deform --taper 0.5 ! info --json"));
}

TEST_F(DeformAction, ALatticeOfCountsMovesNothing) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 --as ball ! ";
  const Json made =
      json(ball + "lattice --count 4,5,6 --degree 3,2,5 ! write rest.json ! info --json");
  EXPECT_EQ(made["count"], Json({4, 5, 6}));
  EXPECT_EQ(made["degree"], Json({3, 2, 5}));
  EXPECT_TRUE(made["identity"].get<bool>());
  EXPECT_EQ(json(ball + "read rest.json --as l ! deform @ball @l ! info --json"),
            json(ball + "info --json"));
  EXPECT_EQ(json("lattice --count 2 --box '0,0,0 1,1,1' ! info --json")["degree"], Json({1, 1, 1}));
}

TEST_F(DeformAction, ACageIsAValue) {
  const std::string cage =
      "box --size 6.5,6.5,6.5 --voxel 2 ! mesh --as rest ! deform --stretch 1.5 --tolerance 0 --as "
      "moved "
      "! write moved.ply ! cage @rest @moved --as c ! ";
  EXPECT_EQ(json(cage + "info --json")["form"], "cage");
  const std::string ball = "sphere --radius 1 --voxel 0.2 ! mesh ! ";
  const Json moved = json(cage + ball + "deform @c ! measure --json");
  EXPECT_NEAR(moved["bounds"]["max"][2].get<double>(), 1.5, 0.01);
  EXPECT_NEAR(moved["bounds"]["max"][0].get<double>(), 1, 0.01);
  expectRefusal(cage + "write c.json", 2, "has no file of its own");
}

TEST_F(DeformAction, UntanglesValues) {
  const std::string lattice = "lattice --bend 170 --box '-1.2,-1.2,-1.2 1.2,1.2,1.2' ";
  const std::string ball = "! sphere --radius 1 --voxel 0.2 ! ";
  EXPECT_EQ(levelsmith(lattice + "--as l " + ball + "mesh ! deform @l --untangle ! measure").code,
            0);
  EXPECT_EQ(levelsmith(lattice + "--untangle --as l " + ball + "mesh ! deform @l ! info").code, 0);
}

TEST_F(DeformAction, RefusesWrongValues) {
  const std::string lattice = "lattice --twist 9 --box '-2,-2,-2 2,2,2' --as l ! ";
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! ";
  expectRefusal(lattice + ball + "deform @l --twist 10", 2, "operand 1 is a deformation");
  expectRefusal(ball + "lattice --twist 9 --as l ! deform @l @l --twist 9", 2, "takes 1 operand");
  expectRefusal(lattice + ball + "deform @l --axis 1,0,0", 2, "given as a value");
  expectRefusal(lattice + "mesh @l", 2, "a deformation");
  expectRefusal(lattice + "measure @l", 2, "'deform' moves other values by it");
  expectRefusal(lattice + "write l.vdb", 2, "write .json");
  expectRefusal("sphere --radius 3 --voxel 0.2 --as b ! " + lattice + "deform @b @l", 3,
                "outside the box of the lattice");
  expectRefusal(ball + "mesh ! deform @l", 2, "no result is named");
  expectRefusal("lattice --twist 9", 2, "needs 1 operand but has 0");
  expectRefusal("lattice --twist 9", 2, "or give --box");
  expectRefusal(ball + "lattice", 2, "--bend, --twist, --taper, --stretch or --count");
  expectRefusal(ball + "lattice --twist 9 --degree 3", 2, "--degree is for --count");
  expectRefusal(ball + "lattice --count 3 --degree 3", 3, "degree");
  expectRefusal(ball + "lattice --count 2.5", 2, "not an integer");
  expectRefusal(ball + "lattice --count 1000", 4, "control points");
  expectRefusal(ball + "lattice --count 4 --degree 21", 2, "from 1 to 20");
  expectRefusal("read none.lattice.json ! info", 6, "none.lattice.json");
}

/// A patch with a texture above a capsule, and the deformed capsule below the deformed patch.
TEST_F(DeformAction, MovesPatches) {
  const std::string patch =
      std::string(kCapsule) +
      "patch --at 0.5,0,0 --size 0.4,0.6 --height 0.2 --layers 3 --as tile ! write tile.patch ! ";
  const Json before = json(patch + "info --json");
  const Json after = json(patch +
                          "lattice --twist 40 --box '-1,-1,-2 1,1,2' --as l ! deform "
                          "@tile @l ! write moved.patch ! info --json");
  EXPECT_EQ(before["kind"], "patch");
  EXPECT_EQ(after["kind"], "patch");
  EXPECT_NE(before["bounds"], after["bounds"]);
  const std::string values = patch +
                             "lattice --bend 50 --towards 1,0,0 --box '-1,-1,-2.2 1,1,2.2' "
                             "--as l ! " +
                             kCapsule + "deform @l --as base ! ";
  const support::Outcome snapped =
      levelsmith("--report report.json " + values + "deform @tile @l --onto @base ! write b.patch");
  ASSERT_EQ(snapped.code, 0) << snapped.err;
  const Json details = reportedDetails();
  EXPECT_GT(details["largest_snap"].get<double>(), 0);
  EXPECT_LT(details["largest_snap"].get<double>(), 2e-4);
  expectRefusal(patch +
                    "lattice --bend 50 --box '-1,-1,-2.2 1,1,2.2' --as l ! sphere --radius 1 "
                    "--voxel 0.1 --as other ! deform @tile @l --onto @other ! info",
                3, "further than a voxel");
  expectRefusal(std::string(kCapsule) + "deform --twist 9 --onto @x", 2, "no result is named '@x'");
  expectRefusal("sphere --radius 1 --voxel 0.1 --as c ! deform @c --twist 9 --onto @c", 2,
                "--onto is for patches");
}

}  // namespace deform_action_test
