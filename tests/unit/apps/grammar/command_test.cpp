#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "levelset/components/components.h"
#include "levelset/csg/clip.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "render/images/image.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace command_test {

using Json = nlohmann::json;
constexpr double kPi = 3.14159265358979323846;

class Command : public support::ShellTest {
 protected:
  Json measure(const std::string& chain) {
    const auto outcome = levelsmith(chain + " ! measure --json");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(Command, MeasuresASphere) {
  const Json m = measure("sphere --radius 1 --voxel 0.05");
  EXPECT_NEAR(m["volume"], 4 * kPi / 3, support::measured(4.43e-10) * 4 * kPi / 3);
  EXPECT_NEAR(m["area"], 4 * kPi, support::rounding(0.3) * 4 * kPi);
  EXPECT_NEAR(m["bounds"]["max"][0], 1, support::rounding(1) * 0.05);
  EXPECT_EQ(m["components"], 1);
  EXPECT_EQ(m["shells"], 1);
  EXPECT_EQ(m["cavities"], 0);
  EXPECT_EQ(m["euler"], 2);
  EXPECT_DOUBLE_EQ(m["voxel_size"], 0.05);
  EXPECT_DOUBLE_EQ(m["half_width"], 3);
}

TEST_F(Command, SubtractsTheNewerOperandFromTheOlder) {
  const Json m =
      measure("box --size 3,3,3 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! difference");
  // The mesh of the box removes at most h²/2 along its 36 units of edges.
  EXPECT_NEAR(m["volume"], 27 - 4 * kPi / 3, support::measured(34.9, 36) * 0.1 * 0.1 / 2);
  EXPECT_EQ(m["cavities"], 1);
  EXPECT_EQ(m["shells"], 2);
}

TEST_F(Command, ChangesOnlyMaskedPoints) {
  const std::string box = "box --size 2,2,2 --voxel 0.1";
  const double before = measure(box)["volume"];
  for (const std::string action : {"open 0.5", "shell --thickness 0.3", "close 0.3"}) {
    const auto volume = [&](const std::string& mask) {
      return measure(box + " ! " + action + mask)["volume"].get<double>();
    };
    const double everywhere = volume("");
    EXPECT_NEAR(volume(" --mask x --mask-min 8 --mask-max 9"), before, support::rounding(8))
        << action;
    EXPECT_NEAR(volume(" --mask x --mask-min -9 --mask-max -8"), everywhere,
                support::measured(9.42e-4, 1e-3))
        << action;
    // Half of a solid that is symmetric. The new wall of 1.4² of a cavity lies within half a voxel
    // of the middle.
    const double right = volume(" --mask x --mask-min -0.05 --mask-max 0.05");
    EXPECT_NEAR(right, volume(" --mask x --mask-min -0.05 --mask-max 0.05 --mask-invert"),
                support::measured(0.00412))
        << action;
    EXPECT_NEAR(right, (before + everywhere) / 2, support::measured(0.045, 0.05) * 1.4 * 1.4)
        << action;
  }
  EXPECT_DOUBLE_EQ(measure(box + " ! open 0.5 --mask x --half-width 5")["half_width"], 5);
}

TEST_F(Command, ResolvesLengthsInVoxelsAndPercent) {
  const double radius = 1, voxel = 0.05;
  for (const auto& [text, grown] : {std::pair<std::string, double>{"2vx", 2 * voxel},
                                    {"-0.2", -0.2},
                                    {"5%", 0.05 * 2 * std::sqrt(3.0) * radius}}) {
    const Json m = measure("sphere --radius 1 --voxel 0.05 ! offset " + text);
    EXPECT_NEAR(m["bounds"]["max"][1], radius + grown, support::measured(2.03e-9) * voxel) << text;
  }
}

TEST_F(Command, ReadsItsOwnFiles) {
  ASSERT_EQ(levelsmith("torus --radius 2 --tube 0.7 --voxel 0.1 ! write a.vdb ! mesh ! write a.ply "
                       "! write a.obj.gz ! write a.stl ! write a.off")
                .code,
            0);
  const Json band = measure("read a.vdb");
  const double exact = 2 * kPi * kPi * 2 * 0.7 * 0.7;
  EXPECT_NEAR(band["volume"], exact, support::measured(5.91e-6) * exact);
  EXPECT_EQ(band["euler"], 0);
  // Flat triangles lie inside the curved surface.
  const double flat = measure("read a.ply")["volume"];
  EXPECT_NEAR(flat, exact, support::measured(0.00419, 5e-3) * exact);
  for (const char* file : {"a.ply", "a.obj.gz", "a.stl", "a.off"}) {
    const Json mesh = measure(std::string("read ") + file);
    EXPECT_NEAR(mesh["volume"], flat, support::measured(3.97e-9) * exact) << file;
    EXPECT_EQ(mesh["closed_manifold"], true) << file;
  }
  EXPECT_EQ(fileCount(), 5u);
}

TEST_F(Command, PipesThroughStandardStreams) {
  const auto outcome =
      shell(command() + " --quiet sphere --radius 1 --voxel 0.1 ! mesh ! write - --format ply | " +
            command() + " read - --format ply ! measure --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NEAR(Json::parse(outcome.out)["volume"], 4 * kPi / 3, support::measured(0.0254));
}

TEST_F(Command, KeepsDataApartFromMessagesOnStandardOutput) {
  const auto outcome = levelsmith("sphere --radius 1 --voxel 0.1 ! check ! measure --json");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_TRUE(Json::accept(outcome.out)) << outcome.out;
  EXPECT_NE(outcome.err.find("ok"), std::string::npos);
}

TEST_F(Command, NamesTheActionOfAMessageOnce) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! ";
  const auto cut = levelsmith("--report r.json sphere --radius 1 --voxel 0.1 --half-width 4 ! " +
                              ball + "union ! measure");
  EXPECT_NE(cut.err.find("levelsmith: union: operand 1 was narrowed to a half width of 3 voxels\n"),
            std::string::npos)
      << cut.err;
  const Json notes = Json::parse(support::slurp(folder_ / "r.json"))["steps"][2]["notes"];
  EXPECT_EQ(notes[0], "union: operand 1 was narrowed to a half width of 3 voxels");

  const auto says = [&](const support::Outcome& outcome, const std::string& start) {
    EXPECT_TRUE(outcome.err.starts_with(start)) << outcome.err;
  };
  says(levelsmith(ball + "sphere --radius 1 --center 9,0,0 --voxel 0.1 ! blend --radius 0.3"),
       "levelsmith: blend: the surfaces do not intersect");
  says(levelsmith("--threads 0 " + ball + "measure"), "levelsmith: --threads: ");
  const auto missed = levelsmith(ball + "curvature-flow --time 0.02 --tolerance 1e-12");
  EXPECT_EQ(missed.code, 5);
  EXPECT_NE(missed.err.find("levelsmith: curvature-flow: the error of the time steps"),
            std::string::npos)
      << missed.err;
  says(levelsmith("spere"), "levelsmith: there is no action");
  says(shell(command() + " " + ball + "measure --json > /dev/full"),
       "levelsmith: measure: standard output cannot be written");
  writeFile("empty.ply", "");
  says(levelsmith("info empty.ply"), "levelsmith: info: 'empty.ply' is empty");
}

TEST_F(Command, WarnsOfUnusedValues) {
  const auto outcome = levelsmith("sphere --radius 1 --voxel 0.1");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("not used"), std::string::npos);
  EXPECT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! measure").err.find("not used"),
            std::string::npos);
}

TEST_F(Command, WritesAReport) {
  ASSERT_EQ(levelsmith("--report r.json box --size 2,2,2 --voxel 0.1 ! mesh ! level-set --voxel "
                       "0.1 ! offset 2vx ! write a.vdb")
                .code,
            0);
  const Json report = Json::parse(support::slurp(folder_ / "r.json"));
  ASSERT_EQ(report["steps"].size(), 5u);
  const Json& offset = report["steps"][3];
  EXPECT_DOUBLE_EQ(offset["resolved"]["distance"]["world"], 0.2);
  EXPECT_DOUBLE_EQ(offset["resolved"]["distance"]["voxels"], 2);
  EXPECT_GT(offset["result"]["active_voxels"], 1000);
  EXPECT_GT(offset["peak_bytes"], 0);
  EXPECT_EQ(report["steps"][2]["certificate"]["closed"], true);
  EXPECT_LT(offset["errors"][0]["value"], 0.1);
  ASSERT_EQ(levelsmith("--report r.html sphere --radius 1 --voxel 0.1 ! measure").code, 0);
  EXPECT_NE(support::slurp(folder_ / "r.html").find("<table>"), std::string::npos);
  // The voxel size is known only after the lengths that determine it.
  ASSERT_EQ(levelsmith("--report r.json sphere --radius 1 --resolution 100 ! measure").code, 0);
  const Json sphere = Json::parse(support::slurp(folder_ / "r.json"))["steps"][0]["resolved"];
  EXPECT_DOUBLE_EQ(sphere["radius"]["voxels"], 50);
}

TEST_F(Command, WarnsOfAFileWrittenTwice) {
  const auto outcome = levelsmith(
      "sphere --radius 1 --voxel 0.1 ! write a.vdb ! offset 0.1 ! write ./a.vdb ! measure");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("an earlier action writes"), std::string::npos) << outcome.err;
  const auto device = levelsmith(
      "sphere --radius 1 --voxel 0.1 ! write /dev/null --format vdb ! write /dev/null --format "
      "vdb");
  EXPECT_EQ(device.code, 0);
  EXPECT_EQ(device.err.find("an earlier action writes"), std::string::npos) << device.err;
  const auto never = levelsmith(
      "--no-clobber sphere --radius 1 --voxel 0.1 ! write b.vdb ! measure ! write b.vdb");
  EXPECT_EQ(never.code, 6);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b.vdb"));
}

// script(1) provides a terminal. Progress bars appear after a second and are erased afterwards.
TEST_F(Command, ShowsABarOnATerminal) {
  // Takes several seconds on any machine, because the bar waits for one second.
  const std::string slow = " torus --radius 2 --tube 0.8 --voxel 0.006 ! measure";
  ASSERT_EQ(shell("script -qec '" + command() + slow + "' typed < /dev/null > /dev/null").code, 0);
  const std::string typed = support::slurp(folder_ / "typed");
  EXPECT_NE(typed.find('%'), std::string::npos) << typed;
  EXPECT_NE(typed.find('\r'), std::string::npos);
}

TEST_F(Command, ReportsTheCertificateOfARefusedMesh) {
  // A box without its top. Along the hole its sign is uncertain.
  writeFile("open.off",
            "OFF\n8 10 0\n-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
            "3 0 2 1\n3 0 3 2\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n"
            "3 3 4 7\n");
  EXPECT_REFUSED(levelsmith("--report r.json read open.off ! level-set --voxel 0.1"), 3, "guess");
  const Json report = Json::parse(support::slurp(folder_ / "r.json"));
  EXPECT_EQ(report["exit_code"], 3);
  EXPECT_EQ(report["steps"][1]["certificate"]["boundary_edges"], 4);
  EXPECT_GT(report["steps"][1]["certificate"]["ambiguous_share"], 1e-3);
}

TEST_F(Command, PlansARotatedBandAtItsPosition) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 --half-width 5 ! transform --rotate "
                       "30 ! transform --translate 100,0,0 ! write a.vdb")
                .code,
            0);
  ASSERT_EQ(levelsmith("--dry-run --report r.json read a.vdb ! render a.png").code, 0);
  const Json read = Json::parse(support::slurp(folder_ / "r.json"))["steps"][0]["result"];
  EXPECT_NEAR(read["half_width"], 5, support::measured(2.87e-13));
  EXPECT_NEAR(read["voxel_size"], 0.1, support::doubleRounding(40));
}

TEST_F(Command, DryRunComputesAndWritesNothing) {
  const auto outcome =
      levelsmith("--dry-run sphere --radius 1 --voxel 0.001 ! offset 2vx ! mesh ! write out.ply");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("active voxels"), std::string::npos);
  EXPECT_FALSE(exists("out.ply"));
  EXPECT_REFUSED(levelsmith("--dry-run --max-memory 100M sphere --radius 1 --voxel 0.001 ! mesh"),
                 4, "limit");
}

TEST_F(Command, DryRunResolvesEveryLength) {
  const auto outcome = levelsmith(
      "--dry-run --report r.json box --size 40,40,10 --voxel 0.5 --as base ! torus --radius 4 "
      "--tube 1.5 --voxel 0.25 --as rings ! patch @base --at 0,0,5 --size 20,20 --height 8 "
      "--spacing 2vx --as p ! texture @base @rings @p --blend 1 ! sphere --radius 3 --voxel 0.5 ! "
      "blend --radius 2vx ! smooth --sigma 2vx ! write a.vdb");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json steps = Json::parse(support::slurp(folder_ / "r.json"))["steps"];
  EXPECT_EQ(steps[2]["resolved"]["spacing"]["world"], 1);
  EXPECT_EQ(steps[3]["resolved"]["embed"]["world"], 0.5);
  EXPECT_EQ(steps[3]["resolved"]["blend"]["voxels"], 2);
  // The rings are 11 wide, and the patch enlarges them to at least this size.
  EXPECT_NEAR(steps[3]["result"]["voxel_size"], 0.25 * 20 / 11, support::doubleRounding(4));
  EXPECT_NEAR(steps[5]["resolved"]["radius"]["world"], 2 * 0.25 * 20 / 11,
              support::doubleRounding(4));
  EXPECT_TRUE(steps[6]["resolved"].contains("sigma"));
  // Each note appears once.
  const std::size_t first = outcome.err.find("voxel = "), end = outcome.err.find('\n');
  EXPECT_LT(first, end) << outcome.err;
  EXPECT_GT(outcome.err.find("voxel = ", first + 1), end) << outcome.err;
}

TEST_F(Command, DryRunRefusesLikeTheRun) {
  for (const char* run : {"", "--dry-run "}) {
    EXPECT_REFUSED(levelsmith(std::string(run) + "sphere --radius 1 --voxel 5"), 3,
                   "larger than the longest side of the shape");
    EXPECT_REFUSED(levelsmith(std::string(run) + "sphere --radius 1 --voxel 1e-10"), 4, "32 bits");
    EXPECT_REFUSED(levelsmith(std::string(run) + "sphere --radius 1e300 --voxel 1e299"), 3,
                   "change the unit of length");
  }
}

TEST_F(Command, ReportsProgressOfLongActions) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.05 ! write a.vdb").code, 0);
  const auto outcome = levelsmith(
      "--progress json read a.vdb ! keep --largest 1 ! fill-cavities ! clip --plane \"0,0,0 "
      "0,0,1\" ! check ! measure ! write b.vdb ! mesh ! measure");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* action : {"read", "keep", "fill-cavities", "clip", "check", "measure", "write"})
    EXPECT_NE(outcome.err.find("\"steps\": 9, \"action\": \"" + std::string(action) + "\""),
              std::string::npos)
        << action << "\n"
        << outcome.err;
}

TEST_F(Command, StopsWhenItsProgressIsCancelled) {
  const levelset::Progress half = [](double fraction) { return fraction < 0.45; };
  const levelset::NarrowBand ball = levelset::makeSphere(1, Imath::V3d(0), 0.05);
  levelset::writeBand(folder_ / "a.vdb", ball);
  EXPECT_THROW((void)levelset::measure(ball, half), levelset::Cancelled);
  EXPECT_THROW((void)levelset::check(ball, half), levelset::Cancelled);
  EXPECT_THROW((void)levelset::keepLargest(ball, 1, half), levelset::Cancelled);
  EXPECT_THROW((void)levelset::fillCavities(ball, 1, half), levelset::Cancelled);
  EXPECT_THROW((void)levelset::clip(ball, Imath::Box3d(Imath::V3d(0), Imath::V3d(2)), half),
               levelset::Cancelled);
  EXPECT_THROW((void)levelset::readBand(folder_ / "a.vdb", {.progress = half}),
               levelset::Cancelled);
  EXPECT_THROW(levelset::writeBand(folder_ / "b.vdb", ball, {.progress = half}),
               levelset::Cancelled);
  EXPECT_FALSE(exists("b.vdb"));
}

TEST_F(Command, RendersExrAndPng) {
  const auto outcome = levelsmith(
      "sphere --radius 1 --voxel 0.1 --as s ! render a.exr --size 64x48 --from 3,2,4 --to 0,0,0 ! "
      "render a.png --size 64x48");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(support::slurp(folder_ / "a.png").substr(1, 3), "PNG");
  const render::Image image = render::readExr(folder_ / "a.exr");
  for (const char* layer : {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z",
                            "curvature.mean", "curvature.gauss", "curvature.k1", "curvature.k2"})
    EXPECT_TRUE(image.channels.contains(layer)) << layer;
  ASSERT_TRUE(image.ids.contains("id"));
  const std::size_t middle = 24 * 64 + 32;
  EXPECT_NEAR(image.channels.at("Z")[middle], std::sqrt(29.0) - 1, support::measured(0.00284));
  EXPECT_NEAR(image.channels.at("curvature.mean")[middle], 1, support::measured(0.00188));
  EXPECT_EQ(image.channels.at("Z")[0], std::numeric_limits<float>::infinity());
}

TEST_F(Command, OutputMayEqualInput) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write a.vdb").code, 0);
  ASSERT_EQ(levelsmith("read a.vdb ! offset 0.2 ! write a.vdb").code, 0);
  EXPECT_NEAR(measure("read a.vdb")["bounds"]["max"][0], 1.2, support::doubleRounding(1.5));
}

TEST_F(Command, ReportsTheContentsOfAFile) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write a.vdb ! mesh ! write a.ply").code, 0);
  const Json vdb = Json::parse(levelsmith("info a.vdb --json").out);
  EXPECT_NEAR(vdb["grids"][0]["voxel_size"], 0.1, support::doubleRounding(4));
  EXPECT_EQ(vdb["grids"][0]["class"], "level set");
  EXPECT_GT(Json::parse(levelsmith("info a.ply --json").out)["vertices"], 100);
}

TEST_F(Command, TransformsExactlyAndBakesOnRequest) {
  EXPECT_NEAR(
      measure("box --size 2,1,1 --voxel 0.05 ! transform --rotate 90 --translate 1,0,0")["bounds"]
                                                                                        ["max"][1],
      1, support::rounding(1));
  // Both lose the same at their edges, which are rounded within a voxel.
  const double whole = measure("box --size 2,1,1 --voxel 0.05")["volume"];
  EXPECT_NEAR(measure("box --size 1,1,1 --voxel 0.05 ! transform --scale 2,1,1 --bake")["volume"],
              whole, support::measured(0.00149));
  EXPECT_REFUSED(levelsmith("box --size 1,1,1 --voxel 0.05 ! transform --mirror x ! measure"), 2,
                 "--bake");
}

}  // namespace command_test
