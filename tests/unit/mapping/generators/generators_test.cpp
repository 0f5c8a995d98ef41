#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "mapping/generators/gyroid.h"
#include "mapping/generators/heightmap.h"
#include "mapping/generators/hexagons.h"
#include "mapping/generators/knurl.h"
#include "mapping/generators/ring.h"
#include "mapping/generators/scales.h"
#include "tests/support/files.h"
#include "tests/support/generators.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace generators_test {

using namespace mapping;
using Imath::V2d;
using Imath::V3d;
using levelset::Measurement;
using levelset::NarrowBand;
using levelset::ShapeOptions;
using support::expectNearest;
using support::expectPeriodic;
using support::expectSound;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// === Properties of all generators

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
  // Shifts by multiples of the voxel, so that the same grid points are at the same positions of the
  // solid. The solid is off the grid, so that no face runs through grid points.
  const V3d aside(0.011, 0.017, 0.013), far(3 * 524288, -3 * 524288, 3 * 262144);
  const auto here = all(aside), there = all(far + aside);
  for (std::size_t i = 0; i < here.size(); ++i) {
    const Measurement a = levelset::measure(here[i].second(0.09375, {})),
                      b = levelset::measure(there[i].second(0.09375, {}));
    // No part of the surface moves by a thousandth of a voxel.
    EXPECT_NEAR(a.volume, b.volume, support::measured(2.14e-4) * 0.09375 * a.area) << here[i].first;
    EXPECT_EQ(a.euler, b.euler) << here[i].first;
  }
}

TEST(Generators, StopWhenCancelledAndRespectMemory) {
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

TEST(Generators, RefuseCentresThatAreNotFinite) {
  for (const auto& [name, make] : all(V3d(0, kNan, 0)))
    EXPECT_THROW((void)make(0.05, {}), levelset::UsageError) << name;
}

// === Ring

TEST(Ring, IsATorusAndKeepsItsCrossSection) {
  const Measurement round = levelset::measure(makeRing({.radius = 1, .tube = 0.2}, V3d(0), 0.04));
  const double exact = 2 * M_PI * M_PI * 0.04;
  EXPECT_NEAR(round.volume, exact, support::measured(2.51e-5) * exact);
  EXPECT_EQ(round.euler, 0);
  const Ring flat{.radius = 1, .section = V2d(0.3, 0.4)};
  double errors[2];
  for (int i = 0; i < 2; ++i)
    errors[i] = std::abs(levelset::measure(makeRing(flat, V3d(0), i ? 0.02 : 0.04)).volume -
                         2 * M_PI * 0.12);
  EXPECT_LT(errors[0], support::measured(0.0124));
  EXPECT_LT(errors[1], errors[0] / 3);
  // Width and height of an inclined ring follow from its angle.
  const Measurement leaning =
      levelset::measure(makeRing({.radius = 1, .tube = 0.2, .lean = 0.5}, V3d(3, 0, 0), 0.04));
  EXPECT_NEAR(leaning.bounds.max.y, std::cos(0.5) + 0.2, support::measured(8.27e-7));
  EXPECT_NEAR(leaning.bounds.max.z, std::sin(0.5) + 0.2, support::measured(1.46e-5));
  EXPECT_NEAR(leaning.centroid.x, 3, support::rounding(8));
}

/// Linking number of two closed curves, by Gauss' integral.
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

TEST(Ring, IsLinkedWithFourOthersInMail) {
  const Ring mail{.radius = 1, .tube = 0.15, .columns = 5, .rows = 7};
  // Ring (2, 3) is half a spacing to the right of rows 2 and 4.
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 5; ++column) {
      if (row == 3 && column == 2) continue;
      const bool isHeld = (row == 2 || row == 4) && (column == 2 || column == 3);
      EXPECT_NEAR(std::abs(linking(mail, {2, 3}, V2d(column, row))), isHeld ? 1 : 0,
                  support::measured(0.00445))
          << column << ", " << row;
    }
}

TEST(Ring, KeepsItsClearanceBetweenRings) {
  const Ring mail{.radius = 1, .tube = 0.15, .columns = 3, .rows = 4};
  const double clearance = ringClearance(mail);
  EXPECT_NEAR(clearance, 0.5022 - 0.3, support::measured(3.27e-5));
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
  EXPECT_NEAR(least - 0.3, clearance, support::measured(2.27e-5));
  const Measurement m = levelset::measure(makeRing(mail, V3d(0), 0.05));
  EXPECT_EQ(m.components, 12u);
  EXPECT_EQ(m.euler, 0);
  EXPECT_NEAR(m.volume, 12 * 2 * M_PI * M_PI * 0.15 * 0.15, support::measured(1.97e-4) * m.volume);
  // Half of the distance between two neighbours lies in the band. Between them the value is at
  // least half of the clearance everywhere.
  const TileBox box = ringBox(mail, V3d(0));
  EXPECT_NEAR(m.bounds.max.x, box.whole.max.x, support::measured(1.41e-4));
  EXPECT_NEAR(m.bounds.max.z, box.whole.max.z, support::measured(3.62e-4));
}

TEST(Ring, RefusesIntersectingWires) {
  const auto refused = [](const Ring& ring) {
    return support::refusal<levelset::UsageError>([&] { (void)makeRing(ring, V3d(0), 0.04); });
  };
  EXPECT_NE(refused({.tube = 0.26, .columns = 2, .rows = 2}).find("the clearance between wires"),
            std::string::npos);
  EXPECT_NE(refused({.tube = 0.15, .columns = 2, .rows = 2, .clearance = 0.3})
                .find("--clearance requires 0.3"),
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

TEST(Gyroid, HasTheDistanceOfItsSurface) {
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
  // Distance between a strut's thinnest position and the surface: the constant of the openings.
  EXPECT_NEAR(gyroidDistance(V3d(0.25, 0, 0.125), 1), kThickestGyroidWall / 2,
              support::measured(1.28e-5));
}

TEST(Gyroid, SheetHasTheVolumeOfSteinersFormula) {
  // V = A t + 2πχ t³/12 with χ = −8 per cell. The sides of the box cut the band's edges.
  const Gyroid gyroid{.cell = 2, .thickness = 0.24};
  const double t = 0.12, exact = (3.0968 * t - 8 * 2 * M_PI / 12 * t * t * t) * 8;
  const Measurement coarse = levelset::measure(makeGyroid(gyroid, V3d(0), 0.05)),
                    fine = levelset::measure(makeGyroid(gyroid, V3d(0), 0.03));
  EXPECT_NEAR(coarse.volume, exact, support::measured(0.0208, 0.03) * exact);
  EXPECT_NEAR(fine.volume, exact, support::measured(0.00371) * exact);
}

TEST(Gyroid, NetworkAtTheSurfaceFillsHalf) {
  const Gyroid half{.kind = GyroidKind::Network, .thickness = kThickestGyroidWall};
  const Measurement m = levelset::measure(makeGyroid(half, V3d(0), 0.03));
  EXPECT_NEAR(m.volume, 0.5, support::measured(0.00605));
  Gyroid thin = half;
  thin.thickness = 0.12;
  EXPECT_LT(levelset::measure(makeGyroid(thin, V3d(0), 0.03)).volume, 0.8 * m.volume);
}

TEST(Gyroid, RepeatsFromCellToCell) {
  const Gyroid gyroid{.cell = 1, .thickness = 0.15, .cells = {3, 1, 1}};
  const NarrowBand band = makeGyroid(gyroid, V3d(0), 0.04);
  expectPeriodic(band, V3d(1, 0, 0), {V3d(-1.3, -0.7, -0.7), V3d(0.3, 0.7, 0.7)});
}

TEST(Gyroid, RefusesInvalidWallsAndCells) {
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
                  support::rounding(1.25) * 0.04)
          << p;
    });
    EXPECT_GT(count, 3000u);
  }
  const Heightmap bowl{.grid = parabola};
  for (const double u : {0.0, 0.03, 0.5, 0.61, 0.99, 1.0})
    for (const double v : {0.0, 0.02, 0.4, 1.0})
      EXPECT_NEAR(heightAt(bowl, u, v), 2 * (u - 0.5) * (u - 0.5) + 2 * (v - 0.5) * (v - 0.5),
                  support::doubleRounding(1))
          << u << ", " << v;
  const Heightmap solid{.grid = parabola, .size = {3, 2}, .height = 0.5, .base = 0.4};
  EXPECT_NEAR(levelset::measure(makeHeightmap(solid, V3d(0), 0.04)).volume,
              6 * (0.4 + 0.5 * 2 * (1.0 / 12 + 1.0 / 12)), support::measured(0.0152, 0.02));
}

TEST(Heightmap, KeepsCliffsAndTheirSides) {
  // A step of a twentieth of the width, far steeper than its neighbourhood.
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
  EXPECT_NEAR(m.volume, 4 * 0.5 + (2 + 0.1) * 2, support::measured(0.0315, 0.04));
}

TEST(Heightmap, HasTheOrientationOfItsPicture) {
  // One bright corner: first row at the top, last column on the right.
  HeightGrid corner{3, 3, {0, 0, 1, 0, 0, 0, 0, 0, 0}};
  const Heightmap map{.grid = corner, .interpolation = HeightInterpolation::Linear};
  EXPECT_EQ(heightAt(map, 1, 1), 1);
  EXPECT_EQ(heightAt(map, 0, 1), 0);
  EXPECT_EQ(heightAt(map, 1, 0), 0);
  EXPECT_DOUBLE_EQ(heightAt(map, 0.75, 0.75), 0.25);
}

TEST(Heightmap, RefusesInvalidGrids) {
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
      << "the result is empty";
}

}  // namespace generators_test
