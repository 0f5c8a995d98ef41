// Textures that are kept once and mapped when a picture is drawn, beside merged solids.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "render/images/image.h"
#include "tests/support/command_line.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/picture_agreement.h"

namespace instances_test {

using nlohmann::json;

const std::string kRings =
    "sphere --radius 10 --voxel 0.2 --as ball ! scatter @ball --count 12 --size 5,4 --height 2 "
    "--layers 3 --spacing 0.5 --seed 2 --as places ! torus --radius 2 --tube 0.7 --voxel 0.15 "
    "--as ring ! texture @ball @ring @places --map shell ";
/// Three coarse rings, for pictures and refusals that do not depend on the shape.
const std::string kCoarseRings =
    "sphere --radius 10 --voxel 0.6 --as ball ! scatter @ball --count 3 --size 5,4 --height 2 "
    "--layers 2 --spacing 1 --seed 2 --as places ! torus --radius 2 --tube 0.7 --voxel 0.3 "
    "--as ring ! texture @ball @ring @places --map shell ";
const std::string kView = " --size 320x240 --from 30,18,24 --to 0,0,0 --samples 1 --style mean ";

class Instances : public support::ShellTest {
 protected:
  support::DepthAgreement compare(const std::string& a, const std::string& b, double voxel) {
    return support::compareDepths(render::readExr(folder_ / a), render::readExr(folder_ / b),
                                  3 * voxel);
  }
};

TEST_F(Instances, HaveThePictureOfTheMergedSolid) {
  const auto merged = levelsmith(kRings + "--voxel 0.1 ! render merged.exr" + kView);
  ASSERT_EQ(merged.code, 0) << merged.err;
  const auto mapped = levelsmith("--report r.json " + kRings + "--instances ! render mapped.exr" +
                                 kView + "! info --json");
  ASSERT_EQ(mapped.code, 0) << mapped.err;
  const double voxel = 0.1;
  const support::DepthAgreement found = compare("merged.exr", "mapped.exr", voxel);
  EXPECT_GT(found.compared, 15000u);
  EXPECT_LE(found.unlike, 27u);  // measured: 9
  EXPECT_LT(found.p999 / voxel, support::measured(0.33));
  EXPECT_LT(found.largest / voxel, support::measured(0.77, 1));
  const json scene = json::parse(mapped.out);
  EXPECT_EQ(scene["solids"].size(), 1u);
  ASSERT_EQ(scene["mapped"].size(), 1u);
  EXPECT_EQ(scene["mapped"][0]["shells"], 12);
  const std::string report = support::slurp(folder_ / "r.json");
  EXPECT_NE(report.find("\"shell_bytes\""), std::string::npos);
}

TEST_F(Instances, OfClippedTilesHaveThePictureOfTheMergedSolid) {
  // Half a bar along u in each tile: ribs around the cylinder, which continue from tile to tile.
  const std::string ribs =
      "cylinder --radius 5 --height 6 --voxel 0.2 --as grip ! patch-grid @grip --count 6,2 "
      "--around '0,0,-2 0,0,2' --height 0.8 --layers 3 --as p ! cylinder --radius 0.6 --height 4 "
      "--axis 1,0,0 --voxel 0.06 --as rib ! texture @grip @rib @p --map shell --texture-box "
      "'-1,-1,0 1,1,0.6' ";
  const std::string view = " --size 240x180 --from 18,11,14 --to 0,0,0 --samples 1 --style mean ";
  const auto merged = levelsmith(ribs + "--voxel 0.1 ! render merged.exr" + view);
  ASSERT_EQ(merged.code, 0) << merged.err;
  const auto mapped = levelsmith(ribs + "--instances ! render mapped.exr" + view + "! info --json");
  ASSERT_EQ(mapped.code, 0) << mapped.err;
  // The two rows of tiles have different shared sides, so there are two clipped copies.
  const json scene = json::parse(mapped.out);
  ASSERT_EQ(scene["mapped"].size(), 2u);
  EXPECT_EQ(scene["mapped"][0]["shells"], 6);
  const double voxel = 0.1;
  const support::DepthAgreement found = compare("merged.exr", "mapped.exr", voxel);
  EXPECT_GT(found.compared, 5000u);
  EXPECT_LE(found.unlike, 50u);  // measured: 25
  EXPECT_LT(found.p999 / voxel, support::measured(0.3));
  EXPECT_LT(found.largest / voxel, support::measured(0.35));
}

TEST_F(Instances, AreDrawnAlone) {
  const auto drawn =
      levelsmith(kCoarseRings + "--instances --alone ! render a.png --size 64x48 ! info --json");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_TRUE(json::parse(drawn.out)["solids"].empty());
}

TEST_F(Instances, AreRefusedWithAReason) {
  const auto refuses = [&](const std::string& chain, const std::string& why) {
    const auto outcome = levelsmith(chain);
    EXPECT_EQ(outcome.code, 2) << chain;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
  };
  std::string rbf = kCoarseRings;
  rbf.replace(rbf.find("--map shell"), 11, "--map rbf");
  refuses(rbf + "--instances ! render a.png", "--map shell");
  refuses(kCoarseRings + "--instances --blend 0.3 ! render a.png", "--blend");
  refuses(kCoarseRings + "--instances --carve ! render a.png", "--carve");
  refuses(kCoarseRings + "--instances ! write a.json", "scene file");
  for (const std::string renderer : {"embree", "both"}) {
    refuses(kCoarseRings + "--instances ! render a.png --renderer " + renderer, "cpu or gpu");
    EXPECT_FALSE(exists("a.png"));
  }
  refuses(kCoarseRings + "--instances ! render a.exr --thickness", "thickness");
  refuses(kCoarseRings + "--instances ! render a.exr --filter bspline", "trilinear");
  refuses(kCoarseRings + "--instances ! mesh", "scene");
}

}  // namespace instances_test
