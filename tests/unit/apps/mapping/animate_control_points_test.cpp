// The action animate with key-framed control points: lattices and Bézier volumes.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/action_test.h"

namespace animate_control_points_test {

using Json = nlohmann::json;

class AnimateControlPoints : public support::ActionTest {
 protected:
  /// Writes a lattice of degree 1 around [-2, 2]³ whose control points are scaled.
  void writeLattice(const std::string& name, double x, double y = 1, int count = 2) {
    Json json = {{"format", "levelsmith lattice"}, {"version", 1},        {"degree", {1, 1, 1}},
                 {"count", {count, 2, 2}},         {"min", {-2, -2, -2}}, {"max", {2, 2, 2}}};
    for (int i = 0; i < count; ++i)
      for (const double v : {-2.0, 2.0})
        for (const double w : {-2.0, 2.0})
          json["points"].push_back({x * (-2 + 4.0 * i / (count - 1)), y * v, w});
    writeFile(name, json.dump());
  }

  /// Writes a Bézier volume of degree 1: the unit cube with its right half solid, with one corner
  /// moved.
  void writeVolume(const std::string& name, double moved, const std::string& isovalue = "0") {
    Json points = Json::array();
    for (const double x : {0.0, 1.0})
      for (const double y : {0.0, 1.0})
        for (const double z : {0.0, 1.0}) points.push_back({x, y, z, 0.5 - x});
    points[7][0] = 1 + moved;
    writeFile(name, R"({"format": "levelsmith bezier volume", "version": 1, "isovalue": )" +
                        isovalue + R"(, "patches": [{"degree": [1, 1, 1], "points": )" +
                        points.dump() + "}]}");
  }

  std::string bytes(const std::string& file) { return support::slurp(folder_ / file); }

  void run(const std::string& chain) {
    const auto outcome = levelsmith("--report run.json " + chain);
    ASSERT_EQ(outcome.code, 0) << chain << "\n" << outcome.err;
  }
  Json details() { return Json::parse(bytes("run.json"))["steps"].back()["details"]; }

  void expectSame(const std::string& a, const std::string& b) {
    ASSERT_FALSE(bytes(a).empty()) << a;
    EXPECT_EQ(bytes(a) == bytes(b), true) << a << " and " << b;
  }
};

const std::string kBall = "sphere --radius 1 --voxel 0.1 ! ";
const std::string kView = " --from 5,3,4 --to 0,0,0 --size 64x48 --renderer cpu";

TEST_F(AnimateControlPoints, EqualsDeformAtKeysAndBetweenThem) {
  writeLattice("wide.json", 1.5);
  writeLattice("half.json", 1.25);
  run(kBall + "write ball.vdb ! deform --lattice half.json ! write half.vdb");
  run(kBall + "deform --lattice wide.json ! write wide.vdb ! mesh ! write wide.ply");
  run(kBall +
      "animate --lattices 'rest wide.json rest' --key-frames 0,2,5 --frames 7 --out f_#.vdb "
      "! write last.vdb");
  const Json details = Json::parse(bytes("run.json"))["steps"][1]["details"];
  expectSame("f_0.vdb", "ball.vdb");
  expectSame("f_1.vdb", "half.vdb");
  expectSame("f_2.vdb", "wide.vdb");
  expectSame("f_5.vdb", "ball.vdb");
  expectSame("f_6.vdb", "f_5.vdb");
  expectSame("last.vdb", "f_6.vdb");
  EXPECT_EQ(details["frames"], 7);
  EXPECT_EQ(details["reused"], 1);
  EXPECT_NEAR(details["frame"][1]["certificate"]["least_jacobian_low"].get<double>(), 1.25, 1e-11);
  EXPECT_NEAR(details["frame"][3]["keys"][1]["weight"].get<double>(), 1 / 3.0, 1e-15);
  run(kBall +
      "animate --lattices wide.json --frames 1 --voxel 0.2 --half-width 4 --out coarse_#.vdb");
  const Json info = json("read coarse_0.vdb ! info --json");
  EXPECT_NEAR(info["voxel_size"].get<double>(), 0.2, 1e-15);
  // As meshes, and as pictures.
  run(kBall + "animate --lattices 'rest wide.json' --frames 2 --out m_#.ply");
  expectSame("m_1.ply", "wide.ply");
  run("read wide.vdb ! render wide.png" + kView);
  run(kBall + "animate --lattices 'rest wide.json' --frames 3 --out p_#.png" + kView);
  expectSame("p_2.png", "wide.png");
  run("read half.vdb ! render half.png" + kView);
  expectSame("p_1.png", "half.png");
}

TEST_F(AnimateControlPoints, MovesMeshesAndPointsSmoothly) {
  writeLattice("wide.json", 2);
  // A third of the way has the share 7/27 of a smooth motion between two keys at rest.
  writeLattice("share.json", 1 + 7 / 27.0);
  const std::string motion =
      "animate --lattices 'rest wide.json' --frames 4 --interpolation smooth --out ";
  run("box --size 1,1,1 --voxel 0.2 ! mesh --sharp ! " + motion + "m_#.ply");
  const Json mesh = json("read m_1.ply ! measure --json"),
             truth = json(
                 "box --size 1,1,1 --voxel 0.2 ! mesh --sharp ! deform --lattice "
                 "share.json ! measure --json");
  EXPECT_NEAR(mesh["volume"].get<double>(), truth["volume"].get<double>(), 1e-12);
  EXPECT_NEAR(truth["volume"].get<double>(), 1 + 7 / 27.0, 1e-4);
  run(kBall + "mesh ! sample --spacing 0.3 ! " + motion + "c_#.xyz");
  const Json points = json("read c_3.xyz ! info --json");
  EXPECT_NEAR(points["bounds"]["max"][0].get<double>(), 2, 0.02);
}

TEST_F(AnimateControlPoints, RefusesAFoldBetweenKeysBeforeAnyFrame) {
  // Half a turn: both keys are injective, and the frame in the middle is flat.
  writeLattice("turned.json", -1, -1);
  run(kBall + "deform --lattice turned.json ! write turned.vdb");
  expectRefusal(kBall + "animate --lattices 'rest turned.json' --frames 5 --out f_#.vdb", 3,
                "frame 2, between the keys of frames 0 and 4: the lattice folds");
  EXPECT_TRUE(bytes("f_0.vdb").empty());
  writeLattice("mirrored.json", -1);
  expectRefusal(kBall + "animate --lattices mirrored.json --frames 1 --out f_#.vdb", 3,
                "frame 0: the lattice folds");
}

TEST_F(AnimateControlPoints, ProvesTheMotionBetweenFrames) {
  writeLattice("turned.json", -1, -1);
  writeLattice("wide.json", 1.5);
  // No frame lies in the middle of the half turn, where the ball is flat.
  const auto turned = levelsmith("--report run.json " + kBall +
                                 "animate --lattices 'rest turned.json' --frames 4 --out f_#.vdb");
  EXPECT_EQ(turned.code, 0) << turned.err;
  EXPECT_NE(turned.err.find("the motion folds at frame 1.5"), std::string::npos) << turned.err;
  EXPECT_EQ(details()["motion"][0]["verdict"], "folds");
  run(kBall +
      "animate --lattices 'rest wide.json rest' --frames 3 --interpolation smooth --out g_#.vdb");
  ASSERT_EQ(details()["motion"].size(), 2u);
  for (const Json& interval : details()["motion"]) {
    EXPECT_EQ(interval["verdict"], "certified");
    EXPECT_NEAR(interval["least_jacobian_high"].get<double>(), 1, 1e-9);
  }
}

TEST_F(AnimateControlPoints, MovesCages) {
  const auto writeCage = [&](const std::string& name, double x) {
    std::string text;
    for (const double a : {-2 * x, 2 * x})
      for (const double b : {-2.0, 2.0})
        for (const double c : {-2.0, 2.0})
          text +=
              "v " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
    for (const char* face : {"1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"})
      text += std::string("f ") + face + "\n";
    writeFile(name, text);
  };
  writeCage("rest.obj", 1);
  writeCage("wide.obj", 1.5);
  writeCage("half.obj", 1.25);
  const std::string motion = "animate --cages 'rest wide.obj' --frames 3 --out ";
  run(kBall + "mesh ! write ball.ply ! deform --cage rest.obj --to half.obj ! write half.ply");
  run(kBall + "mesh ! " + motion + "c_#.ply --cage rest.obj");
  expectSame("c_0.ply", "ball.ply");
  expectSame("c_1.ply", "half.ply");
  EXPECT_NEAR(details()["frame"][2]["certificate"]["least_jacobian_high"].get<double>(), 1.5, 1e-6);
  expectRefusal(kBall + motion + "c_#.vdb", 2, "--cage is missing");
  expectRefusal(kBall + "animate --lattices a.json --cage rest.obj --frames 2 --out c_#.vdb", 2,
                "--cage is for --cages");
  expectRefusal(kBall + motion + "c_#.vdb --cage rest.obj --lattices a.json", 2,
                "exclude each other");
  writeFile("other.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expectRefusal(kBall + "animate --cages 'rest other.obj' --cage rest.obj --frames 2 --out c_#.vdb",
                3, "cage 2");
}

TEST_F(AnimateControlPoints, MovesBezierVolumes) {
  writeVolume("rest.json", 0);
  writeVolume("bent.json", 0.5);
  writeVolume("half.json", 0.25);
  for (const std::string name : {"rest", "bent", "half"})
    run("read " + name + ".json ! render " + name + ".png" + kView);
  run("read rest.json ! animate --beziers 'rest bent.json' --frames 3 --out b_#.png" + kView);
  expectSame("b_0.png", "rest.png");
  expectSame("b_1.png", "half.png");
  expectSame("b_2.png", "bent.png");
  EXPECT_NE(bytes("b_0.png"), bytes("b_2.png"));
  EXPECT_EQ(details()["frame"][1]["keys"].size(), 2u);
  run("read rest.json ! animate --beziers 'rest.json bent.json' --frames 3 --out s_#.json");
  run("read s_1.json ! render s.png" + kView);
  expectSame("s.png", "half.png");
}

TEST_F(AnimateControlPoints, RefusesToWriteOverItsKeys) {
  writeVolume("rest.json", 0);
  writeVolume("v_1.json", 0.5);
  const std::string before = bytes("v_1.json");
  const std::string keys = "read rest.json ! animate --beziers 'rest v_1.json' --frames ";
  expectRefusal(keys + "2 --out v_#.json", 2,
                "--out would write over 'v_1.json' of --beziers; use other names");
  expectRefusal(keys + "2 --out ./v_#.json", 2, "would write over");
  EXPECT_EQ(bytes("v_1.json"), before);
  EXPECT_TRUE(bytes("v_0.json").empty());
  // With one frame alone, no frame has the name of the key.
  run("read rest.json ! animate --beziers v_1.json --frames 1 --out v_#.json");
  EXPECT_FALSE(bytes("v_0.json").empty());
  // The name of a lattice may be that of a picture's frame, whatever the file contains.
  writeLattice("p_2.png", 1.5);
  expectRefusal(kBall + "animate --lattices 'rest p_2.png' --frames 3 --out p_#.png" + kView, 2,
                "--out would write over 'p_2.png' of --lattices");
}

TEST_F(AnimateControlPoints, RestNeedsLatticesWithoutWeights) {
  writeLattice("wide.json", 1.5);
  Json weighted = Json::parse(bytes("wide.json"));
  weighted["weights"] = std::vector<double>(8, 2.0);
  writeFile("weighted.json", weighted.dump());
  expectRefusal(kBall + "animate --lattices 'rest weighted.json' --frames 2 --out f_#.vdb", 3,
                "'rest' needs lattices without weights");
  expectRefusal(kBall + "animate --lattices 'wide.json weighted.json' --frames 2 --out f_#.vdb", 3,
                "differ in weights");
  run(kBall + "mesh ! animate --lattices weighted.json --frames 1 --out w_#.ply");
  run(kBall + "mesh ! animate --lattices wide.json --frames 1 --out f_#.ply");
  // Equal weights change nothing.
  EXPECT_NEAR(json("read w_0.ply ! measure --json")["volume"].get<double>(),
              json("read f_0.ply ! measure --json")["volume"].get<double>(), 1e-6);
}

TEST_F(AnimateControlPoints, RefusesWhatDoesNotFit) {
  writeLattice("wide.json", 1.5);
  writeLattice("other.json", 1, 1, 3);
  writeVolume("rest.json", 0);
  writeVolume("above.json", 0, "0.1");
  const std::string lattices = kBall + "animate --lattices 'rest wide.json' --frames 3 --out ";
  expectRefusal(kBall + "animate --lattices 'wide.json other.json' --frames 3 --out f_#.vdb", 3,
                "lattice 2 and lattice 1 differ");
  expectRefusal(kBall + "animate --lattices 'rest rest' --frames 3 --out f_#.vdb", 2, "no file");
  expectRefusal(lattices + "f.vdb", 2, "write # for the number");
  expectRefusal(lattices + "f_#.patch", 2, "f_0.patch");
  expectRefusal(lattices + "f_#.png", 2, "--from and --to");
  expectRefusal(lattices + "f_#.vdb --from 1,2,3", 2, "--from is for pictures");
  expectRefusal(lattices + "f_#.vdb --embed 0.1", 2, "--embed is for textures");
  expectRefusal(lattices + "f_#.vdb --key-frames 0,1,2", 2, "3 frames are given for 2 lattices");
  expectRefusal(lattices + "f_#.vdb --beziers rest.json", 2, "exclude each other");
  expectRefusal("read rest.json ! animate --lattices wide.json --frames 1 --out f_#.json", 2,
                "give --beziers");
  expectRefusal(kBall + "animate --beziers rest.json --frames 1 --out f_#.png" + kView, 2,
                "give --lattices");
  expectRefusal("read rest.json ! animate --beziers 'rest above.json' --frames 2 --out f_#.json", 3,
                "differ in the isovalue");
  expectRefusal("read rest.json ! animate --beziers rest.json --frames 1 --out f_#.png", 2,
                "the scene has none");
  expectRefusal(kBall + "mesh ! animate --frames 1 --out f_#.vdb", 2, "needs 3 operands");
  expectRefusal(kBall + "animate --lattices none.json --frames 1 --out f_#.vdb", 6, "none.json");
}

}  // namespace animate_control_points_test
