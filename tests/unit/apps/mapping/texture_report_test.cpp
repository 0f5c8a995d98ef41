// Contents of --report for patches, textures on them, and folds.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command_line.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace texture_report_test {

using nlohmann::json;

const std::string kBall = "sphere --radius 10 --voxel 0.5 --as b ! ";
const std::string kRing = "torus --radius 4 --tube 1.5 --voxel 0.5 --as t ! ";

class TextureReport : public support::ShellTest {
 protected:
  /// Details of the last step that has any. `warnings` and `notes` contain its messages.
  json detailsOf(const std::string& chain) {
    const auto outcome = levelsmith("--report r.json " + chain);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    said = outcome.err;
    report = json::parse(support::slurp(folder_ / "r.json"));
    json details;
    for (const json& step : report["steps"])
      if (step.contains("details")) details = step["details"];
    return details;
  }
  static std::string patch(const std::string& options) {
    return "patch @b --at 0,0,10 --size 8,8 --as p " + options + " ! ";
  }
  std::string said;
  json report;
};

void expectSpread(const json& spread) {
  EXPECT_LE(spread["min"], spread["percent_1"]);
  EXPECT_LE(spread["percent_1"], spread["median"]);
  EXPECT_LE(spread["median"], spread["percent_99"]);
  EXPECT_LE(spread["percent_99"], spread["max"]);
  EXPECT_GT(spread["median"], 0);
}

TEST_F(TextureReport, ReportsDistortionCostAndErrorOfEachMap) {
  for (const std::string map : {"rbf", "shell"}) {
    const json details =
        detailsOf(kBall + patch("--height 3 --levels 4") + kRing + "texture @b @t @p --map " + map);
    expectSpread(details["jacobian"]);
    expectSpread(details["stretch"]);
    EXPECT_EQ(details["folded"], 0) << map;
    EXPECT_EQ(details["certificate"]["verdict"], "certified") << map;
    for (const char* part : {"setup", "certificate", "mapping", "distance", "merging"})
      EXPECT_GE(details["cpu_s"][part], 0) << part;
    EXPECT_FALSE(details.contains("improvement_cpu_s"));
    if (map != "rbf") continue;
    EXPECT_GT(details["map_error_points"], 10);
    EXPECT_GT(details["map_error"], 0);
    EXPECT_LE(details["map_error"], 0.05);
    EXPECT_LE(details["solve_residual"], 0.01);
  }
}

TEST_F(TextureReport, ReportsTheGainOfRelaxation) {
  const json details = detailsOf(kBall + patch("--height 4 --levels 3") + kRing +
                                 "texture @b @t @p --relax texture --unfold --map shell");
  EXPECT_LT(details["relax"][0]["after"]["energy"], details["relax"][0]["before"]["energy"]);
  EXPECT_GT(details["relax"][0]["iterations"], 0);
  EXPECT_EQ(details["unfold"][0]["after"]["folded_cells"], 0);
  EXPECT_GT(details["improvement_cpu_s"], 0);
}

TEST_F(TextureReport, ReportsThatUntanglingFailed) {
  // One side crosses the opposite side on the surface, where both are fixed.
  const json details = detailsOf(
      "box --size 40,40,10 --voxel 0.5 --as b ! patch @b --corners \"-4,-4,5 4,-4,5 4,4,5 "
      "-4,4,5\" --side0 0,7,5 --height 3 --levels 3 --as p ! " +
      kRing + "texture @b @t @p --unfold --allow-folds --map shell --voxel 0.5");
  const json& unfold = details["unfold"][0];
  EXPECT_GT(unfold["after"]["folded_cells"], 0);
  EXPECT_LT(unfold["after"]["folded_cells"], unfold["before"]["folded_cells"]);
  EXPECT_NE(said.find("--untangle cannot remove all folds"), std::string::npos) << said;
}

TEST_F(TextureReport, ReportsTheDistributionOfLengthsWithFolds) {
  for (const char* map :
       {"--map rbf", "--map shell", "--map mesh", "--map rbf --kernel thin-plate"}) {
    const json details =
        detailsOf(kBall + patch("--height 3 --levels 4") + "folds @b @p " + map + " ! info");
    expectSpread(details["jacobian"]);
    expectSpread(details["stretch"]);
    // A patch relative to its own size: its sides keep their lengths on the surface.
    EXPECT_NEAR(details["stretch"]["median"], 1.1, support::measured(0.102)) << map;
    EXPECT_TRUE(details.contains("certificate")) << map;
  }
}

TEST_F(TextureReport, ReportsWhetherPatchesConverged) {
  const json details = detailsOf(kBall + patch("--height 3") + "info");
  EXPECT_EQ(details["relaxed"], true);
  EXPECT_EQ(details["slowed"], 0);
  EXPECT_GT(details["relax_iterations"], 0);
}

}  // namespace texture_report_test
