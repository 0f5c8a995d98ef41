#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <tuple>

#include "apps/regress/errors.h"
#include "apps/regress/recorder.h"
#include "apps/regress/suite.h"
#include "apps/regress/truth/carried.h"
#include "apps/regress/truth/columns.h"
#include "apps/regress/truth/exact_band.h"
#include "apps/regress/truth/gaps.h"
#include "apps/regress/truth/rays.h"
#include "apps/regress/truth/truth.h"
#include "levelset/advection/velocity.h"
#include "levelset/vdb.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace regress_test {

using namespace regress;
using Imath::V3d;
using levelset::CsgOperation;
using Json = nlohmann::json;

constexpr double kVoxel = 1.0 / 16;
const V3d kCentre(0.011, -0.023, 0.017);

Figures errorsOf(const levelset::NarrowBand& band, const Truth& truth) {
  Figures figures;
  addErrors(band, truth, Mesher::Ours, figures);
  addInvariants(band, truth, figures);
  return figures;
}

TEST(RegressErrors, VanishForTheExactBand) {
  const Figures f = errorsOf(exactBand(ball(kCentre, 1), kVoxel), ball(kCentre, 1));
  for (const char* column : {"band_in_linf_vx", "band_out_linf_vx"})
    EXPECT_LE(f.at(column), support::rounding(3));
  // Tricubic interpolation of a sphere with a radius of 16 voxels.
  EXPECT_LE(f.at("surface_l1_vx"), support::measured(5.21e-5));
  EXPECT_GT(f.at("surface_l1_vx"), 0);
  EXPECT_EQ(f.at("missed_hits"), 0);
  EXPECT_EQ(f.at("checks_failed"), 0);
  EXPECT_LE(std::abs(f.at("volume_error")), support::measured(1.09e-9));
}

TEST(RegressExactBand, EndsBelowTheBackground) {
  // Grid points at 15 voxels from a sphere of 12: exactly at the end of a band of three.
  const double h = 1.0 / 12;
  const auto band = exactBand(ball(V3d(0), 1), h);
  const auto& grid = levelset::vdb(band);
  EXPECT_FALSE(grid.tree().isValueOn(openvdb::Coord(5, 2, 14)));
  for (auto it = grid.cbeginValueOn(); it; ++it)
    ASSERT_LT(std::abs(*it), grid.background()) << it.getCoord();
}

TEST(RegressErrors, MatchAWrongRadius) {
  const double off = 0.3 * kVoxel;
  const Figures f = errorsOf(exactBand(ball(kCentre, 1), kVoxel), ball(kCentre, 1 + off));
  for (const char* column :
       {"band_in_l1_vx", "band_in_linf_vx", "band_out_linf_vx", "surface_l1_vx", "surface_linf_vx"})
    EXPECT_NEAR(f.at(column), 0.3, support::measured(2.01e-4)) << column;
  // The outermost grid points have the background value already.
  EXPECT_NEAR(f.at("band_out_l1_vx"), 0.285, support::measured(0.00219));
  EXPECT_NEAR(f.at("surface_l1"), off, support::rounding(8) * kVoxel);
  EXPECT_NEAR(f.at("volume_error"), std::pow(1 + off, -3) - 1, support::measured(1.03e-9));
}

TEST(RegressErrors, SeparateTheTwoSides) {
  // Distances inside are too short by at most a tenth of a voxel, those outside are exact.
  const Truth exact = ball(kCentre, 1);
  Truth bent = exact;
  bent.distance = [&](const V3d& p) {
    const double d = exact.distance(p);
    return d < 0 ? d * (1 - 0.1 / 3) : d;
  };
  const Figures f = errorsOf(exactBand(bent, kVoxel), exact);
  EXPECT_NEAR(f.at("band_in_linf_vx"), 0.1, support::measured(0.00344));
  EXPECT_LE(f.at("band_out_linf_vx"), support::rounding(1.5));
}

TEST(RegressErrors, DetectABandThatIsTooNarrow) {
  // Distances up to 1.5 voxels, on a background of three voxels.
  const Truth exact = ball(kCentre, 1);
  Truth clipped = exact;
  clipped.distance = [&](const V3d& p) {
    const double d = exact.distance(p);
    return std::abs(d) < 1.5 * kVoxel ? d : std::copysign(3 * kVoxel, d);
  };
  EXPECT_GE(errorsOf(exactBand(clipped, kVoxel), exact).at("band_out_linf_vx"), 1.4);
}

/// The band without the leaves whose origins have x ≥ 0.
levelset::NarrowBand half(levelset::NarrowBand band) {
  openvdb::FloatGrid& grid = levelset::editVdb(band);
  std::vector<openvdb::Coord> origins;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
    if (leaf->origin().x() >= 0) origins.push_back(leaf->origin());
  for (const openvdb::Coord& c : origins) grid.tree().addTile(1, c, grid.background(), false);
  return band;
}

double gaps(const levelset::NarrowBand& band, const Truth& truth) {
  return missingShare(bandRegion(truth, band.halfWidth(), band.voxelSize()), levelset::vdb(band));
}

TEST(RegressErrors, CountMissingGridPoints) {
  const Truth exact = ball(kCentre, 1);
  // The remaining part has no error.
  const Figures f = errorsOf(half(exactBand(exact, kVoxel)), exact);
  EXPECT_NEAR(f.at("missing_band"), 0.5, support::measured(0.0203));
  EXPECT_LE(f.at("band_in_linf_vx"), support::rounding(1.5));
  EXPECT_LE(f.at("band_out_linf_vx"), support::rounding(1.5));
}

TEST(RegressGaps, AreNoneInTheExactBand) {
  const Truth exact = ball(kCentre, 1);
  for (const double halfWidth : {1.0, 1.5, 3.0, 6.0})
    EXPECT_EQ(gaps(exactBand(exact, kVoxel, halfWidth), exact), 0) << halfWidth;
  // Positions without comparison do not count as missing.
  Truth left = exact;
  left.compared = [](const V3d& p) { return p.x < -0.1; };
  EXPECT_EQ(gaps(half(exactBand(exact, kVoxel)), left), 0);
}

TEST(RegressGaps, DetectASingleGridPointExceptAtTheEndOfTheBand) {
  const Truth exact = ball(kCentre, 1);
  for (const double distance : {0.4, 2.5}) {
    levelset::NarrowBand band = exactBand(exact, kVoxel);
    for (auto it = levelset::editVdb(band).beginValueOn(); it; ++it)
      if (std::abs(*it) > distance * kVoxel && std::abs(*it) < (distance + 0.3) * kVoxel) {
        it.setValueOff();
        break;
      }
    EXPECT_EQ(gaps(band, exact) > 0, distance < 2) << distance;
  }
}

TEST(RegressGaps, DetectAFrontThatStopsHalfWay) {
  const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(kVoxel), 3);
  const auto times = [](const V3d& p) { return (p - kCentre).length(); };
  for (openvdb::Coord c(-20); c[0] < 20; ++c[0])
    for (c[1] = -20; c[1] < 20; ++c[1])
      for (c[2] = -20; c[2] < 20; ++c[2])
        if (times(levelset::toImath(grid->indexToWorld(c))) < 0.5) grid->tree().setValueOn(c, 0.5f);
  const Region half{.value = times, .low = -1, .high = 0.5, .centre = kCentre, .extent = 0.5};
  EXPECT_EQ(missingShare(half, *grid), 0);
  const Region whole{.value = times, .low = -1, .high = 1, .centre = kCentre, .extent = 1};
  EXPECT_NEAR(missingShare(whole, *grid), 1 - 0.125, support::measured(2.91e-5));
}

TEST(RegressErrors, CountAMissingSurface) {
  const Truth pair = apart(ball(V3d(-1.5, 0, 0), 1), ball(V3d(1.5, 0, 0), 1));
  const Figures f = errorsOf(exactBand(ball(V3d(-1.5, 0, 0), 1), kVoxel), pair);
  EXPECT_NEAR(f.at("missed_hits"), 0.5, support::measured(0.0044));
  EXPECT_NEAR(f.at("volume_error"), -0.5, support::measured(2e-9));
}

TEST(RegressErrors, DoNotBalanceExtraAgainstMissingZeros) {
  // One ball is replaced by a ball of the same size elsewhere: as many zeros, on other rays.
  const Truth left = ball(V3d(-1.5, 0, 0), 1), pair = apart(left, ball(V3d(1.5, 0, 0), 1));
  const Truth other = apart(left, ball(V3d(0, 1.45, 0), 1));
  EXPECT_GE(errorsOf(exactBand(other, kVoxel), pair).at("missed_hits"), 0.6);
}

TEST(RegressDeviation, IsZeroOnlyForEqualBands) {
  const auto a = exactBand(ball(kCentre, 1), kVoxel);
  EXPECT_EQ(deviation(a, a), 0);
  EXPECT_NEAR(deviation(a, exactBand(ball(kCentre, 1 + 0.2 * kVoxel), kVoxel)), 0.2,
              support::rounding(2.5));
  EXPECT_TRUE(std::isinf(deviation(a, exactBand(ball(kCentre, 1), 2 * kVoxel))));
}

TEST(RegressRays, FindTheZerosOfTheExactSolid) {
  const Truth ring = torus(kCentre, V3d(1, 2, 3), 0.7, 0.3);
  const RayHits hits = shootRays(exactBand(ring, 1.0 / 24), ring);
  // Crofton: uniformly distributed lines through a ball of radius R cross a surface of area A
  // inside it 2 A / 4πR² times on average.
  const double radius = ring.reach + 4.0 / 24;
  const double expected = kRayCount * *ring.area / (2 * std::numbers::pi * radius * radius);
  EXPECT_NEAR(hits.exactHits, expected, support::measured(0.00578) * expected);
  // Rays that graze the surface may hit or miss.
  EXPECT_NEAR(static_cast<double>(hits.errors.size()), hits.exactHits,
              support::rounding(1) * hits.exactHits);
}

/// Compares the volume of a truth with a count of grid points, and the slope of its distance with
/// 1.
void expectConsistent(const Truth& truth, const char* name) {
  const double h = 1.0 / 40;
  const int n = static_cast<int>(std::ceil(truth.reach / h)) + 1;
  double inside = 0, steepest = 0;
  for (int x = -n; x <= n; ++x)
    for (int y = -n; y <= n; ++y)
      for (int z = -n; z <= n; ++z) {
        const V3d p = truth.centre + V3d(x + 0.21, y - 0.13, z + 0.37) * h;
        const double d = truth.distance(p);
        inside += d < 0;
        steepest = std::max(steepest, std::abs(truth.distance(p + V3d(h, 0, 0)) - d) / h);
      }
  EXPECT_LE(steepest, 1 + 1e-9) << name;
  EXPECT_NEAR(inside * h * h * h, *truth.volume, support::measured(0.00201) * *truth.volume)
      << name;
}

TEST(RegressTruth, IsADistanceWithItsVolume) {
  const V3d axis(1, 2, 3);
  expectConsistent(ball(kCentre, 0.9), "ball");
  expectConsistent(box(kCentre, V3d(1.2, 0.9, 0.7)), "box");
  expectConsistent(box(kCentre, V3d(1.2, 0.9, 0.7), 0.2), "rounded box");
  expectConsistent(torus(kCentre, axis, 0.6, 0.3), "torus");
  expectConsistent(cylinder(kCentre, axis, 0.5, 1.1), "cylinder");
  expectConsistent(capsule(kCentre, V3d(0.5, 0.3, 0.1), 0.4), "capsule");
  expectConsistent(moved(box(kCentre, V3d(1.2, 0.9, 0.7)), skewRotation()), "rotated box");
  for (const auto op : {CsgOperation::Union, CsgOperation::Intersection, CsgOperation::Difference})
    expectConsistent(twoBalls(op, V3d(0), 0.8, V3d(0.5, 0.3, 0.2), 0.6), "two balls");
}

Row rowOf(int resolution, int phase, double error) {
  return {"v",
          kOurs,
          resolution,
          phase,
          {{"voxel_size", 1.0 / resolution},
           {"band_in_l1", error},
           {"surface_l1", error},
           {"volume_error", -error},
           {"cpu_s", phase + 1.0}},
          {}};
}

TEST(RegressErrors, CompareWithATransportedBand) {
  // A third of a turn about an axis outside the ball, and no motion.
  const V3d centre(0.5, 0.1, -0.2);
  const auto turn = levelset::rotationVelocity(V3d(0), V3d(1, 1, 1), 3);
  const auto still = [](const V3d&, double) { return V3d(0); };
  const V3d turned(centre.z, centre.x, centre.y);
  for (const auto& [velocity, there] :
       {std::pair<levelset::VectorField, V3d>{turn, turned}, {still, centre}}) {
    const auto reference = carriedBall(centre, 0.4, velocity, 1, kVoxel / 2);
    Figures near, far;
    addDifferences(exactBand(ball(there, 0.4), kVoxel), reference, near);
    EXPECT_LE(near.at("surface_linf_vx"), support::measured(0.00198));
    EXPECT_LE(std::abs(near.at("volume_error")), support::measured(1.6e-4));
    EXPECT_LE(near.at("value_error"), support::measured(1.71e-4));
    addDifferences(exactBand(ball(there + V3d(kVoxel, 0, 0), 0.4), kVoxel), reference, far);
    EXPECT_NEAR(far.at("surface_linf_vx"), 1, support::measured(1.48e-4));
    // π R² times the distance on each side.
    EXPECT_NEAR(far.at("value_error"), 1.5 * kVoxel / 0.4, support::measured(9.31e-4));
  }
}

TEST(RegressSummary, TakesTheWorstPlacementAndTheOrder) {
  const auto summary =
      summarize({rowOf(8, 0, 0.1), rowOf(8, 1, 0.16), rowOf(16, 0, 0.04), rowOf(16, 1, 0.02)});
  ASSERT_EQ(summary.size(), 2u);
  EXPECT_DOUBLE_EQ(summary[0].figures.at("surface_l1"), 0.16);
  EXPECT_DOUBLE_EQ(summary[0].figures.at("volume_error"), -0.16);
  EXPECT_DOUBLE_EQ(summary[0].figures.at("cpu_s"), 1.5);
  EXPECT_DOUBLE_EQ(summary[1].figures.at("order_surface"), 2);
  EXPECT_DOUBLE_EQ(summary[1].figures.at("order_volume"), 2);
}

TEST(RegressBounds, FollowFromTheStatedFigure) {
  const auto bounds = Bounds()
                          .measured("v", "surface_l1", {{8, 0.2}, {16, 0.1, Budget::Full}})
                          .ceiling(0.25)
                          .order("v", "order_surface", {{16, 2.1}})
                          .rounding("v", "band_in_l1", 2)
                          .zero("v", "checks_failed")
                          .required("v", "active_voxels", 7, 8, Sense::AtLeast)
                          .all();
  ASSERT_EQ(bounds.size(), 6u);
  EXPECT_DOUBLE_EQ(bounds[0].limit(), 0.25);
  EXPECT_TRUE(bounds[0].isFor(Budget::Quick));
  EXPECT_DOUBLE_EQ(bounds[1].limit(), 0.15);
  EXPECT_FALSE(bounds[1].isFor(Budget::Quick));
  EXPECT_DOUBLE_EQ(bounds[2].limit(), 1.8);
  EXPECT_FALSE(bounds[2].isMet(1.7));
  EXPECT_DOUBLE_EQ(bounds[3].limit(), 2 * std::ldexp(1.0, -23));
  EXPECT_FALSE(bounds[4].isMet(1e-9));
  EXPECT_TRUE(bounds[5].isMet(8));
  EXPECT_FALSE(bounds[5].isMet(6));
}

TEST(RegressJudge, FailsExceededBoundsAndUnknownFigures) {
  Case c{.name = "c", .quick = {8}, .full = {8, 16}};
  c.bounds = Bounds()
                 .measured("v", "surface_l1", {{8, 0.12}})
                 .measured("v", "band_in_l1", {{8, 0.09}, {16, 0.09}})
                 .required("v", "cpu_s", 2, 8, Sense::AtLeast)
                 .required("other", "surface_l1", 1);
  const auto summary = summarize({rowOf(8, 0, 0.15)});
  const auto quick = judge(c, summary, Budget::Quick);
  ASSERT_EQ(quick.size(), 4u);
  EXPECT_TRUE(quick[0].passed);
  EXPECT_FALSE(quick[1].passed);
  EXPECT_FALSE(quick[2].passed);
  EXPECT_FALSE(quick[3].passed);
  EXPECT_EQ(judge(c, summary, Budget::Full).size(), 5u);
}

TEST(RegressJudge, FailsALimitAboveThreeTimesTheFigureFound) {
  Case c{.name = "c", .quick = {8}};
  const auto passes = [&](double found) {
    return judge(c, {rowOf(8, 0, found)}, Budget::Quick).at(0).passed;
  };
  c.bounds = Bounds().measured("v", "surface_l1", {{8, 0.1}});
  EXPECT_TRUE(passes(0.14));
  EXPECT_TRUE(passes(0.06));
  EXPECT_FALSE(passes(0.16));
  EXPECT_FALSE(passes(0.04));
  EXPECT_FALSE(passes(0));
  // Figures at rounding level and limits of requirements are never out of date.
  c.bounds = Bounds().rounding("v", "surface_l1", 2);
  EXPECT_TRUE(passes(1e-12));
  c.bounds = Bounds().required("v", "surface_l1", 1);
  EXPECT_TRUE(passes(1e-12));
  Row row = rowOf(8, 0, 0.1);
  row.figures["order_surface"] = 2.2;
  c.bounds = Bounds().order("v", "order_surface", {{8, 2.1}});
  EXPECT_TRUE(judge(c, {row}, Budget::Quick).at(0).passed);
  row.figures["order_surface"] = 3;
  EXPECT_FALSE(judge(c, {row}, Budget::Quick).at(0).passed);
}

TEST(RegressJudge, FailsAResolutionWithoutAStatedFigure) {
  const Case c{
      .name = "c", .quick = {8, 16}, .bounds = Bounds().measured("v", "surface_l1", {{8, 0.1}})};
  const auto judged = judge(c, {rowOf(8, 0, 0.1), rowOf(16, 0, 0.1)}, Budget::Quick);
  ASSERT_EQ(judged.size(), 2u);
  EXPECT_TRUE(judged[0].passed);
  EXPECT_EQ(judged[1].resolution, 16);
  EXPECT_FALSE(judged[1].passed);
}

TEST(RegressJudge, FailsAMissingSurface) {
  Case c{.name = "c", .quick = {8}, .bounds = Bounds().measured("v", "surface_l1", {{8, 0.1}})};
  Row row = rowOf(8, 0, 0.1);
  row.figures["missed_hits"] = 0;
  EXPECT_TRUE(judge(c, {row}, Budget::Quick).at(1).passed);
  row.figures["missed_hits"] = 0.01;
  EXPECT_FALSE(judge(c, {row}, Budget::Quick).at(1).passed);
  // A case may state the share.
  c.bounds =
      Bounds().measured("v", "surface_l1", {{8, 0.1}}).measured("v", "missed_hits", {{8, 0.01}});
  const auto stated = judge(c, {row}, Budget::Quick);
  ASSERT_EQ(stated.size(), 2u);
  EXPECT_TRUE(stated[1].passed);
  row.figures["missed_hits"] = 0.02;
  EXPECT_FALSE(judge(c, {row}, Budget::Quick).at(1).passed);
}

TEST(RegressJudge, FailsAMissingBand) {
  Case c{.name = "c", .bounds = Bounds().measured("v", "band_in_l1", {{8, 0.1}})};
  Row row = rowOf(8, 0, 0.1);
  row.figures["missing_band"] = 0;
  EXPECT_TRUE(judge(c, {row}, Budget::Quick).at(1).passed);
  row.figures["missing_band"] = 1e-6;
  EXPECT_FALSE(judge(c, {row}, Budget::Quick).at(1).passed);
  // A case may state the share.
  c.bounds.push_back({.variant = "v", .figure = "missing_band", .stated = 1e-6});
  const auto allowed = judge(c, {row}, Budget::Quick);
  ASSERT_EQ(allowed.size(), 2u);
  EXPECT_TRUE(allowed[1].passed);
  row.figures["missing_band"] = 0.5;
  EXPECT_FALSE(judge(c, {row}, Budget::Quick).at(1).passed);
  // A case without bounds on the band allows missing grid points.
  c.bounds = Bounds().measured("v", "surface_l1", {{8, 0.1}});
  EXPECT_EQ(judge(c, {row}, Budget::Quick).size(), 1u);
}

TEST(RegressJudge, FailsRefusedRuns) {
  const Case c{.name = "c"};
  Row refused = rowOf(8, 0, 0);
  refused.failure = "offset: no";
  EXPECT_FALSE(judge(c, {refused}, Budget::Quick).at(0).passed);
}

TEST(RegressCases, AreComplete) {
  std::set<std::string> names, columnNames;
  for (const Column& column : columns()) columnNames.insert(column.name);
  for (const Case& c : cases()) {
    EXPECT_TRUE(names.insert(c.name).second) << c.name << " is registered twice";
    EXPECT_FALSE(c.group.empty() || c.title.empty() || c.definition.empty() || c.citation.empty())
        << c.name;
    EXPECT_TRUE(c.run) << c.name;
    std::set<std::tuple<std::string, std::string, int, int>> bounded;
    for (const Bound& bound : c.bounds) {
      EXPECT_TRUE(columnNames.contains(bound.figure)) << c.name << " " << bound.figure;
      for (const Budget budget : {Budget::Quick, Budget::Full})
        EXPECT_TRUE(
            !bound.isFor(budget) ||
            bounded
                .insert({bound.variant, bound.figure, bound.resolution, static_cast<int>(budget)})
                .second)
            << c.name << ": two bounds on " << bound.figure << " of " << bound.variant;
    }
  }
}

class Regress : public support::ShellTest {};

TEST_F(Regress, ListsItsCases) {
  const auto outcome = levelsmith("regress --list");
  EXPECT_EQ(outcome.code, 0);
  for (const Case& c : cases()) EXPECT_NE(outcome.out.find(c.name + " "), std::string::npos);
}

TEST_F(Regress, WritesResultsAndPage) {
  const auto outcome =
      levelsmith("--quiet regress --case skewed-axes,damaged-grids --no-plots --out r");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  const Json json = Json::parse(support::slurp(folder_ / "r/results.json"));
  EXPECT_EQ(json["budget"], "quick");
  ASSERT_EQ(json["cases"].size(), 2u);
  EXPECT_EQ(json["failures"].size(), 0u);
  for (const Json& o : json["cases"][1]["outcomes"]) EXPECT_EQ(o["passed"], true) << o.dump();
  const std::string csv = support::slurp(folder_ / "r/results.csv");
  EXPECT_TRUE(csv.starts_with("case,variant,tool,resolution,phase,voxel_size,")) << csv;
  EXPECT_NE(support::slurp(folder_ / "r/index.html").find("grid with sheared axes"),
            std::string::npos);
}

TEST_F(Regress, Refuses) {
  EXPECT_REFUSED(levelsmith("regress --case no-such --out r"), 2, "no case 'no-such'");
  EXPECT_REFUSED(levelsmith("regress"), 2, "--out");
  EXPECT_REFUSED(levelsmith("regress --budget huge --out r"), 2, "budget");
  writeFile("taken", "");
  EXPECT_REFUSED(levelsmith("regress --case skewed-axes --out taken"), 6, "taken");
  EXPECT_FALSE(exists("r"));
}

}  // namespace regress_test
