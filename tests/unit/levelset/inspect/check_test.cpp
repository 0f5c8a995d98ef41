#include "levelset/inspect/check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace check_test {

using namespace levelset;
using openvdb::Coord;

openvdb::FloatGrid::Ptr sphereGrid() {
  return vdb(support::sampleBand([](const Imath::V3d& p) { return p.length() - 10; },
                                 {Imath::V3d(-10), Imath::V3d(10)}, 1))
      .deepCopy();
}

CheckReport checkGrid(openvdb::FloatGrid::Ptr grid) {
  return check(NarrowBand(std::make_shared<VdbGrid>(VdbGrid{std::move(grid)})));
}

/// Names of the items that failed, each followed by a semicolon.
std::string failures(const CheckReport& report) {
  std::string names;
  for (const CheckItem& item : report.items)
    if (!item.passed) names += item.name + ";";
  return names;
}

TEST(Check, AcceptsSoundShapes) {
  const CheckReport report = checkGrid(sphereGrid());
  EXPECT_EQ(failures(report), "");
  EXPECT_TRUE(report.passed());
  EXPECT_EQ(report.items.size(), 10u);
  EXPECT_LT(report.eikonalMean, support::measured(0.00205));
}

TEST(Check, AcceptsCreasesAndNarrowBands) {
  const auto box = [](const Imath::V3d& p) {
    const Imath::V3d q(std::abs(p.x) - 6.3, std::abs(p.y) - 2.2, std::abs(p.z) - 4.4);
    const Imath::V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
    return outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.);
  };
  for (const double halfWidth : {1.0, 2.0, 5.0}) {
    EXPECT_EQ(failures(check(support::sampleBand(box, {Imath::V3d(-7, -3, -5), Imath::V3d(7, 3, 5)},
                                                 1, halfWidth))),
              "");
  }
}

// One grid plane is inside. The difference beside it towards the surface is the difference across
// the plate.
TEST(Check, MeasuresPlatesThinnerThanAVoxel) {
  const auto plate = [](double scale) {
    return [=](const Imath::V3d& p) {
      const Imath::V3d q(std::abs(p.x) - 8.3, std::abs(p.y) - 8.3, std::abs(p.z - 0.4) - 0.45);
      const Imath::V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
      return scale * (outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.));
    };
  };
  const Imath::Box3d extent(Imath::V3d(-10), Imath::V3d(10));
  const CheckReport report = check(support::sampleBand(plate(1), extent, 1));
  EXPECT_TRUE(report.passed());
  EXPECT_LT(report.eikonalMean, support::measured(0.0315, 0.04));
  for (const double scale : {0.8, 1.25})
    EXPECT_GT(check(support::sampleBand(plate(scale), extent, 1)).eikonalMean, 0.1) << scale;
}

TEST(Check, RejectsNoise) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1.5f, 1.5f);
  auto grid = sphereGrid();
  for (auto it = grid->beginValueOn(); it; ++it) it.setValue(value(random));
  const CheckReport report = checkGrid(grid);
  EXPECT_FALSE(report.passed());
  EXPECT_GT(report.eikonalMean, 0.1);
}

TEST(Check, FindsWrongClass) {
  auto grid = sphereGrid();
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(failures(checkGrid(grid)), "level-set class;");
}

TEST(Check, FindsVoxelsThatAreNotCubes) {
  auto grid = sphereGrid();
  grid->transform().preScale(openvdb::Vec3d(1, 1, 1.1));
  EXPECT_NE(failures(checkGrid(grid)).find("uniform voxels;"), std::string::npos);
}

TEST(Check, FindsBackground) {
  auto grid = sphereGrid();
  grid->transform().preScale(10);  // a background of three voxels becomes a third of a voxel
  EXPECT_NE(failures(checkGrid(grid)).find("positive background;"), std::string::npos);
}

TEST(Check, FindsActiveTile) {
  auto grid = sphereGrid();
  grid->tree().addTile(1, Coord(80, 0, 0), 3.f, true);
  EXPECT_EQ(failures(checkGrid(grid)), "no active tiles;");
}

TEST(Check, FindsValuesThatAreNotFinite) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    auto grid = sphereGrid();
    grid->tree().setValueOnly(Coord(12, 0, 0), bad);
    const CheckReport report = checkGrid(grid);
    EXPECT_EQ(failures(report), "finite values;");
    const auto item = std::find_if(report.items.begin(), report.items.end(),
                                   [](const CheckItem& i) { return !i.passed; });
    EXPECT_NE(item->detail.find("[12, 0, 0]"), std::string::npos) << item->detail;
  }
}

TEST(Check, FindsValuesBeyondBackground) {
  auto grid = sphereGrid();
  grid->tree().setValueOnly(Coord(12, 0, 0), 3.5f);
  EXPECT_EQ(failures(checkGrid(grid)), "values within the background;");
}

TEST(Check, FindsAsymmetricBackground) {
  auto grid = sphereGrid();
  for (auto it = grid->beginValueOff(); it; ++it)
    if (*it < 0) it.setValue(-2.5f);
  EXPECT_EQ(failures(checkGrid(grid)), "symmetric background;");
}

TEST(Check, FindsWrongSlope) {
  auto grid = sphereGrid();
  for (auto it = grid->beginValueOn(); it; ++it) it.setValue(*it * 0.6f);
  EXPECT_EQ(failures(checkGrid(grid)), "unit slope at the zero set;eikonal residual;");
}

TEST(Check, ReportsAMissingGrid) {
  EXPECT_FALSE(check(NarrowBand()).passed());
}

}  // namespace check_test
