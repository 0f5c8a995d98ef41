#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "levelset/distance/surface/closest_point.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"

namespace closest_point_lanes_test {

using levelset::eikonal::CompactJet;
using levelset::eikonal::DenseBlock;
using levelset::eikonal::DenseBlockCache;
using levelset::eikonal::DoubleLanes;
using levelset::eikonal::Foot;
using levelset::eikonal::FootSearch;
using levelset::eikonal::Jet;
using levelset::eikonal::JetOf;
using levelset::eikonal::JetSearch;
using levelset::eikonal::kLanes;
using levelset::eikonal::Triple;
using openvdb::Vec3d;

/// A ball of radius 13 voxels whose grid values have errors of up to `noise` voxels.
openvdb::FloatGrid::Ptr noisyBall(double noise) {
  const auto band = levelset::makeSphere(13, {0.31, 0.12, -0.23}, 1, {.halfWidth = 5});
  auto grid = levelset::vdb(band).deepCopy();
  std::mt19937 random(7);
  std::uniform_real_distribution<float> error(static_cast<float>(-noise),
                                              static_cast<float>(noise));
  for (auto it = grid->beginValueOn(); it; ++it) it.setValue(*it + error(random));
  return grid;
}

/// The block (8, 0, 0), through which the surface of noisyBall() runs.
DenseBlock blockOf(const openvdb::FloatGrid& grid) {
  DenseBlock block;
  block.load(grid.getConstAccessor(), openvdb::Coord(8, 0, 0));
  return block;
}

/// Positions in a box from `low` to `high` along each axis.
std::vector<Vec3d> positions(std::size_t count, double low, double high) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> along(low, high);
  std::vector<Vec3d> result;
  for (std::size_t i = 0; i < count; ++i)
    result.emplace_back(along(random), along(random), along(random));
  return result;
}

void expectSameJets(const JetOf<DoubleLanes>& lanes, int lane, const Jet& jet) {
  EXPECT_EQ(lanes.value[lane], jet.value);
  EXPECT_EQ(levelset::eikonal::vectorOf(lanes.gradient, lane), jet.gradient);
  EXPECT_EQ(lanes.xx[lane], jet.xx);
  EXPECT_EQ(lanes.yy[lane], jet.yy);
  EXPECT_EQ(lanes.zz[lane], jet.zz);
  EXPECT_EQ(lanes.xy[lane], jet.xy);
  EXPECT_EQ(lanes.xz[lane], jet.xz);
  EXPECT_EQ(lanes.yz[lane], jet.yz);
}

TEST(ClosestPointLanes, InterpolateTheBitsOfScalarCode) {
  const auto grid = noisyBall(0.2);
  const DenseBlock block = blockOf(*grid);
  DenseBlockCache cache(grid->tree());
  const std::vector<Vec3d> places = positions(400, DenseBlock::kDomainMin, DenseBlock::kDomainMax);
  for (std::size_t first = 0; first < places.size(); first += kLanes) {
    Triple<DoubleLanes> local, global;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vec3d& p = places[first + static_cast<std::size_t>(lane)];
      setLane(local, lane, p);
      setLane(global, lane, p + block.origin().asVec3d());
    }
    JetOf<DoubleLanes> jets, slopes;
    block.jets(local, jets);
    slopes = jets;
    cache.slopes(global, slopes);
    for (int lane = 0; lane < kLanes; ++lane) {
      Jet jet = block.jet(places[first + static_cast<std::size_t>(lane)]);
      expectSameJets(jets, lane, jet);
      const Vec3d at = levelset::eikonal::vectorOf(global, lane);
      const DenseBlock& around = cache.around(at);
      around.slope(at - around.origin().asVec3d(), jet);
      expectSameJets(slopes, lane, jet);
    }
  }
}

TEST(ClosestPointLanes, SearchesFindTheBitsOfSingleSearches) {
  const auto grid = noisyBall(0.3);
  const DenseBlock block = blockOf(*grid);
  const std::vector<Vec3d> from = positions(1001, -4, 11), start = positions(1001, -3, 10);
  std::vector<FootSearch> searches;
  for (std::size_t i = 0; i < from.size(); ++i) searches.push_back({from[i], start[i]});
  std::vector<Foot> feet;
  closestPoints(block, searches, feet);
  ASSERT_EQ(feet.size(), searches.size());
  std::size_t converged = 0, left = 0, failed = 0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const Foot foot = closestPoint(block, from[i], start[i]);
    EXPECT_EQ(feet[i].point, foot.point);
    EXPECT_EQ(feet[i].distance, foot.distance);
    EXPECT_EQ(feet[i].converged, foot.converged);
    EXPECT_EQ(feet[i].left, foot.left);
    ++(foot.converged ? converged : foot.left ? left : failed);
  }
  // Searches end in all ways.
  EXPECT_GT(converged, 50u);
  EXPECT_GT(left, 50u);
  EXPECT_GT(failed, 10u);
}

TEST(ClosestPointLanes, SearchesByTwoStepsFindTheClosestPointsOnTheirOwn) {
  const auto grid = noisyBall(0);
  const Vec3d centre(0.31, 0.12, -0.23);
  DenseBlockCache cache(grid->tree());
  std::vector<Vec3d> from, start;
  for (const Vec3d& direction : positions(203, -1, 1)) {
    const Vec3d n = direction.unit();
    const double radius = 11 + 4 * std::abs(direction.x());
    from.push_back(centre + n * radius);
    // A point of the surface up to 0.6 voxel beside the closest one.
    start.push_back(centre + (n * 13 + Vec3d(n.y(), n.z(), n.x()) * 0.6).unit() * 13);
  }
  std::vector<CompactJet> jets;
  for (const Vec3d& p : start) {
    const DenseBlock& block = cache.around(p);
    jets.emplace_back(block.jet(p - block.origin().asVec3d()));
  }
  std::vector<JetSearch> searches;
  for (std::size_t i = 0; i < from.size(); ++i) searches.push_back({from[i], start[i], &jets[i]});
  std::vector<Foot> feet, one;
  closestPointsByTwoSteps(cache, searches, feet);
  std::size_t converged = 0;
  double error = 0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    closestPointsByTwoSteps(cache, {searches[i]}, one);
    ASSERT_EQ(one.size(), 1u);
    ASSERT_EQ(feet[i].converged, one[0].converged);
    if (!feet[i].converged) continue;
    ++converged;
    EXPECT_EQ(feet[i].point, one[0].point);
    EXPECT_EQ(feet[i].distance, one[0].distance);
    const DenseBlock& block = cache.around(start[i]);
    const Vec3d origin = block.origin().asVec3d();
    const Foot exact = closestPoint(block, from[i] - origin, start[i] - origin);
    ASSERT_TRUE(exact.converged);
    error = std::max(error, std::abs(feet[i].distance - exact.distance));
  }
  EXPECT_GT(converged, feet.size() / 2);
  EXPECT_LE(error, support::measured(2.43e-7));
}

TEST(ClosestPointLanes, SignsChangeAroundThePointsOfTheSurface) {
  const auto grid = noisyBall(0.3);
  const DenseBlock block = blockOf(*grid);
  std::size_t changes = 0;
  for (const Vec3d& p : positions(2000, -2, 9.9)) {
    bool any = false, all = true;
    for (int x = static_cast<int>(std::floor(p.x() - 0.25));
         x <= static_cast<int>(std::floor(p.x() + 0.25)) + 1; ++x)
      for (int y = static_cast<int>(std::floor(p.y() - 0.25));
           y <= static_cast<int>(std::floor(p.y() + 0.25)) + 1; ++y)
        for (int z = static_cast<int>(std::floor(p.z() - 0.25));
             z <= static_cast<int>(std::floor(p.z() + 0.25)) + 1; ++z) {
          any = any || block.at(x, y, z) < 0;
          all = all && block.at(x, y, z) < 0;
        }
    EXPECT_EQ(changesSignAround(block, p), any && !all);
    changes += any && !all;
  }
  EXPECT_GT(changes, 100u);
  EXPECT_LT(changes, 1900u);
}

}  // namespace closest_point_lanes_test
