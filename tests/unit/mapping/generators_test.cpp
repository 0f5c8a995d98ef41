#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/vdb.h"
#include "mapping/generators/gyroid.h"
#include "mapping/generators/heightmap.h"
#include "mapping/generators/hexagons.h"
#include "mapping/generators/knurl.h"
#include "mapping/generators/ring.h"
#include "mapping/generators/scales.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/threads.h"

namespace generators_test {

using namespace mapping;
using Imath::V2d;
using Imath::V3d;
using levelset::Measurement;
using levelset::NarrowBand;
using levelset::ShapeOptions;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Grid values at p and at p + shift agree wherever both are in `box`, to rounding.
void expectPeriodic(const NarrowBand& band, const V3d& shift, const Imath::Box3d& box) {
  const double voxel = band.voxelSize();
  openvdb::Coord step, low, high;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = static_cast<int>(std::lround(shift[axis] / voxel));
    ASSERT_NEAR(step[axis] * voxel, shift[axis], 1e-9) << "whole voxels";
    low[axis] = static_cast<int>(std::ceil(box.min[axis] / voxel));
    high[axis] = static_cast<int>(std::floor(box.max[axis] / voxel));
  }
  const auto values = levelset::vdb(band).getConstAccessor();
  std::size_t compared = 0;
  for (const openvdb::Coord& c : openvdb::CoordBBox(low, high)) {
    ASSERT_NEAR(values.getValue(c), values.getValue(c + step), 2e-5 * voxel) << c;
    compared += values.isValueOn(c);
  }
  EXPECT_GT(compared, 500u);
}

/// Independent of how the band was made: nothing of the other side lies nearer than the value says
/// by `slack`, and something by four of them further, as corners show in so many directions. @param
/// isInside  of the solid
void expectNearest(const NarrowBand& band, const std::function<bool(const V3d&)>& isInside,
                   double slack, std::size_t stride, bool alsoInside = true) {
  std::size_t count = 0, looked = 0, missed = 0;
  support::forEachActive(band, [&](const V3d& p, double phi) {
    const double distance = std::abs(phi);
    if (++count % stride != 0 || distance < 2 * slack || (phi < 0 && !alsoInside)) return;
    ++looked;
    ASSERT_EQ(isInside(p), phi < 0) << p;
    constexpr int kDirections = 1500;
    bool isReached = false;
    for (int k = 0; k < kDirections; ++k) {
      const double z = 1 - (2 * k + 1.0) / kDirections, turn = k * 2.399963229728653;
      const double r = std::sqrt(1 - z * z);
      const V3d direction(r * std::cos(turn), r * std::sin(turn), z);
      ASSERT_EQ(isInside(p + direction * (distance - slack)), phi < 0) << p << " at " << phi;
      isReached = isReached || isInside(p + direction * (distance + 4 * slack)) != (phi < 0);
    }
    missed += !isReached;
  });
  EXPECT_GT(looked, 40u);
  EXPECT_LT(static_cast<double>(missed), 0.06 * static_cast<double>(looked))
      << "slim corners hide between the directions, faces do not";
}

void expectSound(const NarrowBand& band) {
  const levelset::CheckReport report = levelset::check(band);
  for (const levelset::CheckItem& item : report.items)
    EXPECT_TRUE(item.passed) << item.name << ": " << item.detail;
}

// === What all of them promise

using Make = std::function<NarrowBand(double voxel, const ShapeOptions&)>;

const HeightGrid& hill() {
  static const HeightGrid grid = [] {
    HeightGrid made{9, 7, {}};
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 9; ++i)
        made.heights.push_back(0.5 + 0.5 * std::sin(0.9 * i) * std::cos(0.7 * j));
    return made;
  }();
  return grid;
}

std::vector<std::pair<const char*, Make>> all(const V3d& center = V3d(0)) {
  return {
      {"knurl",
       [=](double h, const ShapeOptions& o) {
         return makeKnurl({.pitch = 1, .base = 0.3}, center, h, o);
       }},
      {"scales",
       [=](double h, const ShapeOptions& o) {
         return makeScales({.length = 1.4, .tiling = {1, 2, 0}}, center, h, o);
       }},
      {"hexagons",
       [=](double h, const ShapeOptions& o) {
         return makeHexagons({.rounding = 0.1, .tiling = {1, 2, 0}}, center, h, o);
       }},
      {"ring",
       [=](double h, const ShapeOptions& o) {
         return makeRing({.radius = 1, .tube = 0.15, .columns = 1, .rows = 2}, center, h, o);
       }},
      {"gyroid",
       [=](double h, const ShapeOptions& o) {
         return makeGyroid({.cell = 1.7, .thickness = 0.205}, center, h, o);
       }},
      {"heightmap",
       [=](double h, const ShapeOptions& o) {
         return makeHeightmap({.grid = hill(), .size = {2, 1.5}, .height = 0.5, .base = 0.3},
                              center, h, o);
       }},
  };
}

TEST(Generators, AreSoundLevelSets) {
  for (const auto& [name, make] : all()) {
    SCOPED_TRACE(name);
    const NarrowBand band = make(0.08, {});
    EXPECT_DOUBLE_EQ(band.halfWidth(), 3);
    expectSound(band);
    EXPECT_EQ(levelset::measure(band).cavities, 0u);
    EXPECT_DOUBLE_EQ(make(0.1, {.halfWidth = 5}).halfWidth(), 5);
  }
}

TEST(Generators, DoNotDependOnThreads) {
  for (const auto& [name, make] : all()) {
    const auto hash = [&] { return make(0.1, {}).contentHash(); };
    const std::uint64_t one = support::onThreads(1, hash);
    EXPECT_EQ(one, support::onThreads(3, hash)) << name;
  }
}

TEST(Generators, KeepTheirShapeFarFromTheOrigin) {
  // Multiples of the voxel, so that the same grid points lie at the same places of the solid;
  // beside the grid, lest faces run through its points.
  const V3d aside(0.011, 0.017, 0.013), far(3 * 524288, -3 * 524288, 3 * 262144);
  const auto here = all(aside), there = all(far + aside);
  for (std::size_t i = 0; i < here.size(); ++i) {
    const Measurement a = levelset::measure(here[i].second(0.09375, {})),
                      b = levelset::measure(there[i].second(0.09375, {}));
    // No part of the surface has moved by a thousandth of a voxel.
    EXPECT_NEAR(a.volume, b.volume, 1e-3 * 0.09375 * a.area) << here[i].first;
    EXPECT_EQ(a.euler, b.euler) << here[i].first;
  }
}

TEST(Generators, StopWhenAskedAndMindTheMemory) {
  for (const auto& [name, make] : all()) {
    EXPECT_THROW((void)make(0.08, {.progress = [](double) { return false; }}), levelset::Cancelled)
        << name;
    EXPECT_THROW((void)make(0.02, {.maxMemory = 200'000}), levelset::ResourceLimit) << name;
    EXPECT_THROW((void)make(1e-9, {}), levelset::ResourceLimit) << name;
    EXPECT_THROW((void)make(50, {}), levelset::InvalidInput) << name;
    for (const double bad : {0.0, -1.0, kNan})
      EXPECT_THROW((void)make(bad, {}), levelset::UsageError) << name << bad;
    EXPECT_THROW((void)make(0.08, {.halfWidth = 0.5}), levelset::UsageError) << name;
    double last = 0;
    (void)make(0.08, {.progress = [&](double fraction) {
                 EXPECT_GE(fraction, last) << name;
                 last = fraction;
                 return true;
               }});
    EXPECT_EQ(last, 1) << name;
  }
}

TEST(Generators, RefuseCentresThatAreNowhere) {
  for (const auto& [name, make] : all(V3d(0, kNan, 0)))
    EXPECT_THROW((void)make(0.05, {}), levelset::UsageError) << name;
}

// === Knurl

/// Height below the crests, by the grooves' distance from their middles.
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

TEST(Knurl, IsExactlyAsFarAsItsFlanks) {
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
  // A land of width a between grooves of a sharp profile: the mean of the smaller of two heights.
  const Knurl knurl{.pitch = 1, .base = 0.4, .tiling = {1, 1, 0}};
  const double area = 1 / (std::cos(knurl.grooveAngle) * std::sin(knurl.grooveAngle));
  const double exact = area * (0.4 + sharpDepth(knurl) / 3);
  double errors[2];
  for (int i = 0; i < 2; ++i)
    errors[i] =
        std::abs(levelset::measure(makeKnurl(knurl, V3d(0), i ? 0.01 : 0.04)).volume - exact);
  EXPECT_LT(errors[0], 0.01 * exact);
  EXPECT_LT(errors[1], errors[0] / 3) << "edges are rounded by the grid: second order";
  const Knurl straight{.pattern = KnurlPattern::Straight, .pitch = 1, .base = 0.4};
  EXPECT_NEAR(levelset::measure(makeKnurl(straight, V3d(0), 0.02)).volume,
              0.4 + sharpDepth(straight) / 2, 0.005);
}

TEST(Knurl, GoesOnAcrossTheSidesOfItsTile) {
  // tan = 3/4: periods of 5/4 and 5/3 pitches, whole numbers of voxels.
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
  EXPECT_NEAR(box.tile.size().x, 3 / std::cos(M_PI / 6), 1e-9);
  EXPECT_NEAR(box.tile.size().y, 2 / std::sin(M_PI / 6), 1e-9);
  EXPECT_NEAR(box.whole.size().x, box.tile.size().x + 1, 1e-12);
}

TEST(Knurl, RefusesWhatNoWheelMakes) {
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

TEST(Scales, StandOnOnePlateAndGoOnAcrossTheTile) {
  const Scales scales{.length = 1.6, .width = 1.2, .step = 0.8, .tiling = {2, 2, 0.6}};
  const NarrowBand band = makeScales(scales, V3d(0), 0.04);
  const Measurement m = levelset::measure(band);
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.euler, 2);
  const TileBox box = scalesBox(scales, V3d(0));
  EXPECT_NEAR(box.whole.size().z, 0.3 + 1.6 * std::sin(scales.tilt), 1e-12);
  EXPECT_NEAR(m.bounds.max.z, box.whole.max.z, 0.04);
  const Imath::Box3d near(V3d(-1.6, -1.2, -1), V3d(-0.8, -0.4, 1));
  expectPeriodic(band, V3d(2.4, 0, 0), near);
  expectPeriodic(band, V3d(0, 1.6, 0), near);
}

TEST(Scales, AreAsFarFromOutsideAsTheirSurface) {
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

TEST(Scales, LeaveRoomUnderTheirTips) {
  // The undercut: a ray upwards before a tip leaves the plate, meets air, and then the scale.
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

TEST(Scales, RefuseWhatDoesNotOverlap) {
  const auto refused = [](const Scales& scales) {
    return support::refusal<levelset::UsageError>([&] { (void)makeScales(scales, V3d(0), 0.05); });
  };
  EXPECT_NE(refused({.step = 2}).find("do not overlap"), std::string::npos);
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
  EXPECT_LT(std::abs(errors[0]), 0.02 * exact);
  EXPECT_LT(std::abs(errors[1]), std::abs(errors[0]) / 3);
  Hexagons comb = raised;
  comb.kind = HexagonKind::Honeycomb;
  const double walls = tile * 0.7 - prisms;
  EXPECT_NEAR(levelset::measure(makeHexagons(comb, V3d(0), 0.025)).volume, walls, 0.01 * walls);
}

TEST(Hexagons, CountTheirHoles) {
  // With the overlap two rows of three whole cells, and between them one of four.
  const Hexagons comb{.kind = HexagonKind::Honeycomb, .base = 0, .tiling = {3, 2, 0.7}};
  const Measurement m = levelset::measure(makeHexagons(comb, V3d(0), 0.04));
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.euler, 2 - 2 * 10);
  // Without a plate, pillars are apart: two halves below, and above a half between two quarters.
  const Hexagons pillars{.base = 0, .tiling = {2, 1, 0}};
  EXPECT_EQ(levelset::measure(makeHexagons(pillars, V3d(0), 0.04)).components, 2u + 3u);
}

TEST(Hexagons, RepeatAndRoundTheirEdges) {
  // A spacing whose row distance is a whole number of voxels to five digits only: along x.
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

// === Ring

TEST(Ring, IsATorusAndKeepsItsSection) {
  const Measurement round = levelset::measure(makeRing({.radius = 1, .tube = 0.2}, V3d(0), 0.04));
  const double exact = 2 * M_PI * M_PI * 0.04;
  EXPECT_NEAR(round.volume, exact, 1e-4 * exact);
  EXPECT_EQ(round.euler, 0);
  const Ring flat{.radius = 1, .section = V2d(0.3, 0.4)};
  double errors[2];
  for (int i = 0; i < 2; ++i)
    errors[i] = std::abs(levelset::measure(makeRing(flat, V3d(0), i ? 0.02 : 0.04)).volume -
                         2 * M_PI * 0.12);
  EXPECT_LT(errors[0], 0.02);
  EXPECT_LT(errors[1], errors[0] / 3);
  // A leaning ring is as wide and as high as its turn says.
  const Measurement leaning =
      levelset::measure(makeRing({.radius = 1, .tube = 0.2, .lean = 0.5}, V3d(3, 0, 0), 0.04));
  EXPECT_NEAR(leaning.bounds.max.y, std::cos(0.5) + 0.2, 0.004);
  EXPECT_NEAR(leaning.bounds.max.z, std::sin(0.5) + 0.2, 0.004);
  EXPECT_NEAR(leaning.centroid.x, 3, 1e-3);
}

/// How often the first closed line winds about the second, by Gauss' integral.
double linking(const Ring& ring, V2d first, V2d second) {
  constexpr int n = 200;
  const auto at = [&](V2d which, int i) {
    const int row = static_cast<int>(which.y);
    const double lean = ringLean(ring, row), t = 2 * M_PI * i / n;
    return ringCenter(ring, static_cast<int>(which.x), row) +
           V3d(std::cos(t), std::sin(t) * std::cos(lean), std::sin(t) * std::sin(lean)) *
               ring.radius;
  };
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const V3d a = at(first, i), b = at(second, j), d = a - b;
      sum += ((at(first, i + 1) - a) % (at(second, j + 1) - b) ^ d) / std::pow(d.length(), 3);
    }
  return sum / (4 * M_PI);
}

TEST(Ring, HoldsFourOthersInMail) {
  const Ring mail{.radius = 1, .tube = 0.15, .columns = 5, .rows = 7};
  // Ring (2, 3) stands half a spacing to the right of rows 2 and 4.
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 5; ++column) {
      if (row == 3 && column == 2) continue;
      const bool isHeld = (row == 2 || row == 4) && (column == 2 || column == 3);
      EXPECT_NEAR(std::abs(linking(mail, {2, 3}, V2d(column, row))), isHeld ? 1 : 0, 0.05)
          << column << ", " << row;
    }
}

TEST(Ring, LeavesItsClearanceBetweenRings) {
  const Ring mail{.radius = 1, .tube = 0.15, .columns = 3, .rows = 4};
  const double clearance = ringClearance(mail);
  EXPECT_NEAR(clearance, 0.5022 - 0.3, 1e-4);
  // By brute force over points of all circles.
  double least = HUGE_VAL;
  std::vector<std::vector<V3d>> circles;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column) {
      circles.emplace_back();
      const double lean = ringLean(mail, row);
      for (int i = 0; i < 300; ++i) {
        const double t = 2 * M_PI * i / 300;
        circles.back().push_back(ringCenter(mail, column, row) + V3d(std::cos(t),
                                                                     std::sin(t) * std::cos(lean),
                                                                     std::sin(t) * std::sin(lean)));
      }
    }
  for (std::size_t a = 0; a < circles.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      for (const V3d& p : circles[a])
        for (const V3d& q : circles[b]) least = std::min(least, (p - q).length());
  EXPECT_GE(least - 0.3, clearance - 1e-9);
  EXPECT_NEAR(least - 0.3, clearance, 2e-3);
  const Measurement m = levelset::measure(makeRing(mail, V3d(0), 0.05));
  EXPECT_EQ(m.components, 12u);
  EXPECT_EQ(m.euler, 0);
  EXPECT_NEAR(m.volume, 12 * 2 * M_PI * M_PI * 0.15 * 0.15, 2e-3 * m.volume);
  // The distance of two neighbours is in the band: nowhere between them less than half of it.
  const TileBox box = ringBox(mail, V3d(0));
  EXPECT_NEAR(m.bounds.max.x, box.whole.max.x, 0.01);
  EXPECT_NEAR(m.bounds.max.z, box.whole.max.z, 0.01);
}

TEST(Ring, RefusesWiresThatMeet) {
  const auto refused = [](const Ring& ring) {
    return support::refusal<levelset::UsageError>([&] { (void)makeRing(ring, V3d(0), 0.04); });
  };
  EXPECT_NE(refused({.tube = 0.26, .columns = 2, .rows = 2}).find("come within"),
            std::string::npos);
  EXPECT_NE(refused({.tube = 0.15, .columns = 2, .rows = 2, .clearance = 0.3}).find("to be left"),
            std::string::npos);
  EXPECT_NE(refused({.tube = 0.1, .columns = 2, .rows = 2, .spacing = V2d(3, 3)}).find("hold"),
            std::string::npos);
  EXPECT_NE(refused({.tube = 1}).find("torus"), std::string::npos);
  EXPECT_NE(refused({.section = V2d(2, 0.1)}).find("closes"), std::string::npos);
  EXPECT_NE(refused({.radius = kNan}).find("the radius"), std::string::npos);
  EXPECT_NE(refused({.lean = kNan}).find("the lean"), std::string::npos);
  EXPECT_NE(refused({.columns = 0}).find("columns"), std::string::npos);
  EXPECT_THROW((void)makeRing({.tube = 0.03}, V3d(0), 0.04), levelset::InvalidInput);
}

// === Gyroid

double gyroidFormula(const V3d& p) {
  const V3d q = p * (2 * M_PI);
  return std::sin(q.x) * std::cos(q.y) + std::sin(q.y) * std::cos(q.z) +
         std::sin(q.z) * std::cos(q.x);
}

TEST(Gyroid, DistanceIsThatOfTheSurface) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int looked = 0;
  for (int n = 0; n < 600; ++n) {
    const V3d p(uniform(random), uniform(random), uniform(random));
    const double signedDistance = gyroidDistance(p, 1), distance = std::abs(signedDistance);
    if (distance > 0.12) continue;
    ++looked;
    ASSERT_EQ(signedDistance > 0, gyroidFormula(p) > 0);
    bool isReached = false;
    for (int k = 0; k < 2000; ++k) {
      const double z = 1 - (2 * k + 1.0) / 2000, t = k * 2.399963229728653,
                   r = std::sqrt(1 - z * z);
      const V3d direction(r * std::cos(t), r * std::sin(t), z);
      ASSERT_EQ(gyroidFormula(p + direction * (distance - 1e-6)) > 0, signedDistance > 0) << p;
      isReached = isReached ||
                  (gyroidFormula(p + direction * (distance + 5e-4)) > 0) != (signedDistance > 0);
    }
    ASSERT_TRUE(isReached) << p << " " << distance;
  }
  EXPECT_GT(looked, 300);
  // Between a strut's thinnest place and the surface, the constant of the openings.
  EXPECT_NEAR(gyroidDistance(V3d(0.25, 0, 0.125), 1), kThickestGyroidWall / 2, 1e-4);
}

TEST(Gyroid, SheetHasTheVolumeOfSteinersFormula) {
  // V = A t + 2πχ t³/12 with χ = −8 in a cell; the box's sides cut the band's edges.
  const Gyroid gyroid{.cell = 2, .thickness = 0.24};
  const double t = 0.12, exact = (3.0968 * t - 8 * 2 * M_PI / 12 * t * t * t) * 8;
  const Measurement coarse = levelset::measure(makeGyroid(gyroid, V3d(0), 0.05)),
                    fine = levelset::measure(makeGyroid(gyroid, V3d(0), 0.03));
  EXPECT_NEAR(coarse.volume, exact, 0.03 * exact);
  EXPECT_NEAR(fine.volume, exact, 0.012 * exact);
}

TEST(Gyroid, NetworkFillsHalfWhereItMeetsTheSurface) {
  const Gyroid half{.kind = GyroidKind::Network, .thickness = kThickestGyroidWall};
  const Measurement m = levelset::measure(makeGyroid(half, V3d(0), 0.03));
  EXPECT_NEAR(m.volume, 0.5, 0.01);
  Gyroid thin = half;
  thin.thickness = 0.12;
  EXPECT_LT(levelset::measure(makeGyroid(thin, V3d(0), 0.03)).volume, 0.8 * m.volume);
}

TEST(Gyroid, RepeatsFromCellToCell) {
  const Gyroid gyroid{.cell = 1, .thickness = 0.15, .cells = {3, 1, 1}};
  const NarrowBand band = makeGyroid(gyroid, V3d(0), 0.04);
  expectPeriodic(band, V3d(1, 0, 0), {V3d(-1.3, -0.7, -0.7), V3d(0.3, 0.7, 0.7)});
}

TEST(Gyroid, RefusesWallsThatCloseIt) {
  EXPECT_THROW((void)makeGyroid({.thickness = 0.25}, V3d(0), 0.02), levelset::UsageError);
  EXPECT_THROW((void)makeGyroid({.thickness = 0}, V3d(0), 0.02), levelset::UsageError);
  EXPECT_THROW((void)makeGyroid({.cell = kNan}, V3d(0), 0.02), levelset::UsageError);
  EXPECT_THROW((void)makeGyroid({.cells = {1, 0, 1}}, V3d(0), 0.02), levelset::UsageError);
  EXPECT_THROW((void)makeGyroid({.thickness = 0.1}, V3d(0), 0.06), levelset::InvalidInput);
}

// === Heightmap

TEST(Heightmap, IsExactOnPlanesRampsAndParabolas) {
  HeightGrid ramp{5, 4, {}}, parabola{9, 7, {}};
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 5; ++i) ramp.heights.push_back(i / 4.0 * 0.5 + (3 - j) / 3.0 * 0.5);
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 9; ++i)
      parabola.heights.push_back((i - 4) * (i - 4) / 32.0 + (j - 3) * (j - 3) / 18.0);
  for (const HeightInterpolation how : {HeightInterpolation::Linear, HeightInterpolation::Cubic}) {
    const Heightmap plane{
        .grid = ramp, .size = {2, 1.5}, .height = 0.8, .base = 0.3, .interpolation = how};
    std::size_t count = 0;
    // The plane z = −0.25 + 0.2 (x + 1) + 0.8/3 (y + 0.75), away from the border.
    support::forEachActive(makeHeightmap(plane, V3d(0), 0.04), [&](const V3d& p, double phi) {
      if (std::abs(p.x) > 0.75 || std::abs(p.y) > 0.5 || p.z < -0.4) return;
      ++count;
      const double slope = 0.8 / 3;
      ASSERT_NEAR(phi,
                  (p.z + 0.25 - 0.2 * (p.x + 1) - slope * (p.y + 0.75)) /
                      std::sqrt(1 + 0.04 + slope * slope),
                  1e-4 * 0.04)
          << p;
    });
    EXPECT_GT(count, 3000u);
  }
  const Heightmap bowl{.grid = parabola};
  for (const double u : {0.0, 0.03, 0.5, 0.61, 0.99, 1.0})
    for (const double v : {0.0, 0.02, 0.4, 1.0})
      EXPECT_NEAR(heightAt(bowl, u, v), 2 * (u - 0.5) * (u - 0.5) + 2 * (v - 0.5) * (v - 0.5),
                  1e-12)
          << u << ", " << v;
  const Heightmap solid{.grid = parabola, .size = {3, 2}, .height = 0.5, .base = 0.4};
  EXPECT_NEAR(levelset::measure(makeHeightmap(solid, V3d(0), 0.04)).volume,
              6 * (0.4 + 0.5 * 2 * (1.0 / 12 + 1.0 / 12)), 0.02);
}

TEST(Heightmap, KeepsCliffsAndTheirSides) {
  // A step of a twentieth of the width, far steeper than anything beside it.
  HeightGrid step{21, 2, {}};
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 21; ++i) step.heights.push_back(i < 10 ? 0 : 1);
  const Heightmap cliff{.grid = step,
                        .size = {4, 1},
                        .height = 2,
                        .base = 0.5,
                        .interpolation = HeightInterpolation::Linear};
  const NarrowBand band = makeHeightmap(cliff, V3d(0), 0.05);
  expectSound(band);
  const Measurement m = levelset::measure(band);
  EXPECT_EQ(m.euler, 2);
  EXPECT_NEAR(m.volume, 4 * 0.5 + (2 + 0.1) * 2, 0.04);
}

TEST(Heightmap, StandsWhereItsPictureDoes) {
  // One bright corner: first row on top, last column to the right.
  HeightGrid corner{3, 3, {0, 0, 1, 0, 0, 0, 0, 0, 0}};
  const Heightmap map{.grid = corner, .interpolation = HeightInterpolation::Linear};
  EXPECT_EQ(heightAt(map, 1, 1), 1);
  EXPECT_EQ(heightAt(map, 0, 1), 0);
  EXPECT_EQ(heightAt(map, 1, 0), 0);
  EXPECT_DOUBLE_EQ(heightAt(map, 0.75, 0.75), 0.25);
}

TEST(Heightmap, RefusesWhatIsNoGrid) {
  const auto refused = [](const Heightmap& heightmap) {
    return support::refusal<levelset::UsageError>(
        [&] { (void)makeHeightmap(heightmap, V3d(0), 0.05); });
  };
  EXPECT_NE(refused({.grid = {1, 2, {0, 1}}}).find("at least two"), std::string::npos);
  EXPECT_NE(refused({.grid = {2, 2, {0, 1, 1}}}).find("3 heights"), std::string::npos);
  EXPECT_NE(refused({.grid = {2, 2, {0, 1, kNan, 0}}}).find("row 2, column 1"), std::string::npos);
  EXPECT_NE(refused({.grid = {2, 2, {0, 1, 1, 0}}, .height = 0}).find("the height"),
            std::string::npos);
  EXPECT_NE(refused({.grid = {2, 2, {0, 1, 1, 0}}, .base = kNan}).find("the base"),
            std::string::npos);
  EXPECT_THROW((void)makeHeightmap({.grid = {2, 2, {0, 0, 0, 0}}}, V3d(0, 0, 0.01), 0.05),
               levelset::InvalidInput)
      << "nothing is left of it";
}

}  // namespace generators_test
