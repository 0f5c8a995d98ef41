// Scenes on the command line: building, saving, reading, drawing and errors.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command_line.h"

namespace scene_test {

using support::Outcome;
using Json = nlohmann::json;

const std::string kTwo =
    "box --size 2,2,2 --voxel 0.1 --as b ! sphere --radius 1.3 --voxel 0.07 --as s ! scene @b @s ";

class Scenes : public support::ShellTest {
 protected:
  void make() {
    const Outcome made =
        levelsmith(kTwo +
                   "--colours '0.71234567,0.98765432,0.65432109 0.1,0.2,0.3' --csg 'b - s' --from "
                   "4,3,5 --to 0,0,0 --size 64x48 ! write cut.json ! render a.exr "
                   "--samples 1 --renderer cpu");
    ASSERT_EQ(made.code, 0) << made.err;
  }
  /// Exit code and message for the scene file with one word replaced.
  Outcome readChanged(const std::string& word, const std::string& other) {
    std::string text = shell("cat cut.json").out;
    const std::size_t at = text.find(word);
    EXPECT_NE(at, std::string::npos) << word;
    writeFile("bad.json", text.replace(at, word.size(), other));
    return levelsmith("read bad.json ! info");
  }
};

TEST_F(Scenes, AreUnchangedAfterSavingAndReading) {
  make();
  const Outcome again =
      levelsmith("read cut.json ! render b.exr --samples 1 --renderer cpu ! info --json");
  ASSERT_EQ(again.code, 0) << again.err;
  const Outcome same = levelsmith("compare-images a.exr b.exr --exact");
  EXPECT_EQ(same.code, 0) << same.out << same.err;
  const Outcome judged = levelsmith("read cut.json ! render c.exr --renderer both --samples 1");
  EXPECT_EQ(judged.code, 0) << judged.err;
  const Outcome other = levelsmith("read cut.json ! render d.exr --size 32x32 --fov 20");
  EXPECT_EQ(other.code, 0) << other.err;
  EXPECT_NE(levelsmith("compare-images a.exr d.exr").code, 0);
}

TEST_F(Scenes, AreCutByNearAndFarPlanes) {
  const Outcome made =
      levelsmith(kTwo +
                 "--csg 'b - s' --from 0,0,5 --to 0,0,0 --near 4.5 --far 5.5 --size 64x48 "
                 "! write cut.json ! render a.exr --samples 1 --renderer both");
  ASSERT_EQ(made.code, 0) << made.err;
  const std::string json = shell("cat cut.json").out;
  EXPECT_NE(json.find("\"near\": 4.5"), std::string::npos) << json;
  EXPECT_EQ(levelsmith("read cut.json ! render b.exr --samples 1 --renderer cpu").code, 0);
  EXPECT_EQ(levelsmith("compare-images a.exr b.exr --exact").code, 0);
  EXPECT_EQ(levelsmith("read cut.json ! render c.exr --samples 1 --near 4 --renderer cpu").code, 0);
  EXPECT_NE(levelsmith("compare-images a.exr c.exr").code, 0);
  EXPECT_EQ(levelsmith("read cut.json ! render c.exr --near 6").code, 2);
  EXPECT_EQ(levelsmith("read cut.json ! render c.exr --near -1").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--near 3 --far 2 ! info").code, 2);
  EXPECT_EQ(readChanged("\"near\": 4.5", "\"near\": 6").code, 3);
}

TEST_F(Scenes, ContainMeshesToo) {
  const Outcome made =
      levelsmith(kTwo.substr(0, kTwo.find("! scene")) +
                 "! sphere --radius 0.4 --center 1,1,1 --voxel 0.1 ! mesh --as m ! scene @b @s @m "
                 "--csg 'b - s' "
                 "! write cut.json ! render a.exr --samples 1 --size 64x48 --renderer both");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(exists("cut-m.ply"));
  const Outcome again = levelsmith(
      "read cut.json ! render b.exr --samples 1 --size 64x48 --renderer gpu ! info --json");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(Json::parse(again.out)["meshes"][0]["id"], 3);
  const Outcome same = levelsmith("compare-images a.exr b.exr");
  EXPECT_EQ(same.code, 0) << same.out << same.err;
  EXPECT_EQ(levelsmith("read cut-m.ply ! render m.png --size 64x48").code, 0);
  const std::string dry =
      "read cut-m.ply --as m ! sphere --radius 1 --voxel 0.2 --as b ! scene @m @b "
      "--ortho 20vx ! render d.png --size 16x16 --ortho 20vx";
  EXPECT_EQ(levelsmith("--dry-run " + dry).code, 0);
  EXPECT_EQ(levelsmith(dry).code, 0);
  EXPECT_EQ(readChanged("cut-m.ply", "cut-b.vdb").code, 2);
  EXPECT_EQ(readChanged("b - s", "b - m").code, 2);  // a mesh is no solid
}

TEST_F(Scenes, AreBlended) {
  const std::string wide =
      "box --size 2,2,2 --voxel 0.1 --half-width 6 --as b ! sphere --radius 1.3 --voxel 0.07 "
      "--half-width 9 --as s ! scene @b @s ";
  const Outcome made = levelsmith(wide +
                                  "--csg 'b - s' --soft 5vx --size 64x48 --from 4,3,5 ! write "
                                  "soft.json ! render a.exr --samples 1 ! info --json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_DOUBLE_EQ(Json::parse(made.out)["soft"], 5 * 0.07);
  const Outcome again = levelsmith("read soft.json ! render b.exr --samples 1 --renderer cpu");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(levelsmith("compare-images a.exr b.exr --exact").code, 0);
  const Outcome judged = levelsmith("read soft.json ! render c.exr --renderer both --samples 1");
  EXPECT_EQ(judged.code, 0) << judged.err;
  const Outcome shaded = levelsmith("read soft.json ! render d.exr --samples 1 --renderer gpu");
  EXPECT_EQ(shaded.code, 0) << shaded.err;
  EXPECT_EQ(levelsmith("compare-images a.exr d.exr --exact").code, 0);
  EXPECT_EQ(levelsmith("read soft.json ! render d.exr --filter bspline").code, 2);
  for (const char* how : {"--near 4 --far 8 --thickness", "--value-bits 16", "--value-bits 8"}) {
    const Outcome both =
        levelsmith(std::string("read soft.json ! render d.exr --renderer both --samples 1 ") + how);
    EXPECT_EQ(both.code, 0) << how << both.err;
    EXPECT_NE(levelsmith("compare-images a.exr d.exr --exact").code, 0) << how;
  }
  EXPECT_EQ(levelsmith("read soft.json ! render d.exr --renderer both --tables nanovdb").code, 2);
  const Outcome clear = levelsmith(wide + "--csg 'b - s' --soft 5vx --opacities '1 0.5' ! info");
  EXPECT_EQ(clear.code, 2);
  EXPECT_NE(clear.err.find("omit the opacity"), std::string::npos) << clear.err;

  const Outcome morphed =
      levelsmith(wide + "--morph 0.25 ! info --json ! write m.json ! render m.png --size 64x48");
  ASSERT_EQ(morphed.code, 0) << morphed.err;
  EXPECT_EQ(Json::parse(morphed.out)["morph"], 0.25);
  EXPECT_EQ(morphed.err.find("widen the bands"), std::string::npos) << morphed.err;
  const Outcome far = levelsmith(
      "sphere --radius 1 --voxel 0.1 --as a ! sphere --radius 2 --voxel 0.1 --as b ! scene @a @b "
      "--morph 0.3 ! render f.png --size 64x48");
  ASSERT_EQ(far.code, 0) << far.err;
  EXPECT_NE(far.err.find("widen the bands"), std::string::npos) << far.err;

  EXPECT_EQ(levelsmith(wide + "--soft 0.1 ! info").code, 2);
  EXPECT_EQ(levelsmith(wide + "--csg 'b | s' --soft -0.1 ! info").code, 2);
  EXPECT_EQ(levelsmith(wide + "--csg 'b | s' --soft 0.7 ! info").code, 3);
  EXPECT_EQ(levelsmith(wide + "--csg 'b | s' --morph 0.5 ! info").code, 2);
  EXPECT_EQ(levelsmith(wide + "--morph 1.5 ! info").code, 2);
  EXPECT_EQ(levelsmith(wide + "@b --morph 0.5 ! info").code, 2);
  make();
  EXPECT_EQ(readChanged("\"csg\"", "\"soft\": 9, \"csg\"").code, 3);
  EXPECT_EQ(readChanged("\"csg\"", "\"morph\": 0.5, \"csg\"").code, 3);
  shell("cp soft.json cut.json");
  EXPECT_EQ(readChanged("\"id\": 1", "\"opacity\": 0.5, \"id\": 1").code, 3);
}

TEST_F(Scenes, AreTransparent) {
  const Outcome made = levelsmith(kTwo +
                                  "--csg 'b - s' --opacities '1 0.25' --from 4,3,5 --to 0,0,0 "
                                  "--size 64x48 ! write cut.json ! render a.exr --samples 2 "
                                  "--renderer both");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(shell("cat cut.json").out.find("\"opacity\": 0.25"), std::string::npos);
  EXPECT_EQ(levelsmith("read cut.json ! render b.exr --samples 2 --renderer cpu").code, 0);
  EXPECT_EQ(levelsmith("compare-images a.exr b.exr --exact").code, 0);
  EXPECT_EQ(readChanged("\"opacity\": 0.25", "\"opacity\": 0").code, 3);
  EXPECT_EQ(readChanged("\"opacity\": 0.25", "\"opacity\": 1.5").code, 3);
  EXPECT_EQ(levelsmith(kTwo + "--opacities '0.5' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--opacities '0.5 0' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--opacities '0.5 thin' ! render a.png").code, 2);
}

TEST_F(Scenes, ReportTheirContents) {
  const Outcome told = levelsmith(kTwo + "--csg 's | b' ! info --json");
  ASSERT_EQ(told.code, 0) << told.err;
  const Json json = Json::parse(told.out);
  EXPECT_EQ(json["kind"], "scene");
  EXPECT_EQ(json["csg"], "s | b");
  EXPECT_EQ(json["solids"][1]["name"], "s");
}

TEST_F(Scenes, CanBeMovedInTheFile) {
  make();
  const Outcome moved =
      readChanged("\"file\": \"cut-b.vdb\"",
                  "\"file\": \"cut-b.vdb\", \"transform\": [1,0,0,0, 0,1,0,0, 0,0,1,0, 100,0,0,1]");
  ASSERT_EQ(moved.code, 0) << moved.err;
  EXPECT_NE(moved.out.find("100.9"), std::string::npos) << moved.out;
}

TEST_F(Scenes, AreRefusedIfInvalid) {
  EXPECT_EQ(levelsmith(kTwo + "--csg 'b - t' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--csg 'b -' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--names 'one' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--names 'one one' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--colours '1,0,0' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "--colours '1,0,0 0,0,7' ! render a.png").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "! write a.vdb").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "! write - --format json").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "! measure").code, 2);
  EXPECT_EQ(levelsmith("read - --format json ! info").code, 2);
  EXPECT_EQ(levelsmith(kTwo + "! render a.png --thickness").code, 2);
  EXPECT_EQ(levelsmith("read nowhere.json ! info").code, 6);
  const Outcome unused = levelsmith(kTwo + "--csg b ! info");
  EXPECT_EQ(unused.code, 0);
  EXPECT_NE(unused.err.find("'s', which is not drawn"), std::string::npos) << unused.err;
}

TEST_F(Scenes, FromBrokenFilesAreRefused) {
  make();
  EXPECT_EQ(readChanged("levelsmith scene", "levelsmith dream").code, 3);
  EXPECT_EQ(readChanged("\"version\": 1", "\"version\": 2").code, 3);
  EXPECT_EQ(readChanged("\"fov\"", "\"fow\"").code, 3);
  EXPECT_EQ(readChanged("\"fov\": 35", "\"fov\": \"wide\"").code, 3);
  EXPECT_EQ(readChanged("\"ambient\": 0.32", "\"ambient\": null").code, 3);
  EXPECT_EQ(readChanged("b - s", "b - q").code, 2);
  EXPECT_EQ(readChanged("cut-b.vdb", "nowhere.vdb").code, 6);
  EXPECT_EQ(readChanged("cut-b.vdb", "-").code, 3);
  EXPECT_EQ(readChanged("\"id\": 1", "\"id\": 2").code, 3);
  EXPECT_EQ(readChanged("\"name\": \"b\"", "\"name\": \"s\"").code, 3);
  EXPECT_EQ(readChanged("\"fov\": 35", "\"fov\": 400").code, 3);
  EXPECT_EQ(readChanged("\"strength\": 0.8", "\"strength\": -1").code, 3);
  const Outcome flat = readChanged("\"id\": 1",
                                   "\"id\": 1, \"transform\": "
                                   "[1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]");
  EXPECT_EQ(flat.code, 3);
  EXPECT_NE(flat.err.find("solid 1"), std::string::npos) << flat.err;
  EXPECT_EQ(readChanged("cut-b.vdb", "bad.json").code, 3);
  EXPECT_EQ(readChanged("\"id\": 1", "\"id\": -1").code, 3);
  EXPECT_EQ(readChanged("\"solids\"", "\"solid\"").code, 3);
  EXPECT_EQ(readChanged("{", "[").code, 3);
}

/// A Bézier volume of two boxes that share the face x = 0. Solid is where the attribute is
/// negative.
/// @param atFace  attribute of the left box at the middle control point of that face; 1 elsewhere
std::string twoBoxes(double atFace) {
  Json patches = Json::array();
  for (const double left : {-1.0, 0.0}) {
    Json points = Json::array();
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) {
          const bool isMiddle = left < 0 && i == 1 && j == 1 && k == 1;
          points.push_back({left + i, j - 1, k - 1, isMiddle ? atFace : 1.0});
        }
    patches.push_back({{"degree", {1, 2, 2}}, {"points", points}});
  }
  return Json({{"format", "levelsmith bezier volume"},
               {"version", 1},
               {"isovalue", 0},
               {"patches", patches}})
      .dump();
}

TEST_F(Scenes, KeepTheLooksOfABezierVolume) {
  writeFile("rest.json", twoBoxes(-9));
  writeFile("ground.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n0 0\n0 1\n");
  const std::string ball = " ! sphere --radius 0.5 --voxel 0.1 --as b ! scene @v @b ";
  ASSERT_EQ(levelsmith("read rest.json --as v ! scene @v --colours 1,0,0 --opacities 0.5 "
                       "! write red.json")
                .code,
            0);
  ASSERT_EQ(levelsmith("read red.json --as v" + ball + "! write both.json").code, 0);
  const Json part = Json::parse(shell("cat both.json").out)["beziers"][0];
  EXPECT_EQ(part["colour"], Json({1.0, 0.0, 0.0}));
  EXPECT_EQ(part["opacity"], 0.5);
  // Other parts of the file would be lost.
  ASSERT_EQ(levelsmith("read rest.json --as v ! read ground.asc --as t ! scene @v @t "
                       "! write with_ground.json")
                .code,
            0);
  const Outcome lost = levelsmith("read with_ground.json --as v" + ball + "! write lost.json");
  EXPECT_EQ(lost.code, 2);
  EXPECT_NE(lost.err.find("other parts than one"), std::string::npos) << lost.err;
}

/// The attribute jumps across the common face, so rays enter the solid there and do not leave it.
TEST_F(Scenes, WarnOfAnOpenOperand) {
  const std::string picture =
      "read v.json --as v ! sphere --radius 0.2 --center 0,0,2 --voxel 0.05 --as b "
      "! scene @v @b --csg 'v | b' ! render v.exr --size 64x48 --samples 1 --renderer cpu";
  writeFile("v.json", twoBoxes(-9));
  const Outcome open = levelsmith(picture);
  EXPECT_EQ(open.code, 0);
  EXPECT_NE(open.err.find("without leaving it"), std::string::npos) << open.err;
  EXPECT_NE(shell("grep -ac ls:bezierOpen v.exr").out, "0\n");
}

}  // namespace scene_test
