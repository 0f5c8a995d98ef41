#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "mapping/generators/hexagons.h"
#include "mapping/generators/knurl.h"
#include "mapping/generators/scales.h"
#include "tests/support/files.h"
#include "tests/support/generators.h"
#include "tests/support/measured.h"

// Infinite patterns that a tile cuts off.
namespace tile_generators_test {

using namespace mapping;
using Imath::V3d;
using levelset::Measurement;
using levelset::NarrowBand;
using support::expectNearest;
using support::expectPeriodic;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// === Knurl

/// Depth below the crests, from the distance to the middles of the grooves.
double knurlHeight(const Knurl& knurl, const V3d& fromCorner) {
  const double c = std::cos(knurl.grooveAngle), s = std::sin(knurl.grooveAngle);
  double height = 0;
  for (const double sign : {-1.0, 1.0}) {
    const double across =
        std::abs(std::remainder(fromCorner.x * c + sign * fromCorner.y * s, knurl.pitch));
    const double depth = knurl.depth > 0 ? knurl.depth : sharpDepth(knurl);
    height = std::min(height, -depth + across / std::tan(knurl.flankAngle / 2));
  }
  return height;
}

TEST(Knurl, HasTheExactDistanceOfItsFlanks) {
  for (const double depth : {0.0, 0.3}) {
    const Knurl knurl{.pitch = 1, .depth = depth, .base = 0.2};
    const V3d center(0.1, 0.2, -0.3);
    const TileBox box = knurlBox(knurl, center);
    expectNearest(
        makeKnurl(knurl, center, 0.06),
        [&](const V3d& p) {
          return box.whole.intersects(p) &&
                 p.z < box.whole.max.z + knurlHeight(knurl, p - box.tile.min);
        },
        0.006, 97);
  }
}

TEST(Knurl, HasTheVolumeOfItsPyramids) {
  // Lands of width a between grooves of a sharp profile: the mean of the smaller of two heights.
  const Knurl knurl{.pitch = 1, .base = 0.4, .tiling = {1, 1, 0}};
  const double area = 1 / (std::cos(knurl.grooveAngle) * std::sin(knurl.grooveAngle));
  const double exact = area * (0.4 + sharpDepth(knurl) / 3);
  double errors[2];
  for (int i = 0; i < 2; ++i)
    errors[i] =
        std::abs(levelset::measure(makeKnurl(knurl, V3d(0), i ? 0.01 : 0.04)).volume - exact);
  EXPECT_LT(errors[0], support::measured(0.00728, 0.01) * exact);
  EXPECT_LT(errors[1], errors[0] / 3) << "the grid rounds edges: second order";
  const Knurl straight{.pattern = KnurlPattern::Straight, .pitch = 1, .base = 0.4};
  EXPECT_NEAR(levelset::measure(makeKnurl(straight, V3d(0), 0.02)).volume,
              0.4 + sharpDepth(straight) / 2, support::measured(0.00222));
}

TEST(Knurl, ContinuesAcrossTheSidesOfItsTile) {
  // tan = 3/4: periods of 5/4 and 5/3 pitches, which are whole numbers of voxels.
  for (const KnurlPattern pattern : {KnurlPattern::Diamond, KnurlPattern::Diagonal}) {
    Knurl knurl{.pattern = pattern, .pitch = 0.96, .base = 0.3, .tiling = {1, 1, 0.5}};
    knurl.grooveAngle = std::atan(0.75);
    const double h = 0.04, x = 1.2, y = 1.6;
    const NarrowBand band = makeKnurl(knurl, V3d(0), h);
    const Imath::Box3d near(V3d(-x / 2 - 0.3, -y / 2 - 0.3, -1),
                            V3d(-x / 2 + 0.3, -y / 2 + 0.3, 1));
    expectPeriodic(band, V3d(x, 0, 0), near);
    expectPeriodic(band, V3d(0, y, 0), near);
  }
  const TileBox box = knurlBox({.tiling = {3, 2, 0.5}}, V3d(0));
  EXPECT_NEAR(box.tile.size().x, 3 / std::cos(M_PI / 6), support::measured(3.4e-12));
  EXPECT_NEAR(box.tile.size().y, 2 / std::sin(M_PI / 6), support::measured(1.18e-11));
  EXPECT_NEAR(box.whole.size().x, box.tile.size().x + 1, support::doubleRounding(20));
}

TEST(Knurl, RefusesPatternsThatNoWheelCuts) {
  const auto refused = [](const Knurl& knurl) {
    return support::refusal<levelset::UsageError>([&] { (void)makeKnurl(knurl, V3d(0), 0.05); });
  };
  EXPECT_NE(refused({.pitch = 1, .depth = 0.6}).find("sharp at 0.5"), std::string::npos);
  EXPECT_NE(refused({.pitch = kNan}).find("the pitch"), std::string::npos);
  EXPECT_NE(refused({.pitch = 1, .flankAngle = 3.2}).find("flanks"), std::string::npos);
  EXPECT_NE(refused({.pitch = 1, .grooveAngle = 0}).find("the angle of the grooves"),
            std::string::npos);
  EXPECT_NE(refused({.pitch = 1, .base = -1}).find("the base"), std::string::npos);
  EXPECT_NE(refused({.pitch = 1, .tiling = {0, 1, 0}}).find("columns"), std::string::npos);
  EXPECT_NE(support::refusal<levelset::InvalidInput>([] {
              (void)makeKnurl({.pitch = 0.09, .base = 1, .tiling = {20, 20, 0}}, V3d(0), 0.05);
            }).find("under two voxels"),
            std::string::npos);
}

// === Scales

TEST(Scales, ShareOnePlateAndContinueAcrossTheTile) {
  const Scales scales{.length = 1.6, .width = 1.2, .step = 0.8, .tiling = {2, 2, 0.6}};
  const NarrowBand band = makeScales(scales, V3d(0), 0.04);
  const Measurement m = levelset::measure(band);
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.euler, 2);
  const TileBox box = scalesBox(scales, V3d(0));
  EXPECT_NEAR(box.whole.size().z, 0.3 + 1.6 * std::sin(scales.tilt), support::doubleRounding(4));
  EXPECT_NEAR(m.bounds.max.z, box.whole.max.z, support::measured(0.00856));
  const Imath::Box3d near(V3d(-1.6, -1.2, -1), V3d(-0.8, -0.4, 1));
  expectPeriodic(band, V3d(2.4, 0, 0), near);
  expectPeriodic(band, V3d(0, 1.6, 0), near);
}

TEST(Scales, HaveTheExactDistanceOutside) {
  for (const double tip : {0.0, 1.0}) {
    const Scales scales{
        .length = 1.4, .thickness = 0.12, .tip = tip, .rounding = tip > 0 ? 0.05 : 0};
    const NarrowBand band = makeScales(scales, V3d(0), 0.05),
                     fine = makeScales(scales, V3d(0), 0.01);
    const auto values = levelset::vdb(fine).getConstAccessor();
    expectNearest(
        band,
        [&](const V3d& p) {
          return values.getValue(openvdb::Coord::round(levelset::toVdb(p / 0.01))) < 0;
        },
        0.02, 61, false);
  }
}

TEST(Scales, HaveFreeSpaceUnderTheirTips) {
  // Undercut: a ray upwards before a tip leaves the plate, passes air, and then enters the scale.
  const Scales scales{.length = 2, .thickness = 0.2, .tilt = 0.4, .tiling = {1, 2, 0}};
  const NarrowBand band = makeScales(scales, V3d(0), 0.04);
  const auto values = levelset::vdb(band).getConstAccessor();
  const auto crossings = [&](double x, double y) {
    int count = 0;
    for (int k = -30; k < 30; ++k) {
      const openvdb::Coord c(static_cast<int>(std::lround(x / 0.04)),
                             static_cast<int>(std::lround(y / 0.04)), k);
      count += (values.getValue(c) < 0) != (values.getValue(c.offsetBy(0, 0, 1)) < 0);
    }
    return count;
  };
  EXPECT_GE(crossings(0, 0.7), 4);
  const Scales solid{.length = 2, .tilt = 0.4, .tiling = {1, 2, 0}};
  EXPECT_GT(levelset::measure(makeScales(solid, V3d(0), 0.04)).volume,
            1.1 * levelset::measure(band).volume);
}

TEST(Scales, RefuseScalesWithoutOverlap) {
  const auto refused = [](const Scales& scales) {
    return support::refusal<levelset::UsageError>([&] { (void)makeScales(scales, V3d(0), 0.05); });
  };
  EXPECT_NE(refused({.step = 2}).find("rows must overlap"), std::string::npos);
  EXPECT_NE(refused({.tip = 0.2}).find("blunter"), std::string::npos);
  EXPECT_NE(refused({.tip = 3}).find("the tip"), std::string::npos);
  EXPECT_NE(refused({.thickness = 0.4}).find("rows touch"), std::string::npos);
  EXPECT_NE(refused({.tilt = 0}).find("the tilt"), std::string::npos);
  EXPECT_NE(refused({.width = kNan}).find("the width"), std::string::npos);
  EXPECT_THROW((void)makeScales({.thickness = 0.08}, V3d(0), 0.05), levelset::InvalidInput);
}

// === Hexagons

TEST(Hexagons, HaveTheVolumeOfTheirPrisms) {
  const Hexagons raised{.tiling = {2, 2, 0}};
  const double tile = 2.4 * 2.4 * std::sqrt(3) / 2, prisms = 4 * std::sqrt(3) / 2 * 0.5;
  const double exact = tile * 0.2 + prisms;
  double errors[2];
  for (int i = 0; i < 2; ++i)
    errors[i] = exact - levelset::measure(makeHexagons(raised, V3d(0), i ? 0.025 : 0.05)).volume;
  EXPECT_LT(std::abs(errors[0]), support::measured(0.0127) * exact);
  EXPECT_LT(std::abs(errors[1]), std::abs(errors[0]) / 3);
  Hexagons comb = raised;
  comb.kind = HexagonKind::Honeycomb;
  const double walls = tile * 0.7 - prisms;
  EXPECT_NEAR(levelset::measure(makeHexagons(comb, V3d(0), 0.025)).volume, walls,
              support::measured(0.00491) * walls);
}

TEST(Hexagons, HaveTheRightNumberOfHoles) {
  // With the overlap: two rows of three complete cells, and one row of four between them.
  const Hexagons comb{.kind = HexagonKind::Honeycomb, .base = 0, .tiling = {3, 2, 0.7}};
  const Measurement m = levelset::measure(makeHexagons(comb, V3d(0), 0.04));
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.euler, 2 - 2 * 10);
  // Without a plate, pillars are separate: two halves below, and above a half between two quarters.
  const Hexagons pillars{.base = 0, .tiling = {2, 1, 0}};
  EXPECT_EQ(levelset::measure(makeHexagons(pillars, V3d(0), 0.04)).components, 2u + 3u);
}

TEST(Hexagons, RepeatAndHaveRoundedEdges) {
  // The row distance is a whole number of voxels to five digits only, so this tests repetition
  // along x.
  const Hexagons hexagons{.size = 1, .gap = 0.2, .rounding = 0.1, .tiling = {1, 2, 0.6}};
  const NarrowBand band = makeHexagons(hexagons, V3d(0), 0.05);
  expectPeriodic(band, V3d(1.2, 0, 0), {V3d(-0.9, -1.2, -1), V3d(-0.3, 1.2, 1)});
  const Hexagons sharp{.size = 1, .gap = 0.2, .tiling = {1, 2, 0.6}};
  EXPECT_LT(levelset::measure(band).volume,
            levelset::measure(makeHexagons(sharp, V3d(0), 0.05)).volume);
  EXPECT_THROW((void)makeHexagons({.height = 0.2, .rounding = 0.3}, V3d(0), 0.05),
               levelset::UsageError);
  EXPECT_THROW((void)makeHexagons({.gap = 0.09}, V3d(0), 0.05), levelset::InvalidInput);
  EXPECT_THROW((void)makeHexagons({.gap = kNan}, V3d(0), 0.05), levelset::UsageError);
}

}  // namespace tile_generators_test
