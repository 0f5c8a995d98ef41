#include <Imath/ImathVec.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace animate_test {

using Json = nlohmann::json;

/// A ball, a ring and two patches, all with one voxel size.
const std::string kScene =
    "sphere --radius 5 --voxel 0.5 --as ball ! torus --radius 2 --tube 0.8 --voxel 0.5 --as ring "
    "! patch @ball --at 0,0,5 --size 4,4 --height 1.5 --levels 2 --spacing 1 --particles "
    "conforming --as here "
    "! patch @ball --at 5,0,0 --size 3,3 --rotate -90 --height 1 --levels 2 --spacing 1 "
    "--particles conforming "
    "--as there ! ";

class Animate : public support::ShellTest {
 protected:
  Json reportOf(const std::string& chain) {
    const auto outcome = levelsmith("--quiet --report run.json " + chain);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Json report = Json::parse(support::slurp(folder_ / "run.json"), nullptr, false);
    return report["steps"].back()["details"];
  }
  std::string bytes(const std::string& file) { return support::slurp(folder_ / file); }
};

/// Middle of the patch in a frame, on a ball of that radius.
Imath::V3d middleOf(const Json& details, std::size_t frame, double radius = 5) {
  Imath::V3d sum(0);
  for (const Json& corner : details["frame"][frame]["corners"]) {
    const Imath::V3d c(corner[0].get<double>(), corner[1].get<double>(), corner[2].get<double>());
    EXPECT_NEAR(c.length(), radius, support::measured(1.69e-4));
    sum += c;
  }
  return sum.normalized() * radius;
}

/// A closed tent with normals along z and a colour, as PLY.
std::string tent(int red) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
      "float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar "
      "red\nproperty uchar green\nproperty uchar blue\nelement face 4\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  for (const char* vertex : {"0 0 0", "1 0 0", "0 1 0", "0.3 0.3 1"})
    text += std::string(vertex) + " 0 0 1 " + std::to_string(red) + " 9 9\n";
  return text + "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
}

std::size_t countOf(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

TEST_F(Animate, BeginsAndEndsAsTheTextureOnItsPatches) {
  const Json details =
      reportOf(kScene +
               "texture @ball @ring @here --voxel 0.5 ! write first.vdb "
               "! texture @ball @ring @there --voxel 0.5 ! write last.vdb "
               "! animate @ball @ring @here @there --frames 3 --voxel 0.5 --out f_#.vdb");
  EXPECT_EQ(bytes("f_0.vdb"), bytes("first.vdb"));
  EXPECT_EQ(bytes("f_2.vdb"), bytes("last.vdb"));
  EXPECT_NE(bytes("f_1.vdb"), bytes("f_0.vdb"));
  EXPECT_EQ(details["frames"], 3);
  EXPECT_EQ(details["reused"], 0);
  EXPECT_EQ(details["patches_made"], 1);
  // Half way along the great circle between the two corners.
  EXPECT_NEAR(details["frame"][1]["corners"][0][1].get<double>(), -2.36,
              support::measured(0.00388));
}

TEST_F(Animate, MovesThePatchOnBasesFromFiles) {
  ASSERT_EQ(levelsmith("sphere --radius 5.2 --voxel 0.5 ! write base_01.vdb ! write base_02.vdb "
                       "! sphere --radius 5.4 --voxel 0.5 ! write base_03.vdb")
                .code,
            0);
  for (const std::string rule : {"corners", "rigid"}) {
    const Json details = reportOf(
        kScene + "animate @ball @ring @here --frames 4 --base-frames base_##.vdb --carry " + rule +
        " --voxel 0.5 --out " + rule + "_#.ply");
    EXPECT_EQ(details["reused"], 1) << "base 2 equals base 1";
    EXPECT_EQ(details["patches_made"], 2);
    EXPECT_EQ(bytes(rule + "_1.ply"), bytes(rule + "_2.ply"));
    EXPECT_NE(bytes(rule + "_2.ply"), bytes(rule + "_3.ply"));
    EXPECT_NEAR(details["frame"][3]["drift"][1].get<double>(), rule == "rigid" ? 1 : 5.4 / 5,
                support::measured(0.0078, 0.01));
  }
  // Both options together: the other patch is on the last base.
  const Json both =
      reportOf(kScene +
               "read base_03.vdb --as last ! patch @last --at 5.4,0,0 --size 3,3 --rotate -90 "
               "--height 1 --levels 2 --spacing 1 --particles conforming --as goal "
               "! texture @last @ring @goal --voxel 0.5 ! write goal.vdb "
               "! animate @ball @ring @here @goal --frames 4 --base-frames base_##.vdb --voxel 0.5 "
               "--out both_#.vdb");
  EXPECT_EQ(both["patches_made"], 2);
  EXPECT_EQ(bytes("both_3.vdb"), bytes("goal.vdb"));
}

TEST_F(Animate, PlaysTexturesAndReusesUnchangedFrames) {
  ASSERT_EQ(levelsmith("torus --radius 2 --tube 0.8 --voxel 0.5 ! write ring_1.vdb "
                       "! torus --radius 2 --tube 0.6 --voxel 0.5 ! write ring_2.vdb")
                .code,
            0);
  const Json details =
      reportOf(kScene +
               "animate @ball @ring @here --frames 3 --texture-frames ring_#.vdb --voxel 0.5 --out "
               "f_#.vdb");
  EXPECT_EQ(details["reused"], 1);
  EXPECT_EQ(details["patches_made"], 0);
  EXPECT_EQ(bytes("f_0.vdb"), bytes("f_1.vdb"));
  EXPECT_NE(bytes("f_2.vdb"), bytes("f_1.vdb"));
}

TEST_F(Animate, MovesMeshesDecalsGridsAndPatchesFromFiles) {
  const std::string tail = " --frames 3 --voxel 0.5 --out f_#.vdb";
  // Half way from the pole to the equator, to a quarter of a voxel, because corners move apart on a
  // ball.
  const Imath::V3d between = Imath::V3d(1, 0, 1).normalized() * 5;
  const Json mesh =
      reportOf(kScene +
               "mesh @ring --as m ! animate @ball @m @here @there --map mesh --frames 3 --out "
               "m_#.ply");
  EXPECT_NE(bytes("m_0.ply"), bytes("m_1.ply"));
  EXPECT_LT((middleOf(mesh, 1) - between).length(), support::measured(0.106, 0.125));
  const Json decals = reportOf(kScene +
                               "decal @ball --at 0,0,5 --direction 1,0,0 --radius 2 --height 1 "
                               "--levels 2 --spacing 1 --as d ! decal "
                               "@ball --at 5,0,0 --direction 0,1,0 --radius 1.5 --height 1 "
                               "--levels 2 --spacing 1 --as e ! animate "
                               "@ball "
                               "@ring @d @e" +
                               tail);
  EXPECT_EQ(decals["patches_made"], 1);
  EXPECT_LT((middleOf(decals, 1) - between).length(), support::measured(6.15e-12));
  EXPECT_REFUSED(levelsmith(kScene +
                            "decal @ball --at 0,0,5 --direction 1,0,0 --radius 2 --height "
                            "1 --as d ! animate @ball @ring @d --carry corners" +
                            tail),
                 2, "leave --carry out");
  const Json tiles =
      reportOf(kScene +
               "patch-grid @ball --count 2,1 --at 0,0,5 --size 4,2 --height 1 "
               "--levels 2 --spacing 1 --as g ! patch-grid "
               "@ball --count 2,1 --at 0.5,0,5 --size 4,2 --height 1 --levels 2 --spacing 1 "
               "--as h ! animate @ball @ring "
               "@g @h" +
               tail);
  EXPECT_EQ(tiles["patches_made"], 1);
  EXPECT_NEAR(middleOf(tiles, 1).x, 0.25, support::measured(9.32e-4));
  EXPECT_NEAR(middleOf(tiles, 1).y, 0, support::measured(1.14e-9));
  ASSERT_EQ(levelsmith(kScene + "write @here here.patch ! write @there there.patch").code, 0);
  const auto outcome = levelsmith(
      "--report run.json " + kScene +
      "read here.patch --as p ! read there.patch --as q ! animate @ball @ring @p @q" + tail);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json files = Json::parse(bytes("run.json"))["steps"].back()["details"];
  EXPECT_LT((middleOf(files, 1) - between).length(), support::measured(0.106, 0.125));
  EXPECT_NE(outcome.err.find("does not record how the patch was built"), std::string::npos)
      << outcome.err;
}

TEST_F(Animate, ComparesAndKeepsMeshAttributes) {
  writeFile("t_0.ply", tent(200));
  writeFile("t_1.ply", tent(100));
  writeFile("t_2.ply", tent(100));
  const std::string chain = kScene +
                            "read t_0.ply --as t ! animate @ball @t @here --map mesh --frames 3 "
                            "--texture-frames t_#.ply --out ";
  const Json details = reportOf(chain + "f_#.ply");
  EXPECT_EQ(details["reused"], 1);
  EXPECT_NE(bytes("f_0.ply"), bytes("f_1.ply"));
  EXPECT_EQ(bytes("f_1.ply"), bytes("f_2.ply"));
  const auto outcome = levelsmith(chain + "f_#.stl");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(countOf("the normals and colours were left out", outcome.err), 1u) << outcome.err;
  EXPECT_NE(outcome.err.find("f_0.stl and the files of later frames"), std::string::npos)
      << outcome.err;
}

TEST_F(Animate, HoldsTheLastPatchAndPlaysOneFrame) {
  const Json details =
      reportOf(kScene +
               "texture @ball @ring @there --voxel 0.5 ! write last.vdb "
               "! animate @ball @ring @here @there --frames 4 --key-frames 0,2 --voxel 0.5 "
               "--out f_#.vdb ! animate @ball @ring @here --frames 1 --voxel 0.5 --out g_#.vdb");
  EXPECT_EQ(details["frames"], 1);
  EXPECT_EQ(bytes("f_2.vdb"), bytes("last.vdb"));
  EXPECT_EQ(bytes("f_3.vdb"), bytes("last.vdb"));
  EXPECT_EQ(bytes("g_0.vdb"), bytes("f_0.vdb"));
  // To the end of the file sequence.
  reportOf(
      kScene +
      "animate @ball @ring @here @there --frames 3 --key-frames 0,2 --voxel 0.5 --out h_#.vdb");
  EXPECT_EQ(bytes("h_2.vdb"), bytes("last.vdb"));
}

TEST_F(Animate, RefusesPatchesBuiltDifferently) {
  const auto refusal = [&](const std::string& other) {
    return levelsmith(kScene + other +
                      " --as x ! animate @ball @ring @here @x --frames 3 --out "
                      "f_#.vdb");
  };
  const std::string patch = "patch @ball --at 5,0,0 --size 3,3 --height 1 --levels 2 --spacing 1 ";
  EXPECT_REFUSED(refusal(patch + "--particles conforming --twist 90"), 2,
                 "patch 2 and the first patch differ in --twist");
  EXPECT_REFUSED(refusal("decal @ball --at 5,0,0 --direction 0,1,0 --radius 1 --height 1 --levels "
                         "2 --spacing 1"),
                 2, "patch 2 was built by 'decal' and the first patch by 'patch'");
  EXPECT_REFUSED(
      refusal(
          "patch @ball --corners \"5,-1,-1 5,-1,1 5,1,1 5,1,-1\" --mirror --height 1 --levels 2 "
          "--spacing 1 --particles conforming"),
      2, "either patch 2 or the first patch is mirrored");
  EXPECT_EQ(fileCount(), 0u);
  // A patch that is only finer is reported.
  const auto outcome = refusal(patch + "--particles reduced");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("patch 2 and the first patch differ in --particles"),
            std::string::npos)
      << outcome.err;
}

TEST_F(Animate, ReportsMissingFrames) {
  ASSERT_EQ(levelsmith("sphere --radius 5 --voxel 0.5 ! write base_1.vdb").code, 0);
  openvdb::initialize();
  openvdb::io::File file((folder_ / "base_1.vdb").string());
  file.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("surface"));
  file.close();
  grid->tree().addTile(1, openvdb::Coord(800, 0, 0), -0.25f, true);
  openvdb::io::File((folder_ / "base_1.vdb").string()).write({grid});
  std::filesystem::copy_file(folder_ / "base_1.vdb", folder_ / "base_2.vdb");
  // Bases are read twice: on the way back from the goal, and for their frame.
  const auto outcome = levelsmith(kScene +
                                  "animate @ball @ring @here @here --frames 3 --base-frames "
                                  "base_#.vdb --voxel 0.5 --out f_#.vdb");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(countOf("frame 1: 1 active tiles of base_1.vdb", outcome.err), 1u) << outcome.err;
}

TEST_F(Animate, TakesNumbersFromTheFileNameOnly) {
  std::filesystem::create_directory(folder_ / "take#1");
  reportOf(kScene + "animate @ball @ring @here --frames 2 --voxel 0.5 --out take#1/f_##.vdb");
  EXPECT_TRUE(exists("take#1/f_01.vdb"));
  EXPECT_REFUSED(levelsmith(kScene + "animate @ball @ring @here --frames 2 --out take#1/f.vdb"), 2,
                 "write # for the number");
}

TEST_F(Animate, RefusesBeforeTheComputation) {
  const std::string head = kScene + "animate @ball @ring @here ";
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --out frame.vdb"), 2, "write # for the number");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --out f_#.txt"), 2, "is not a sequence of files");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --out no/where_#.vdb"), 6, "where_0.vdb");
  EXPECT_REFUSED(levelsmith(head + "--frames 0 --out f_#.vdb"), 2, "--frames");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --base-frames b.vdb --out f_#.vdb"), 2,
                 "--base-frames");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --base-first 2 --out f_#.vdb"), 2,
                 "needs --base-frames");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --base-frames f_#.vdb --out f_#.vdb"), 2,
                 "would write over 'f_1.vdb'");
  std::filesystem::create_directory_symlink(".", folder_ / "link");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --base-frames link/f_#.vdb --out f_#.vdb"), 2,
                 "would write over 'f_1.vdb'");
  std::filesystem::remove(folder_ / "link");
  EXPECT_REFUSED(levelsmith(head + "@there --frames 1 --out f_#.vdb"), 2, "do not fit 1 frames");
  EXPECT_REFUSED(levelsmith(head + "@there --frames 5 --key-frames 0,x --out f_#.vdb"), 2,
                 "--key-frames");
  EXPECT_REFUSED(levelsmith(head + "@there --frames 5 --key-frames 0 --out f_#.vdb"), 2,
                 "1 frames are given for 2 patches");
  EXPECT_REFUSED(levelsmith(head + "@there --frames 5 --key-frames 0,5 --out f_#.vdb"), 2,
                 "would be at frame 5");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --drift 0.5 --out f_#.vdb"), 2, "--drift");
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --carve --alone --out f_#.vdb"), 2,
                 "animate: --carve and --alone");
  // Errors that only the run can find: the file of a frame, before the first frame.
  EXPECT_REFUSED(levelsmith(head + "--frames 3 --base-frames b_#.vdb --out f_#.vdb"), 6, "b_1.vdb");
  EXPECT_REFUSED(
      levelsmith(kScene + "patch @ball --corners \"-2,-2,4 2,-2,4 2,2,4 -2,2,4\" --side0 0,-3,4 "
                          "--height 1 --as s ! animate @ball @ring @s @there --frames 3 --out "
                          "f_#.vdb"),
      2, "--side0");
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(Animate, NamesTheFrameAndKeepsTheFramesBefore) {
  ASSERT_EQ(levelsmith("sphere --radius 5.1 --voxel 0.5 ! write base_1.vdb ! sphere --radius 1 "
                       "--center 60,0,0 --voxel 0.5 ! write base_2.vdb")
                .code,
            0);
  EXPECT_REFUSED(
      levelsmith(kScene + "animate @ball @ring @here --frames 3 --base-frames base_#.vdb "
                          "--voxel 0.5 --out f_#.vdb"),
      3, "animate: frame 2: ");
  EXPECT_EQ(fileCount(), 4u);  // two bases, two frames
  EXPECT_REFUSED(
      levelsmith(kScene + "mesh @ring --as m ! read base_2.vdb --as far ! "
                          "patch @far --at 61,0,0 --size 1.2,1.2 --height 1 --levels 2 --spacing 1 "
                          "--particles conforming --as wrong ! animate @ball @m @wrong --map mesh "
                          "--frames 2 --out m_#.ply"),
      3, "animate: frame 0: the patch does not lie on the base");
  EXPECT_FALSE(bytes("f_1.vdb").empty());
}

TEST_F(Animate, DryRunPlansAndWritesNothing) {
  const auto outcome = levelsmith("--dry-run " + kScene +
                                  "animate @ball @ring @here @there --frames 9 --base-frames "
                                  "not_there_#.vdb --out f_#.vdb");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(fileCount(), 0u);
  // The scene fits into the limit, the frames do not.
  const std::string limit = "--max-memory 200M ";
  const std::string fine =
      kScene + "animate @ball @ring @here --frames 9 --voxel 0.005 --out f_#.vdb";
  EXPECT_EQ(levelsmith(limit + kScene + "texture @ball @ring @here --voxel 0.5").code, 0);
  const auto planned = levelsmith(limit + "--dry-run " + fine);
  EXPECT_EQ(planned.code, 4);
  EXPECT_NE(planned.err.find("animate: needs about"), std::string::npos) << planned.err;
  EXPECT_REFUSED(levelsmith(limit + fine), 4, "animate: needs about");  // before the run
  EXPECT_EQ(fileCount(), 0u);
}

}  // namespace animate_test
