// Complete graphs with and without regions of interest: equal files, reports and refusals.

#include "apps/pipeline/graph/regions_of_interest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/run/runner.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "render/images/compare_images.h"
#include "render/images/image.h"
#include "tests/support/command_line.h"
#include "tests/support/regions.h"

namespace demand_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;
using levelset::RegionOfInterest;
using pipeline::Graph;
using pipeline::Operator;
using pipeline::Value;
using support::between;
using support::expectSamePart;
using support::pointIn;
using support::text;
using Random = std::mt19937;

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string word; in >> word;) {
    std::replace(word.begin(), word.end(), '_', ' ');  // blank within a word
    all.push_back(word);
  }
  return all;
}

class Demands : public support::ShellTest {
 protected:
  pipeline::RunReport run(const std::string& chain, bool whole) {
    pipeline::RunReport report;
    const auto silent = [](const std::string&) {};
    pipeline::run(pipeline::parseChain(words(chain)),
                  {.fullValues = whole, .print = silent, .warn = silent, .note = silent}, report);
    return report;
  }
  std::string path(const char* name) { return (folder_ / name).string(); }

  /// Runs the chain with and without regions of interest.
  /// @param tolerance  of values, voxels; 0: equal bytes
  /// @return report of the run with regions of interest
  pipeline::RunReport expectSame(const std::string& chain, const char* extension,
                                 double tolerance = 0) {
    const std::string part = path("part") + extension, whole = path("whole") + extension;
    std::string failure, wholeFailure;
    const auto attempt = [&](const std::string& file, bool isWhole, std::string& error) {
      try {
        return run(chain + " ! write " + file, isWhole);
      } catch (const levelset::Error& refusal) {
        error = refusal.what();
        return pipeline::RunReport{};
      }
    };
    attempt(whole, true, wholeFailure);
    pipeline::RunReport report = attempt(part, false, failure);
    EXPECT_EQ(failure, wholeFailure) << chain;
    if (failure.empty() && tolerance > 0) {
      expectSamePart(levelset::readBand(whole), levelset::readBand(part), {}, tolerance, chain);
    } else if (failure.empty()) {
      EXPECT_TRUE(support::slurp(part) == support::slurp(whole)) << chain;
    }
    return report;
  }

  /// Compares random graphs with and without regions of interest, for the seeds from `first` to
  /// `end`.
  void expectSameGraphs(unsigned first, unsigned end) {
    for (unsigned seed = first; seed < end; ++seed) {
      Random random(seed);
      std::string chain;
      int made = 0;
      const auto leaf = [&] {
        const std::string rest = " --voxel 0.1 --half-width " +
                                 std::to_string(between(random, 3, 9)) + " --as v" +
                                 std::to_string(made++) + " ! ";
        if (random() % 2)
          return "sphere --radius " + std::to_string(between(random, 0.8, 2)) + " --center " +
                 text(pointIn(random, 1)) + rest;
        return "box --size " + text(V3d(1.5) + pointIn(random, 1)) + " --center " +
               text(pointIn(random, 1)) + rest;
      };
      const auto any = [&] {
        return " @v" + std::to_string(random() % static_cast<unsigned>(made));
      };
      chain += leaf() + leaf() + leaf();
      for (int i = 0; i < 4; ++i) {
        const char* const ops[] = {"union",  "difference", "intersection", "transform",   "offset",
                                   "smooth", "open",       "shell",        "reinitialize"};
        // Every other graph is compared to the bit.
        const std::string op = ops[random() % (seed % 2 ? 9 : 4)];
        std::string step = op;
        const std::string length = " " + std::to_string(between(random, 0.11, 0.25));
        if (op == "offset")
          step += " " + std::to_string(between(random, -0.2, 0.6)) + any();
        else if (op == "smooth")
          step += any() + " --sigma" + length;
        else if (op == "shell")
          step += any() + " --thickness" + length;
        else if (op == "open")
          step += length + any();
        else if (op == "reinitialize")
          step += any();
        else if (op == "transform")
          step += any() + " --translate " + text(V3d(0.1) * static_cast<double>(random() % 5));
        else
          step += any() + any();
        chain += step + " --as v" + std::to_string(made++) + " ! ";
      }
      const V3d low = pointIn(random, 1);
      const Box3d box(low, low + V3d(1.1, 0.9, 1.3));
      const bool isExact = seed % 2 == 0;
      chain +=
          "clip @v" + std::to_string(made - 1) + " --box " + text(box.min) + "_" + text(box.max);
      if (!isExact)
        expectSame(chain, ".vdb", 1e-5);
      else if (random() % 2)
        expectSame(chain + " ! mesh", ".ply");
      else
        expectSame(chain, ".vdb");
    }
  }
};

TEST_F(Demands, OffsetAndClipRequestTheBoxAndTheBandTheyRead) {
  const pipeline::RunReport report = expectSame(
      "sphere --radius 2 --voxel 0.05 --half-width 20 ! offset 0.5 ! clip --box "
      "1.5,-0.5,-0.5_3,0.5,0.5 ! mesh",
      ".ply");
  ASSERT_EQ(report.steps.size(), 5u);
  EXPECT_EQ(report.steps[0].halfWidth, 6);
  const double rim = (20 + 2) * 0.05;  // voxels of the band; a seam reads all of them
  EXPECT_EQ(report.steps[1].roi.region,
            Box3d(V3d(1.5, -0.5, -0.5) - V3d(rim), V3d(3, 0.5, 0.5) + V3d(rim)));
  EXPECT_EQ(report.steps[2].halfWidth, 1.5);
  EXPECT_TRUE(report.steps[3].roi.isWhole());
  const pipeline::RunReport whole = run("sphere --radius 2 --voxel 0.05 --half-width 20", true);
  EXPECT_LT(report.steps[0].activeVoxels, 0.3 * whole.steps[0].activeVoxels);
}

TEST_F(Demands, ValuesWithoutSurfaceInTheBoxAreComputedCompletely) {
  // The box lies inside the ball. It contains no surface, but it is inside.
  expectSame("sphere --radius 2 --voxel 0.1 ! clip --box -0.5,-0.5,-0.5_0.5,0.5,0.5 ! mesh",
             ".ply");
  expectSame("sphere --radius 2 --voxel 0.1 ! offset 0.3 ! clip --box -1,-1,-1_1,1,1 ! mesh",
             ".ply");
  expectSame("sphere --radius 2 --voxel 0.1 ! clip --box 5,5,5_6,6,6 ! mesh", ".ply");
}

TEST_F(Demands, RegionsOfLargeSolidsKeepTheirInsides) {
  // At the end of a region, tree nodes without band voxels contain both sides.
  for (const char* chain :
       {"sphere --radius 3 --voxel 0.05 ! clip --box -2,-2,-2_4,2,2 ! clip --box "
        "-1,-1,-1_4.2,1,1 ! mesh",
        "sphere --radius 3 --voxel 0.05 ! clip --plane 0,0,-2.9_0,0,-1 ! clip --box "
        "-1,-1,-1_3.2,1,1 ! mesh",
        "sphere --radius 3 --voxel 0.05 ! sphere --radius 1 --center 3,0,0 --voxel 0.05 ! "
        "difference ! clip --box -1,-1,-1_4.2,1,1 ! mesh",
        "sphere --radius 1.532 --center 0.331,0.509,0.511 --voxel 0.1 --as a ! sphere --radius "
        "1.564 --center 0.981,-0.494,0.622 --voxel 0.1 --as b ! union @a @b ! clip --box "
        "-0.8,-0.3,-0.3_0.3,0.4,0.3 ! mesh"}) {
    const pipeline::RunReport report = expectSame(chain, ".ply");
    EXPECT_TRUE(std::any_of(report.steps.begin(), report.steps.end(), [](const auto& step) {
      return !step.roi.isWhole();
    })) << chain;
  }
}

TEST_F(Demands, RegionsThatEndInsideTheSolidKeepTheirSigns) {
  // OpenVDB's union flood-fills signs from the origin of a node of 128³, which may be at the end of
  // a region.
  const std::string rod = "capsule --from .4,-9,.4 --to .4,12,.4 --radius .8 --voxel .1 ! ",
                    clip = "clip --box -1,6,-1_6,7,3";
  for (const char* action :
       {"open .15", "close .15", "offset .1", "shell --thickness .3", "smooth --sigma .1",
        "reinitialize", "resample --voxel .08", "transform --rotate 20 --bake"}) {
    expectSame(rod + action + " ! " + clip, ".vdb", 1e-4);
    expectSame("box --size 5,26,5 --voxel .1 ! " + rod + "difference ! " + action + " ! " + clip,
               ".vdb", 1e-4);
  }
  expectSame(
      "torus --radius 4 --tube 0.4 --voxel 0.1 ! open 0.15 ! clip --box 3,0,0_5,.4,.4 ! mesh",
      ".ply");
}

TEST_F(Demands, MeshesHaveTheSameTrianglesInTheSameOrder) {
  Random random(4);
  for (int i = 0; i < 25; ++i)
    expectSame("sphere --radius " + std::to_string(between(random, 0.5, 2)) + " --center " +
                   text(pointIn(random, 1)) + " --voxel 0.1 ! mesh",
               ".ply");
}

TEST_F(Demands, OpenMeshesAreConvertedCompletely) {
  std::ofstream file(path("open.off"));
  constexpr int kRows = 16, kColumns = 32, kTop = 10;  // a ball without its cap
  file << "OFF\n" << (kTop + 1) * kColumns << " " << 2 * kTop * kColumns << " 0\n";
  for (int r = 0; r <= kTop; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const double a = std::numbers::pi * (kRows - r) / kRows,
                   b = 2 * std::numbers::pi * c / kColumns;
      file << std::sin(a) * std::cos(b) << " " << std::sin(a) * std::sin(b) << " " << std::cos(a)
           << "\n";
    }
  for (int r = 0; r < kTop; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const int next = (c + 1) % kColumns, low = r * kColumns, high = low + kColumns;
      file << "3 " << low + c << " " << low + next << " " << high + next << "\n";
      file << "3 " << low + c << " " << high + next << " " << high + c << "\n";
    }
  file.close();
  const std::string made =
      "read " + path("open.off") + " ! level-set --sign-anyway --voxel 0.05 ! ";
  expectSame(made + "mesh", ".ply");
  expectSame(made + "clip --box -0.5,-0.5,-2_0.5,0.5,0.5 ! mesh", ".ply");
}

TEST_F(Demands, PicturesRequestTheVisibleRegion) {
  const std::string solid = "torus --radius 2 --tube 0.6 --voxel 0.05 ! ",
                    view = " --from 2,0.1,6 --to 2.1,0,0 --fov 9 --size 160x120 --samples 2 ";
  const auto draw = [&](const char* name, const std::string& look, bool whole) {
    return run(solid + "render " + path(name) + view + look, whole);
  };
  const auto shareMade = [&](const std::string& look) {
    const auto part = draw("part.exr", look, false), whole = draw("whole.exr", look, true);
    // The kernel's coordinates start at its tables, which affects the last bits.
    const bool isExact = look.find("embree") != std::string::npos;
    const render::ImageComparison found = render::compareImages(
        render::readExr(path("part.exr")), render::readExr(path("whole.exr")), {.exact = isExact});
    EXPECT_TRUE(found.agrees()) << look << ": " << found.reason();
    EXPECT_GT(found.bothHit, 1000u) << look;
    return part.steps[0].activeVoxels / whole.steps[0].activeVoxels;
  };
  for (const char* look :
       {"--style tone", "--style tone --renderer embree", "--style ink --curvature-range 3",
        "--style tone --ortho 0.5 --renderer cpu",
        "--style ink --curvature-range 3 --filter bspline-qi --renderer cpu"})
    EXPECT_LT(shareMade(look), 0.25) << look;
  // These depend on the size of the complete solid, or on light from beside the frame.
  for (const char* look : {"--style ink", "--style mean --curvature-range 3", "",
                           "--style tone --value-bits 16 --renderer cpu"})
    EXPECT_EQ(shareMade(look), 1) << look;
}

TEST_F(Demands, ErrorsAreMeasuredInsideTheBandOnly) {
  const std::string chain = " torus --radius 2 --tube 0.6 --voxel 0.1 ! mesh ! write t.ply";
  const auto errorsOf = [&](const std::string& options) {
    EXPECT_EQ(levelsmith("--report r.json " + options + chain).code, 0);
    const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
    return std::vector{report["steps"][0]["errors"], report["steps"][1]["errors"]};
  };
  const auto part = errorsOf(""), whole = errorsOf("--whole");
  EXPECT_EQ(part, whole);
  EXPECT_GT(part[0][0]["value"], 0);
}

TEST_F(Demands, PlansAreRefusedAndReportedBeforeTheRun) {
  const std::string needle =
      "sphere --radius 2 --voxel 0.002 ! clip --box \"1.9,-0.05,-0.05 2.1,0.05,0.05\" ! write "
      "a.vdb";
  // The complete solid would take more than a GB.
  const auto told = levelsmith("--max-memory 200M --explain " + needle);
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_NE(told.out.find("; only 1.8"), std::string::npos) << told.out;
  EXPECT_FALSE(exists("a.vdb"));
  EXPECT_EQ(levelsmith("--max-memory 200M " + needle).code, 0);
  EXPECT_TRUE(exists("a.vdb"));
  EXPECT_EQ(levelsmith("--max-memory 200M --whole " + needle).code, 4);

  // A mesh has a region of interest too.
  ASSERT_EQ(levelsmith("sphere --radius 2 --voxel 0.1 ! mesh ! write s.ply").code, 0);
  const std::string part =
      "read s.ply ! level-set --voxel 0.003 ! clip --box \"1.9,-0.05,-0.05 2.1,0.05,0.05\" ! write "
      "b.vdb";
  EXPECT_EQ(levelsmith("--max-memory 250M " + part).code, 0);
  EXPECT_EQ(levelsmith("--max-memory 250M --whole " + part).code, 4);

  const std::string late =
      "sphere --radius 1 --voxel 0.05 ! write first.vdb ! resample --voxel 0.002 ! write "
      "second.vdb";
  for (const char* option : {"", "--whole ", "--cache c "}) {
    EXPECT_EQ(levelsmith(std::string("--max-memory 60M ") + option + late).code, 4);
    EXPECT_FALSE(exists("first.vdb")) << option;
  }
  const auto refused = levelsmith("--max-memory 60M --explain " + late);
  EXPECT_EQ(refused.code, 4);
  EXPECT_NE(refused.out.find("writes second.vdb"), std::string::npos) << refused.out;

  const std::string held =
      "sphere --radius 1 --voxel 0.005 --as a ! sphere --radius 1.1 --voxel 0.005 --as b ! sphere "
      "--radius 1.2 --voxel 0.005 --as c ! union @a @b @c ! write u.vdb";
  const auto atOnce = levelsmith("--explain --max-memory 140M " + held);
  EXPECT_EQ(atOnce.code, 4) << atOnce.out;
  EXPECT_NE(atOnce.err.find("held beside it"), std::string::npos) << atOnce.err;

  EXPECT_EQ(levelsmith("--explain sphere --radius 1 --voxel 3 ! mesh").code,
            levelsmith("sphere --radius 1 --voxel 3 ! mesh").code);
  EXPECT_EQ(levelsmith("--explain read nothere.vdb ! mesh").code, 6);
  EXPECT_EQ(levelsmith("--explain --tolerance 1% sphere --radius 1 ! measure").code, 2);
  EXPECT_EQ(levelsmith("--explain --report r.json sphere --radius 1 --voxel 0.1").code, 2);
  EXPECT_FALSE(exists("r.json"));
}

TEST_F(Demands, PlansReportTheMemoryOfActions) {
  // Actions on a region take less memory. Actions that read their complete operand take the same.
  const auto plan = [&](const std::string& chain) {
    const auto told = levelsmith("--explain " + chain);
    EXPECT_EQ(told.code, 0) << told.err;
    return told.out;
  };
  const auto figure = [](const std::string& text, const std::string& action,
                         const std::string& before) {
    const std::size_t row = text.find("\n" + action), end = text.find('\n', row + 1),
                      at = text.find(before, row);
    return row < at && at < end ? std::stod(text.substr(at + before.size())) : -1.0;
  };
  const std::string solid = "torus --radius 2 --tube 0.6 --voxel 0.02 ! ",
                    end = "clip --box \"1.5,-1,-1 3,1,1\" ! write o.vdb";
  for (const char* action : {"smooth --sigma 2vx", "offset 0.1", "open 0.1", "shell --thickness .2",
                             "resample --voxel .02", "rebuild-band --half-width 9",
                             "curvature-flow 0.01", "keep --largest 1"}) {
    const std::string name = std::string(action).substr(0, std::string(action).find(' '));
    const std::string whole = plan("--whole " + solid + action + " ! " + end),
                      part = plan(solid + action + " ! " + end);
    EXPECT_GT(figure(whole, name, " MB; "), 0.05) << whole;
    EXPECT_GT(figure(whole, name, "working memory "), 5) << whole;
    const bool isWhole = name == "curvature-flow" || name == "keep";
    for (const char* before : {" MB; ", "working memory "}) {
      const double of = figure(whole, name, before), is = figure(part, name, before);
      EXPECT_TRUE(isWhole ? is == of : is < 0.5 * of) << before << ": " << is << " of " << of;
    }
    EXPECT_EQ(whole.find("unknown"), std::string::npos) << whole;
  }
  const std::string untimed =
      plan(solid + "sphere --radius 1 --center 2,0,0 --voxel 0.02 ! blend --radius 0.2 ! measure");
  EXPECT_NE(untimed.find("plus blend,"), std::string::npos) << untimed;
  const std::string masked = plan(solid + "open 0.1 --mask x ! mesh --sharp ! measure");
  EXPECT_NE(masked.find("plus open,"), std::string::npos) << masked;
  EXPECT_GT(figure(masked, "mesh", " MB; "), 0) << masked;
}

TEST_F(Demands, FilesWrittenByLaterActionsAreNotReadAgain) {
  // An action that fails on a region is retried on the complete value. By then the file has
  // changed.
  const std::string file = "sphere --radius 2 --voxel .05 ! write a.vdb",
                    chain =
                        "read a.vdb --as m ! sphere --radius .3 --center 1.6,0,0 --voxel .05 "
                        "--as s ! sphere --radius .5 --voxel .05 ! write a.vdb ! union @m @s ! "
                        "clip --box \"0,-.1,-.1 1.3,.1,.1\" ! measure --json";
  std::vector<std::string> told;
  for (const char* options : {"--whole ", "", "--threads 3 "}) {
    ASSERT_EQ(levelsmith(file).code, 0);
    told.push_back(levelsmith(options + chain).out);
  }
  EXPECT_NE(told[0].find("volume"), std::string::npos);
  EXPECT_EQ(told[1], told[0]);
  EXPECT_EQ(told[2], told[0]);
}

TEST_F(Demands, FilesAreReadAsEarlierActionsLeaveThem) {
  for (const char* file : {"a.ply", "a.vdb"}) {
    const std::string solid = std::string(file) == "a.vdb" ? " " : " ! mesh ";
    ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1" + solid + "! write " + file).code, 0);
    const std::string chain = std::string("box --size 1,2,3 --voxel 0.1") + solid + "! write " +
                              file + " ! read ./" + file + " ! measure --json";
    const auto again = levelsmith(chain);  // the file contains a ball at first
    ASSERT_EQ(again.code, 0) << again.err;
    std::filesystem::remove(path(file));
    const auto fresh = levelsmith(chain);
    ASSERT_EQ(fresh.code, 0) << fresh.err;
    EXPECT_EQ(again.out, fresh.out);
  }
}

TEST_F(Demands, GraphsOfAnyShapeGiveTheSameFiles) {
  expectSameGraphs(0, 16);
}

class SlowDemands : public Demands {};

TEST_F(SlowDemands, GraphsOfAnyShapeGiveTheSameFiles) {
  expectSameGraphs(16, 60);
}

}  // namespace demand_test
