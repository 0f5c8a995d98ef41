#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/action_test.h"
#include "tests/support/command_line.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace point_actions_test {

using Json = nlohmann::json;
using support::measured;

class PointActions : public support::ActionTest {};

constexpr const char* kSampled = "sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 2000 ! ";

TEST_F(PointActions, SampleWriteReadAndDescribe) {
  const Json made = json(std::string(kSampled) + "write a.ply ! info --json");
  EXPECT_EQ(made["kind"], "point cloud");
  EXPECT_EQ(made["points"], 2000);
  EXPECT_EQ(made["attributes"], "normals");
  EXPECT_EQ(made["duplicates"], 0);
  // 2000 points on the area 4 pi, at most the distance of a hexagonal lattice.
  EXPECT_LT(made["spacing"]["mean"], 0.0852);
  EXPECT_GT(made["spacing"]["mean"], 0.06);
  const Json read = json("read a.ply ! info --json");
  EXPECT_EQ(read["spacing"], made["spacing"]);
  EXPECT_EQ(json("info a.ply --json")["points"], 2000);
  for (const char* name : {"b.xyz", "b.csv", "b.obj", "b.csv.gz"}) {
    const std::string file = name;
    EXPECT_EQ(json("read a.ply ! write " + file + " ! read " + file + " ! info --json")["spacing"],
              made["spacing"])
        << name;
  }
  const support::Outcome lost = levelsmith("read a.ply ! write b.pts");
  EXPECT_EQ(lost.code, 0);
  EXPECT_NE(lost.err.find("cannot store the normals"), std::string::npos) << lost.err;
}

TEST_F(PointActions, AMeshFileIsAMeshUnlessItHasNoFaces) {
  ASSERT_EQ(levelsmith("box --size 1,1,1 --voxel 0.25 ! mesh ! write a.obj ! write a.stl").code, 0);
  EXPECT_EQ(json("read a.obj ! info --json")["kind"], "mesh");
  EXPECT_EQ(json("read a.obj --points ! info --json")["kind"], "point cloud");
  EXPECT_EQ(json("read a.stl --points ! info --json")["kind"], "point cloud");
  writeFile("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_EQ(json("read b.obj ! info --json")["points"], 3);
  expectRefusal("read b.obj ! measure", 2, "point cloud");
  writeFile("c.xyz", "0 0 0\n1 1 1\n");
  EXPECT_EQ(json("read - --format xyz <c.xyz ! info --json")["points"], 2);
}

TEST_F(PointActions, ActionsWorkOnClouds) {
  const Json thinned = json(std::string(kSampled) + "thin --radius 0.2 ! info --json");
  EXPECT_GE(thinned["spacing"]["least"], 0.2);
  EXPECT_EQ(json(std::string(kSampled) + "thin --count 100 ! info --json")["points"], 100);
  const Json clipped = json(std::string(kSampled) + "clip --plane \"0,0,0 0,0,1\" ! info --json");
  EXPECT_NEAR(clipped["points"].get<double>(), 1000, 60);
  EXPECT_LE(clipped["bounds"]["max"][2], 0);
  const Json moved =
      json(std::string(kSampled) + "transform --scale 2 --translate 10,0,0 ! info --json");
  EXPECT_NEAR(moved["bounds"]["max"][0].get<double>(), 12, 0.05);
  EXPECT_EQ(json(std::string(kSampled) + "outliers ! info --json")["points"], 2000);
  const Json mirrored =
      json(std::string(kSampled) + "transform --mirror x ! normals --neighbours 12 ! info --json");
  EXPECT_EQ(mirrored["attributes"], "normals");
}

TEST_F(PointActions, MeshPointsMakesAClosedMesh) {
  const std::string made = std::string(kSampled) + "mesh-points --edge 0.2 ! ";
  const Json mesh = json(made + "measure --json");
  EXPECT_EQ(mesh["euler"], 2);
  EXPECT_EQ(mesh["closed_manifold"], true);
  const support::Outcome outcome = levelsmith(made + "write m.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("in 1 parts, 0 borders"), std::string::npos) << outcome.err;
  std::string plane;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) plane += std::to_string(i) + " " + std::to_string(j) + " 0\n";
  writeFile("plane.xyz", plane);
  const support::Outcome open = levelsmith("read plane.xyz ! mesh-points ! write n.ply");
  EXPECT_EQ(open.code, 0) << open.err;
  EXPECT_NE(open.err.find("is a guess"), std::string::npos) << open.err;
  EXPECT_NE(open.err.find("1 borders"), std::string::npos) << open.err;
  writeFile("line.xyz", "0 0 0\n1 0 0\n2 0 0\n");
  expectRefusal("read line.xyz ! mesh-points", 3, "lie on a line");
  expectRefusal("read line.xyz ! mesh-points --angle 60", 2, "at most 57 degrees");
  expectRefusal("read line.xyz ! mesh-points --gap 5", 2, "between 1.5 and 4");
  expectRefusal("read line.xyz ! mesh-points --sharp 5", 2, "between 10 and 90 degrees");
  expectRefusal("read line.xyz ! mesh-points --smoothing 0.5", 2, "between 1 and 10");
}

TEST_F(PointActions, MeshPointsExpectsTheTrianglesOfShortEdges) {
  const std::string made = std::string(kSampled) + "mesh-points --edge 0.05 ! ";
  const double triangles = json(made + "measure --json")["triangles"];
  const support::Outcome plan = levelsmith("--explain " + made + "measure");
  const std::string text = plan.out + plan.err;
  const std::size_t line = text.find("\nmesh-points");
  ASSERT_NE(line, std::string::npos) << text;
  const std::size_t about = text.find("about ", line);
  ASSERT_NE(about, std::string::npos) << text;
  // 11,928 triangles; the area over that of an equilateral triangle is 11,608.
  EXPECT_NEAR(std::stod(text.substr(about + 6)), triangles, 0.08 * triangles) << text;
}

TEST_F(PointActions, MeshPointsKeepsSharpEdges) {
  const std::string made =
      "box --size 2,1,1 --voxel 0.1 ! mesh --sharp ! sample --count 1500 ! mesh-points --sharp 30 "
      "! ";
  const Json mesh = json(made + "measure --json");
  EXPECT_EQ(mesh["euler"], 2);
  EXPECT_EQ(mesh["closed_manifold"], true);
  EXPECT_NEAR(mesh["volume"].get<double>(), 2, 0.002);
  const support::Outcome outcome = levelsmith(made + "write m.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("12 sharp edges"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("8 corners, between 6 smooth pieces"), std::string::npos)
      << outcome.err;
}

TEST_F(PointActions, NormalsWarnOfAGuess) {
  std::string plane;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) plane += std::to_string(i) + " " + std::to_string(j) + " 0\n";
  writeFile("plane.xyz", plane);
  const support::Outcome outcome = levelsmith("read plane.xyz ! normals ! write n.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("is a guess"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("does not confirm"), std::string::npos) << outcome.err;
}

TEST_F(PointActions, NormalsWarnOfDoubtBesideAGuess) {
  // A bowl, and a plane far from it.
  ASSERT_EQ(
      levelsmith(std::string(kSampled) + "clip --plane \"0,0,-0.5 0,0,1\" ! write bowl.xyz").code,
      0);
  std::string points = support::slurp(folder_ / "bowl.xyz");
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j)
      points += std::to_string(0.05 * i) + " " + std::to_string(0.05 * j) + " 40 0 0 1\n";
  writeFile("both.xyz", points);
  const support::Outcome outcome = levelsmith("read both.xyz ! normals ! write n.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("of 1 of 2 connected parts is a guess"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("of the tested points of the other parts"), std::string::npos)
      << outcome.err;
}

TEST_F(PointActions, RefusalsHaveTheirCode) {
  writeFile("a.xyz", "0 0 0\n1 0 0\n2 0 0\n");
  writeFile("bad.xyz", "0 0 0\n1 0 nan\n");
  writeFile("cut.pts", "5\n0.000 0.000 0.000\n0.5 0.5 0.5\n");
  writeFile("box.json", "{}");
  expectRefusal("read bad.xyz ! info", 3, "line 2");
  expectRefusal("read cut.pts ! info", 3, "ends after 2 of 5");
  expectRefusal("read none.xyz ! info", 6, "none.xyz");
  expectRefusal("read a.xyz ! normals", 3, "lie on a line");
  expectRefusal("read a.xyz ! normals --neighbours 2", 2, "fewer than 3 --neighbours");
  for (const char* action : {"normals", "outliers"})
    expectRefusal(std::string("read a.xyz ! ") + action + " --neighbours 1001", 2,
                  std::string(action) + ": 1001 neighbours are more than the maximum of 1000");
  writeFile("comma.csv", "1,5;2,5;3,5\n");
  expectRefusal("read comma.csv ! info", 3, "decimal commas");
  writeFile("bare.pts", "0 0 0\n1 0 0\n");
  expectRefusal("read bare.pts ! info", 3, "--format xyz");
  expectRefusal("read a.xyz ! transform --scale 2e38 ! write b.xyz", 3, "3.4e38");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! mesh ! sample --spacing 1e-200", 4,
                "give a smaller count or a larger spacing");
  expectRefusal("read a.xyz ! thin", 2, "either --radius or --count");
  expectRefusal("read a.xyz ! thin --count 4", 3, "3 different positions");
  expectRefusal("read a.xyz ! clip --box \"5,5,5 6,6,6\"", 3, "none of the 3 points");
  expectRefusal("read a.xyz ! transform --scale 2 --bake", 2, "point cloud");
  expectRefusal("read a.xyz ! write a.stl", 2, "write .ply");
  expectRefusal("read a.xyz ! write a.stl", 2, "write .ply");
  expectRefusal("read a.xyz --points --grid x ! info", 2, "--grid");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! mesh ! write a.xyz", 2, "sample");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! mesh ! sample", 2, "either --count or --spacing");
}

TEST_F(PointActions, ALevelSetOfPointsHasACertificate) {
  const Json ball =
      json(std::string(kSampled) +
           "level-set --voxel 0.04 --support support.vdb --method mls ! measure --json");
  // The points lie on a mesh of triangles inside the ball.
  EXPECT_NEAR(ball["volume"].get<double>(), 4.18879, measured(0.0063));
  EXPECT_EQ(ball["euler"], 2);
  EXPECT_EQ(json("info support.vdb --json")["grids"].size(), 1);
  const support::Outcome report =
      levelsmith("--report r.json " + std::string(kSampled) + "level-set --resolution 50 ! info");
  ASSERT_EQ(report.code, 0) << report.err;
  const Json steps = Json::parse(support::readText(folder_ / "r.json"))["steps"];
  Json certificate;
  for (const Json& step : steps)
    if (step.contains("certificate")) certificate = step["certificate"];
  EXPECT_EQ(certificate["points"], 2000);
  EXPECT_EQ(certificate["unsupported_share"], 0);
  EXPECT_LT(certificate["mean_residual"], 0.01);
}

TEST_F(PointActions, ALevelSetOfPointsRefusesAGuess) {
  const std::string half = std::string(kSampled) + "clip --plane \"0,0,0.3 0,0,1\" ! ";
  expectRefusal(half + "level-set --voxel 0.04 ! info", 3, "--accept-sign");
  const support::Outcome accepted =
      levelsmith(half + "level-set --voxel 0.04 --accept-sign ! check");
  EXPECT_EQ(accepted.code, 0) << accepted.err;
  EXPECT_NE(accepted.err.find("is a guess"), std::string::npos) << accepted.err;
  writeFile("a.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n");
  expectRefusal("read a.xyz ! level-set --voxel 0.1 ! info", 3, "`normals`");
  expectRefusal(std::string(kSampled) + "level-set --voxel 0.1 --sign closed ! info", 2, "meshes");
  expectRefusal(std::string(kSampled) + "level-set --voxel 0.1 --support s.ply ! info", 2, ".vdb");
  expectRefusal(std::string(kSampled) + "level-set --voxel 0.1 --neighbours 3 ! info", 2,
                "6 to 1000");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! mesh ! level-set --voxel 0.2 --method mls", 2,
                "point clouds");
  expectRefusal(std::string(kSampled) + "level-set --voxel 0.1 --method prism ! info", 2, "meshes");
}

TEST_F(PointActions, ALevelSetOfParticlesNeedsNoNormals) {
  writeFile("a.xyz", "0 0 0\n0.5 0 0\n0 0.5 0\n0 0 0.5\n");
  const std::string particles = "read a.xyz ! level-set --method particles --voxel 0.05 ";
  const Json balls = json(particles + "--kernel balls --radius 0.2 ! measure --json");
  EXPECT_EQ(balls["components"], 4);
  EXPECT_NEAR(balls["volume"].get<double>(), 4 * 4.18879 * 0.008, measured(2e-4));
  EXPECT_EQ(json(particles + "! measure --json")["components"], 1);
  expectRefusal(particles + "--support s.vdb ! info", 2, "does not apply");
  expectRefusal("read a.xyz ! level-set --voxel 0.05 --radius 1 ! info", 2, "--method particles");
  expectRefusal(particles + "--reach 20 ! info", 2, "1.5 to 10");
}

TEST_F(PointActions, ADryRunPlansClouds) {
  writeFile("a.xyz", "0 0 0\n1 0 0\n2 1 0\n");
  const support::Outcome outcome =
      levelsmith("--dry-run read a.xyz ! normals ! thin --radius 1% ! write b.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
}

}  // namespace point_actions_test
