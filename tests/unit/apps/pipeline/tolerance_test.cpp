#include "apps/pipeline/tolerance/tolerance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/tolerance/error_model.h"
#include "levelset/files/band_file.h"
#include "levelset/grids/sample.h"
#include "levelset/meshing/band_to_mesh.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/support/tolerance_runs.h"
#include "tests/support/true_error.h"

namespace tolerance_test {

using Json = nlohmann::json;
using levelset::UsageError;
using support::runToTolerance;
using support::V3d;

std::filesystem::path modelPath(const char* name) {
  return std::filesystem::path(LEVELSMITH_DATA_DIR) / "models" / name;
}

/// Counts how often the true error is below a tenth of the requested tolerance.
class Tally {
 public:
  void add(const support::ToleranceRun& run, double truth) {
    ASSERT_EQ(run.exitCode, 0) << run.refusal;
    EXPECT_LE(truth, run.output().requested) << run.told().written;
    EXPECT_LE(run.output().achieved, run.output().requested);
    EXPECT_TRUE(run.told().isReached());
    ++all_;
    if (truth < run.output().requested / 10) ++low_;
  }
  [[nodiscard]] bool mostAreNear() const { return 2 * low_ < all_; }

 private:
  int all_ = 0, low_ = 0;
};

TEST(Tolerance, IsMetBySphereAndTorus) {
  Tally tally;
  for (const char* asked : {"2%", "0.5%", "0.1%", "0.02", "0.003"}) {
    const support::ToleranceRun ball = runToTolerance(asked, "sphere --radius 1 ! mesh");
    tally.add(ball, support::trueError(ball.mesh, support::exactSphere(1)));
    const support::ToleranceRun ring = runToTolerance(asked, "torus --radius 2 --tube 0.5 ! mesh");
    tally.add(ring, support::trueError(ring.mesh, support::exactTorus(2, 0.5)));
  }
  EXPECT_TRUE(tally.mostAreNear());
}

TEST(Tolerance, IsMetByChainsOfOperators) {
  Tally tally;
  for (const char* asked : {"1%", "0.2%"}) {
    const support::ToleranceRun grown =
        runToTolerance(asked, "sphere --radius 1 ! offset 0.25 ! mesh");
    tally.add(grown, support::trueError(grown.mesh, support::exactSphere(1.25)));
    for (const std::string chain :
         {"sphere --radius 1 HERE ! sphere --radius 0.7 --center 1,0.2,0.1 HERE ! blend --radius "
          "0.3 ! mesh",
          "torus --radius 1 --tube 0.4 HERE ! smooth --sigma 0.1 ! mesh"}) {
      const auto with = [&](const std::string& voxel) {
        std::string text = chain;
        for (std::size_t at = 0; (at = text.find("HERE", at)) != std::string::npos;)
          text.replace(at, 4, voxel);
        return text;
      };
      const support::ToleranceRun run = runToTolerance(asked, with(""));
      const double fine = run.told().voxelSize / 4;
      tally.add(run, support::differenceOf(
                         run.mesh, support::meshOf(with("--voxel " + std::to_string(fine))), fine));
    }
  }
  EXPECT_TRUE(tally.mostAreNear());
}

TEST(Tolerance, HoldsForTheZeroSetOfALevelSetToo) {
  const support::TemporaryFolder folder;
  const std::string file = (folder / "ball.vdb").string();
  const pipeline::RunReport report =
      support::runWords("--tolerance 0.004 sphere --radius 1 ! write " + file);
  const levelset::NarrowBand band = levelset::readBand(file);
  EXPECT_DOUBLE_EQ(band.voxelSize(), report.tolerance->voxelSize);
  const levelset::BandSampler phi(band);
  double worst = 0;
  for (const V3d& normal : support::exactSphere(1).points) {
    double in = 0.8, out = 1.2;
    while (out - in > 1e-9) (phi.value(normal * ((in + out) / 2)) < 0 ? in : out) = (in + out) / 2;
    worst = std::max(worst, std::abs(in - 1));
  }
  EXPECT_LE(worst, support::measured(8.71e-4));
  EXPECT_GE(worst, 0.0004);
}

TEST(Tolerance, IsMetByTheBunny) {
  const std::filesystem::path file = modelPath("bunny.obj");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no models";
  const levelset::TriMesh exact = levelset::readMesh(file);
  Tally tally;
  for (const char* asked : {"2%", "0.5%"}) {
    const support::ToleranceRun run =
        runToTolerance(asked, "read " + file.string() + " ! level-set ! mesh");
    tally.add(run, support::differenceOf(run.mesh, exact, run.told().voxelSize / 2));
    EXPECT_TRUE(run.output().isMeasured);
  }
  EXPECT_TRUE(tally.mostAreNear());
}

/// Compares with the same chain at a quarter of the voxel size.
/// @param chain  HERE stands for the voxel size
void addAgainstFinerRun(const std::string& asked, const std::string& chain, Tally& tally) {
  const auto with = [&](const std::string& voxel) {
    return std::string(chain).replace(chain.find("HERE"), 4, voxel);
  };
  const support::ToleranceRun run = runToTolerance(asked, with(""));
  const double fine = run.told().voxelSize / 4;
  tally.add(run, support::differenceOf(
                     run.mesh, support::meshOf(with("--voxel " + std::to_string(fine))), fine));
}

TEST(SlowTolerance, IsMetByTheBunnyFinely) {
  const std::filesystem::path file = modelPath("bunny.obj");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no models";
  Tally tally;
  const support::ToleranceRun run =
      runToTolerance("0.1%", "read " + file.string() + " ! level-set ! mesh");
  tally.add(run,
            support::differenceOf(run.mesh, levelset::readMesh(file), run.told().voxelSize / 2));
  // An offset has no exact mesh.
  addAgainstFinerRun("1%", "read " + file.string() + " ! level-set HERE ! offset 1% ! mesh", tally);
  EXPECT_TRUE(tally.mostAreNear());
}

// Its mesh has parts inside the solid, so that a finer run serves as truth.
TEST(SlowTolerance, IsMetByTheDragon) {
  const std::filesystem::path file = modelPath("dragon_vrip_res4.ply.gz");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no models";
  Tally tally;
  for (const char* asked : {"5%", "2%"})
    addAgainstFinerRun(asked, "read " + file.string() + " ! level-set HERE ! mesh", tally);
  EXPECT_TRUE(tally.mostAreNear());
}

TEST(Tolerance, SeparatesErrorsAtCreases) {
  const support::ToleranceRun box = runToTolerance("0.01", "box --size 2,1.5,1.1 ! mesh");
  ASSERT_EQ(box.exitCode, 0) << box.refusal;
  const double h = box.told().voxelSize;
  EXPECT_LE(h, 0.04);  // smaller than the flat faces alone would require
  EXPECT_LT(box.output().achieved, support::measured(6.55e-10));
  EXPECT_GT(box.output().crease, 0.1 * h);
  EXPECT_LT(box.output().crease, 2 * h);
  EXPECT_GT(box.output().creaseShare, 0);
  EXPECT_LT(support::trueError(box.mesh, support::exactBoxFaces(V3d(2, 1.5, 1.1), 2 * h)),
            support::doubleRounding(1));

  const support::ToleranceRun pair = runToTolerance(
      "0.01", "sphere --radius 1 ! sphere --radius 1 --center 1.2,0,0 ! union ! mesh");
  ASSERT_EQ(pair.exitCode, 0) << pair.refusal;
  double worst = 0;  // largest error of the triangles away from the seam
  for (const V3d& p : pair.mesh.positions)
    if (std::abs(p.x - 0.6) > 3 * pair.told().voxelSize)
      worst = std::max(worst, std::abs(std::min(p.length(), (p - V3d(1.2, 0, 0)).length()) - 1));
  EXPECT_LE(worst, support::measured(1.92e-4));
  EXPECT_GT(pair.output().crease, 0);
}

TEST(Tolerance, OfAMeshIsMeasuredAgainstIt) {
  const support::TemporaryFolder folder;
  const std::string file = (folder / "cube.off").string();
  support::writeText(file,
                     "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                     "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  const std::string chain = "read " + file + " ! level-set ! mesh";
  // Includes its edges, within the memory limit.
  const support::ToleranceRun whole = runToTolerance("0.01", chain);
  ASSERT_EQ(whole.exitCode, 0) << whole.refusal;
  EXPECT_TRUE(whole.output().isMeasured);
  EXPECT_LE(support::differenceOf(whole.mesh, levelset::readMesh(file), whole.told().voxelSize / 2),
            support::measured(0.00726, 0.01));
  pipeline::RunSettings settings;
  settings.maxMemory = std::size_t{180} << 20;
  const support::ToleranceRun flat = runToTolerance("0.0005", chain, settings);
  EXPECT_EQ(flat.exitCode, 0) << flat.refusal;
  EXPECT_FALSE(flat.output().isMeasured);
  EXPECT_GT(flat.output().crease, 0.0005);
}

TEST(Tolerance, IncludesTheErrorOfDecimation) {
  const std::string solid = "sphere --radius 1 ! mesh";
  const support::ToleranceRun uniform = runToTolerance("0.01", solid),
                              adaptive = runToTolerance("0.01", solid + " --adaptivity 0.5");
  ASSERT_EQ(adaptive.exitCode, 0) << adaptive.refusal;
  EXPECT_LE(support::trueError(adaptive.mesh, support::exactSphere(1)), support::measured(0.00218));
  EXPECT_LE(adaptive.told().voxelSize, uniform.told().voxelSize);
}

TEST(Tolerance, KeepsGivenVoxelSizes) {
  const support::TemporaryFolder folder;
  const std::string file = (folder / "both.ply").string();
  const pipeline::RunReport report = support::runWords(
      "--tolerance 0.02 sphere --radius 1 ! sphere --radius 1 --center 3,0,0 --voxel 0.05 ! union "
      "! mesh ! write " +
      file);
  EXPECT_EQ(report.steps.at(1).parameters.at("voxel"), "0.05");
  EXPECT_NE(report.steps.at(0).parameters.at("voxel"), "0.05");
  EXPECT_TRUE(report.tolerance->isReached());

  const support::ToleranceRun limited = runToTolerance(
      "0.001", "sphere --radius 1 ! sphere --radius 1 --center 3,0,0 --voxel 0.3 ! union ! mesh");
  EXPECT_EQ(limited.exitCode, 5);
  EXPECT_SAYS(limited.refusal, "--voxel 0.3");
}

TEST(Tolerance, KeepsTheBestResultIfUnreachable) {
  pipeline::RunSettings settings;
  settings.maxMemory = std::size_t{200} << 20;
  const support::ToleranceRun run = runToTolerance("1e-6", "sphere --radius 1 ! mesh", settings);
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_FALSE(run.mesh.isEmpty());
  EXPECT_SAYS(run.refusal, "--max-memory");
  EXPECT_SAYS(run.refusal, "1e-06 was requested");
  EXPECT_FALSE(run.told().isReached());
  const double truth = support::trueError(run.mesh, support::exactSphere(1));
  EXPECT_LE(truth, run.output().achieved);
  EXPECT_GE(truth, run.output().achieved / 5);
}

TEST(Tolerance, HasTheSameBitsForAnyNumberOfThreads) {
  const auto points = [] {
    return runToTolerance("0.3%", "torus --radius 1 --tube 0.4 ! smooth --sigma 0.05 ! mesh")
        .mesh.positions;
  };
  EXPECT_EQ(support::onThreads(1, points), support::onThreads(4, points));
}

std::string refusalOf(const std::string& line) {
  return support::refusal<UsageError>([&] { (void)support::runWords(line); });
}

TEST(Tolerance, Refuses) {
  const std::string rest = " sphere --radius 1 ! measure";
  EXPECT_SAYS(refusalOf("--tolerance 0" + rest), "must be positive");
  EXPECT_SAYS(refusalOf("--tolerance=-1" + rest), "must be positive");
  EXPECT_SAYS(refusalOf("--tolerance nan" + rest), "--tolerance");
  EXPECT_SAYS(refusalOf("--tolerance 2vx" + rest), "in voxels");
  EXPECT_SAYS(refusalOf("--tolerance 0.1 sphere --radius 1 --voxel 0.1 ! measure"),
              "every action has a voxel size already");
  EXPECT_SAYS(refusalOf("--tolerance 0.1 sphere --radius 10vx ! measure"), "is a length in voxels");
  EXPECT_SAYS(refusalOf("sphere --radius 1 ! measure"), "needs a voxel size");
  EXPECT_SAYS(refusalOf("--tolerance 0.1 sphere --radius 1 --voxel 0.1 --resolution 3 ! measure"),
              "give only one");
  EXPECT_SAYS(refusalOf("--tolerance 0.1 sphere --radius 1 ! box --size 1,1,1 ! morph "
                        "--keep-steps a_##.vdb ! measure"),
              "writes files while it computes its result");
  EXPECT_SAYS(refusalOf("--tolerance 0.1 sphere --radius 1 ! reinitialize --method pde ! measure"),
              "--method pde has no bound of its error");
  EXPECT_SAYS(
      refusalOf("--tolerance 0.1 sphere --radius 1 ! box --size 1,1,1 ! morph --method speed "
                "! measure"),
      "--method speed has no bound of its error");
}

TEST(Tolerance, IsStoredInTheGraph) {
  const pipeline::Graph graph =
      pipeline::parseChain(support::wordsOf("--tolerance 0.5% sphere --radius 1 ! measure"));
  const std::string json = pipeline::graphJson(graph);
  EXPECT_EQ(Json::parse(json)["tolerance"], "0.5%");
  const pipeline::Graph again = pipeline::graphFromJson(json, "g.json");
  EXPECT_EQ(again.globals.at("tolerance"), "0.5%");
  EXPECT_EQ(pipeline::graphJson(again), json);
  EXPECT_TRUE(again.nodes.at(0).voxelFollows);
  EXPECT_EQ(pipeline::graphFromJson(json, "g.json", {{"tolerance", "0.1"}}).globals.at("tolerance"),
            "0.1");
  EXPECT_SAYS(support::refusal<UsageError>([] {
                (void)pipeline::graphFromJson(
                    R"({"format": "levelsmith graph", "version": 1, "tolerance": -1,
                        "nodes": [{"op": "sphere", "options": {"radius": 1}}]})",
                    "g.json");
              }),
              "must be positive");
}

TEST(ErrorModels, NameCasesOfTheRegressionSuite) {
  for (const char* action : {"sphere", "level-set", "union", "offset", "smooth", "mesh"}) {
    const pipeline::Operator* op = pipeline::findOperator(action);
    ASSERT_TRUE(op) << action;
    EXPECT_TRUE(op->errorModel) << action;
    EXPECT_STRNE(pipeline::errorModel(*op).source, "") << action;
  }
  EXPECT_EQ(pipeline::errorModel(*pipeline::findOperator("texture")).order, 1);
}

TEST(ErrorModels, PickTheFirstVoxelSize) {
  const pipeline::Graph graph = pipeline::parseChain(
      support::wordsOf("--tolerance 0.01 sphere --radius 4 ! torus --radius 4 --tube 1 ! union"));
  // 0.35 h²/R, a measured constant.
  EXPECT_NEAR(pipeline::modelVoxelSize(graph.nodes[0], 0.01), std::sqrt(0.01 * 4 / 0.35),
              support::doubleRounding(4));
  EXPECT_NEAR(pipeline::modelVoxelSize(graph.nodes[1], 0.01), std::sqrt(0.01 / 0.35),
              support::doubleRounding(4));
  EXPECT_EQ(pipeline::modelVoxelSize(graph.nodes[2], 0.01), 0);  // no radius is known
}

class ToleranceCommand : public support::ShellTest {};

TEST_F(ToleranceCommand, ReportsItsSteps) {
  const auto outcome = levelsmith(
      "-v --report r.json --tolerance 0.3% torus --radius 1 --tube 0.3 --as ring ! offset @ring "
      "0.1 --as fat ! write @ring a.vdb ! write @fat b.vdb ! measure @fat");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("requested"), std::string::npos) << outcome.err;
  EXPECT_TRUE(exists("a.vdb") && exists("b.vdb"));
  const Json report = Json::parse(support::slurp(folder_ / "r.json"));
  const Json& tolerance = report["tolerance"];
  EXPECT_EQ(tolerance["written"], "0.3%");
  EXPECT_EQ(tolerance["reached"], true);
  ASSERT_EQ(tolerance["outputs"].size(), 2u);
  EXPECT_EQ(tolerance["outputs"][0]["name"], "@ring");
  EXPECT_EQ(tolerance["outputs"][1]["name"], "@fat");
  for (const Json& output : tolerance["outputs"])
    EXPECT_LE(output["achieved"].get<double>(), output["requested"].get<double>());
  EXPECT_GE(tolerance["rounds"].size(), 1u);
  EXPECT_GT(tolerance["model_voxel_size"], 0);
  EXPECT_EQ(report["graph"]["tolerance"], "0.3%");
  ASSERT_EQ(report["steps"].size(), 5u);
  EXPECT_EQ(report["steps"][0]["action"], "torus");
  EXPECT_DOUBLE_EQ(report["steps"][0]["result"]["voxel_size"], tolerance["voxel_size"]);
}

TEST_F(ToleranceCommand, RunsScriptsAndGraphs) {
  support::writeText(folder_ / "ball.txt", "--tolerance 0.02\nsphere --radius 1\nwrite ball.vdb\n");
  EXPECT_EQ(levelsmith("run ball.txt").code, 0);
  EXPECT_TRUE(exists("ball.vdb"));
  EXPECT_EQ(levelsmith("--save-graph g.json --dry-run run ball.txt").code, 0);
  EXPECT_EQ(levelsmith("run g.json").code, 0);
  const auto open = levelsmith("sphere --radius 1 ! measure");
  EXPECT_EQ(open.code, 2);
  EXPECT_NE(open.err.find("--tolerance"), std::string::npos) << open.err;
}

TEST_F(ToleranceCommand, ReportsTheModelsChoiceInADryRun) {
  const auto told = levelsmith("--dry-run --tolerance 0.1% sphere --radius 1 ! write no.vdb");
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_NE(told.err.find("the error models choose voxels of"), std::string::npos) << told.err;
  EXPECT_FALSE(exists("no.vdb"));
}

TEST_F(ToleranceCommand, ExitsWithFiveAndTheBestResultIfMemoryIsShort) {
  const auto outcome = levelsmith(
      "--max-memory 150M --report r.json --tolerance 1e-7 sphere --radius 1 ! write best.vdb");
  EXPECT_EQ(outcome.code, 5) << outcome.err;
  EXPECT_TRUE(exists("best.vdb"));
  EXPECT_NE(outcome.err.find("was requested"), std::string::npos) << outcome.err;
  const Json report = Json::parse(support::slurp(folder_ / "r.json"));
  EXPECT_EQ(report["exit_code"], 5);
  EXPECT_EQ(report["tolerance"]["reached"], false);
  EXPECT_NE(report["tolerance"]["limit"].get<std::string>(), "");
}

TEST_F(ToleranceCommand, ReadsStandardInputOnce) {
  EXPECT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! mesh ! write ball.ply").code, 0);
  const auto outcome =
      levelsmith("--tolerance 1% read - --format ply ! level-set ! write again.vdb < ball.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(exists("again.vdb"));
}

TEST_F(ToleranceCommand, TakesKnownResultsFromACache) {
  const std::string line = "--cache kept --tolerance 1% torus --radius 1 --tube 0.4 ! write t.vdb";
  EXPECT_EQ(levelsmith(line).code, 0);
  const std::string first = support::slurp(folder_ / "t.vdb");
  EXPECT_EQ(levelsmith(line).code, 0);
  EXPECT_EQ(support::slurp(folder_ / "t.vdb"), first);
}

TEST_F(ToleranceCommand, DoesNotOverwriteUnderNoClobber) {
  support::writeText(folder_ / "there.vdb", "mine");
  EXPECT_EQ(levelsmith("--no-clobber --tolerance 1% sphere --radius 1 ! write there.vdb").code, 6);
  EXPECT_EQ(support::slurp(folder_ / "there.vdb"), "mine");
}

}  // namespace tolerance_test
