#include "mapping/placement/scatter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "mapping/patches/patch_space.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"
#include "tests/support/threads.h"

namespace scatter_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;
using mapping::Patch;
using mapping::ScatterDensity;
using mapping::scatterPoints;
using mapping::SurfacePoint;

constexpr double kRadius = 2;

NarrowBand ball() {
  return support::makeBall(kRadius, 0.1);
}

double greatCircle(const V3d& a, const V3d& b) {
  return kRadius * std::atan2(a.cross(b).length(), a.dot(b));
}

double leastApart(const std::vector<SurfacePoint>& points, std::size_t count) {
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j)
      least = std::min(least, greatCircle(points[i].position, points[j].position));
  return least;
}

TEST(ScatteredPoints, LieOnTheSurface) {
  const auto points = scatterPoints(ball(), {.count = 200}).points;
  for (const SurfacePoint& p : points) {
    EXPECT_NEAR(p.position.length(), kRadius, support::measured(1.35e-5));
    EXPECT_GT(p.normal.dot(p.position) / kRadius, 1 - 1e-4);
  }
}

TEST(ScatteredPoints, KeepTheirDistanceAndLeaveNoSpace) {
  const double distance = 0.5;
  const auto result = scatterPoints(ball(), {.distance = distance});
  ASSERT_EQ(result.points.size(), result.wanted);
  const double least = leastApart(result.points, result.wanted);
  EXPECT_GE(least, distance * (1 - 2e-3));
  EXPECT_NEAR(result.distance, least, support::measured(7.12e-6) * least);
  // No position has space for a disc of twice the distance.
  for (int n = 0; n < 2000; ++n) {
    const double z = 2 * (n + 0.5) / 2000 - 1, angle = 2.399963 * n, r = std::sqrt(1 - z * z);
    const V3d place = V3d(r * std::cos(angle), r * std::sin(angle), z) * kRadius;
    double nearest = HUGE_VAL;
    for (const SurfacePoint& p : result.points)
      nearest = std::min(nearest, greatCircle(place, p.position));
    EXPECT_LT(nearest, support::measured(1.05, 1.3) * distance);
  }
}

TEST(ScatteredPoints, OfAFixedCountAreSpreadLikeDiscs) {
  // Blue noise keeps at least 0.65 of the distance of the densest packing.
  for (const std::size_t count : {20u, 100u, 400u}) {
    const auto result = scatterPoints(ball(), {.count = count});
    ASSERT_EQ(result.wanted, count);
    const double densest =
        std::sqrt(4 * M_PI * kRadius * kRadius * 2 / (std::sqrt(3.0) * static_cast<double>(count)));
    EXPECT_GT(leastApart(result.points, count), 0.65 * densest) << count;
    // Uniform by area: equally many above and below.
    const auto above = std::count_if(result.points.begin(),
                                     result.points.begin() + static_cast<std::ptrdiff_t>(count),
                                     [](const SurfacePoint& p) { return p.position.z > 0; });
    EXPECT_NEAR(static_cast<double>(above), 0.5 * static_cast<double>(count),
                2 + 0.05 * static_cast<double>(count));
  }
}

TEST(ScatteredPoints, FollowScaleAndWeight) {
  const auto scale = [](const V3d& p) { return p.z > 0 ? 1.0 : 2.0; };
  const auto points = scatterPoints(ball(), {.distance = 0.3, .scale = scale}).points;
  double above = 0, below = 0;
  for (const SurfacePoint& p : points) (p.position.z > 0 ? above : below) += 1;
  EXPECT_NEAR(above / below, 4, support::measured(0.0227));  // discs of half the radius
  // A small region of a small scale holds as many points as it does if that scale applies
  // everywhere.
  const auto inCap = [](const std::vector<SurfacePoint>& all) {
    return static_cast<double>(
        std::count_if(all.begin(), all.end(), [](const auto& p) { return p.position.x > 1.8; }));
  };
  const auto fine = [](const V3d&) { return 0.1; };
  const auto fineInCap = [](const V3d& p) { return p.x > 1.8 ? 0.1 : 1.0; };
  const auto onlyCap = [](const V3d& p) { return p.x > 1.8 ? 1.0 : 0.0; };
  const double some = inCap(scatterPoints(ball(), {.distance = 1, .scale = fineInCap}).points);
  const double full =
      inCap(scatterPoints(ball(), {.distance = 1, .scale = fine, .weight = onlyCap}).points);
  EXPECT_NEAR(some, full, support::measured(0.0233) * full);
  const auto weighted = scatterPoints(
      ball(), {.count = 50, .weight = [](const V3d& p) { return p.x > 1.5 ? 1.0 : 0.0; }});
  ASSERT_EQ(weighted.wanted, 50u);
  for (const SurfacePoint& p : weighted.points) EXPECT_GT(p.position.x, 1.49);
}

TEST(ScatteredPoints, FollowAShareThatDependsOnTheNormal) {
  const auto flat = [](const V3d&, const V3d& normal) { return normal.z > 0.8 ? 1.0 : 0.0; };
  const auto level = scatterPoints(ball(), {.count = 60, .share = flat});
  ASSERT_EQ(level.wanted, 60u);
  for (const SurfacePoint& p : level.points) EXPECT_GT(p.normal.z, 0.8);
  // The cap is as dense as one that a weight of the position leaves, and both multiply.
  const auto high = [](const V3d& p) { return p.z > 0.8 * kRadius ? 1.0 : 0.0; };
  const auto same = scatterPoints(ball(), {.count = 60, .weight = high});
  EXPECT_NEAR(level.distance, same.distance, support::measured(1e-3) * same.distance);
  const auto east = [](const V3d& p) { return p.x > 0 ? 1.0 : 0.0; };
  for (const SurfacePoint& p :
       scatterPoints(ball(), {.count = 30, .weight = east, .share = flat}).points) {
    EXPECT_GT(p.position.x, -0.01);
    EXPECT_GT(p.normal.z, 0.8);
  }
  // Beyond 1 it is 1.
  const auto twice = [](const V3d&, const V3d&) { return 2.0; };
  EXPECT_EQ(scatterPoints(ball(), {.count = 40, .share = twice}).points.size(),
            scatterPoints(ball(), {.count = 40}).points.size());
  const auto none = [](const V3d&, const V3d&) { return 0.0; };
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .share = none}), InvalidInput);
  const auto bad = [](const V3d&, const V3d& n) { return std::sqrt(n.z - 2); };
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .share = bad}), UsageError);
}

TEST(ScatteredPoints, DependOnTheSeedOnly) {
  const auto places = [](std::uint64_t seed) {
    std::vector<double> result;
    for (const SurfacePoint& p : scatterPoints(ball(), {.count = 30, .seed = seed}).points)
      result.push_back(p.position.x);
    return result;
  };
  EXPECT_EQ(places(1), places(1));
  EXPECT_NE(places(1), places(2));
  EXPECT_EQ(support::onThreads(1, [&] { return places(1); }),
            support::onThreads(5, [&] { return places(1); }));
}

TEST(ScatteredPoints, DoNotInteractThroughThinWalls) {
  // Both sides of a plate of two voxels get points of their own.
  const NarrowBand plate = support::sampleBand(
      [](const V3d& p) {
        return std::max({std::abs(p.x) - 2, std::abs(p.y) - 2, std::abs(p.z) - 0.1});
      },
      {V3d(-2, -2, -0.1), V3d(2, 2, 0.1)}, 0.1);
  const auto result = scatterPoints(plate, {.distance = 1});
  double near = HUGE_VAL;
  for (const SurfacePoint& a : result.points)
    for (const SurfacePoint& b : result.points)
      if (a.normal.z > 0.9 && b.normal.z < -0.9)
        near = std::min(near, std::hypot(a.position.x - b.position.x, a.position.y - b.position.y));
  EXPECT_LT(near, 0.9);
}

TEST(ScatteredPoints, RefuseInvalidOptions) {
  EXPECT_THROW((void)scatterPoints(ball(), {}), UsageError);
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .distance = 1}), UsageError);
  EXPECT_THROW((void)scatterPoints(ball(), {.distance = std::nan("")}), UsageError);
  EXPECT_THROW((void)scatterPoints(ball(), {.distance = 1e-6}), levelset::ResourceLimit);
  EXPECT_THROW((void)scatterPoints({}, {.count = 3}), InvalidInput);
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .scale = [](const V3d&) { return 0.0; }}),
               UsageError);
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .weight = [](const V3d&) { return 0.0; }}),
               InvalidInput);
  EXPECT_THROW((void)scatterPoints(ball(), {.count = 3, .progress = [](double) { return false; }}),
               levelset::Cancelled);
  EXPECT_EQ(scatterPoints(ball(), {.count = 1}).wanted, 1u);
  EXPECT_EQ(scatterPoints(ball(), {.distance = 12}).wanted, 1u);
}

mapping::ScatterOptions small(std::size_t count) {
  return {.density = {.count = count},
          .uSize = 0.8,
          .vSize = 0.6,
          .patch = {.layers = 2, .spacing = 0.2}};
}

TEST(Scatter, PlacesPatchesOfTheRequestedSize) {
  mapping::ScatterOptions options = small(12);
  options.direction = [](const V3d&, double) { return V3d(0, 0, 1); };
  const auto result = mapping::scatter(ball(), 0.3, options);
  ASSERT_EQ(result.patches.size(), 12u);
  EXPECT_EQ(result.leftOut, 0u);
  for (const Patch& patch : result.patches) {
    const mapping::ParticleLayer& layer = patch.layers.front();
    const V3d first = layer.at(0, 0), last = layer.at(layer.columns - 1, 0);
    EXPECT_NEAR(greatCircle(first, last), 0.8, support::measured(0.00305));
    // u points towards the pole, except close to it.
    const V3d center = layer.at(layer.columns / 2, layer.rows / 2);
    if (std::abs(center.z) > 1.6) continue;
    const V3d u = (layer.at(layer.columns - 1, layer.rows / 2) - layer.at(0, layer.rows / 2));
    const V3d normal = center.normalized();
    const V3d pole = (V3d(0, 0, 1) - normal * normal.z).normalized();
    EXPECT_GT(u.normalized().dot(pole), 0.97);
  }
}

TEST(Scatter, RefusesInvalidDirections) {
  mapping::ScatterOptions options = small(3);
  options.direction = [](const V3d&, double) { return V3d(std::nan(""), 0, 0); };
  EXPECT_THROW((void)mapping::scatter(ball(), 0.3, options), UsageError);
}

TEST(Scatter, ScalesAndRotatesPatches) {
  mapping::ScatterOptions options = small(10);
  options.density.scale = [](const V3d& p) { return p.x > 0 ? 1.0 : 0.5; };
  options.jitter = M_PI;
  const auto result = mapping::scatter(ball(), 0.3, options);
  for (const Patch& patch : result.patches) {
    const mapping::ParticleLayer& layer = patch.layers.front();
    const double scale = layer.at(layer.columns / 2, layer.rows / 2).x > 0 ? 1.0 : 0.5;
    EXPECT_NEAR(greatCircle(layer.at(0, 0), layer.at(layer.columns - 1, 0)), 0.8 * scale,
                support::measured(0.00305) * scale);
    EXPECT_DOUBLE_EQ(patch.height, 0.3 * scale);
  }
  // Known sites give the same patches again.
  const std::vector<Patch> again = mapping::makePatches(ball(), result.sites, 0.3, options.patch);
  ASSERT_EQ(again.size(), result.patches.size());
  for (std::size_t n = 0; n < again.size(); ++n)
    EXPECT_EQ(again[n].layers.front().positions, result.patches[n].layers.front().positions);
}

TEST(Scatter, LeavesOutUnsuitableSitesAndFillsTheGaps) {
  // A ball, and beside it a ball too small for the patches.
  const NarrowBand two = support::sampleBand(
      [](const V3d& p) {
        return std::min(p.length() - kRadius, (p - V3d(4, 0, 0)).length() - 0.2);
      },
      {V3d(-2, -2, -2), V3d(4.4, 2, 2)}, 0.1);
  mapping::ScatterOptions options = small(20);
  // Dense enough that sites hit the small ball.
  options.density.scale = [](const V3d& p) { return p.x > 3 ? 0.4 : 1; };
  options.uSize = options.vSize = 2;
  const auto result = mapping::scatter(two, 0.3, options);
  EXPECT_GT(result.leftOut, 0u);
  EXPECT_FALSE(result.cause.empty());
  EXPECT_EQ(result.patches.size(), 20u);
  for (const Patch& patch : result.patches) EXPECT_LT(patch.corners[0].x, 2.1);
  options = small(1);
  options.uSize = options.vSize = 10;
  EXPECT_THROW((void)mapping::scatter(ball(), 0.3, options), InvalidInput);
}

TEST(Scatter, SkipsPatchesThatFold) {
  const NarrowBand base = ball(), stud = support::makeBall(0.5, 0.1);
  std::vector<Patch> patches = mapping::scatter(base, 0.3, small(4)).patches;
  for (V3d& p : patches[1].layers.back().positions) p *= 0.5;
  const mapping::TextureOptions options = {.merge = mapping::TextureMerge::Alone, .voxelSize = 0.1};
  EXPECT_THROW((void)mapping::mapTexture(base, stud, patches, options), InvalidInput);
  mapping::TextureOptions skipping = options;
  skipping.skipFolds = true;
  const auto result = mapping::mapTexture(base, stud, patches, skipping);
  EXPECT_EQ(result.report.skipped, 1u);
  EXPECT_EQ(result.report.patches, 3u);
  EXPECT_EQ(levelset::measure(result.band).components, 3u);
  EXPECT_THROW((void)mapping::mapTexture(base, stud, patches[1], skipping), InvalidInput);
}

/// Largest difference between corners of layers. The rounding of counts between corners may differ.
double worstApart(const Patch& one, const Patch& other) {
  if (one.layers.size() != other.layers.size()) return HUGE_VAL;
  const auto cornersOf = [](const mapping::ParticleLayer& layer) {
    const std::size_t u = layer.columns - 1, v = layer.rows - 1;
    return std::array{layer.at(0, 0), layer.at(u, 0), layer.at(u, v), layer.at(0, v)};
  };
  double worst = 0;
  for (std::size_t k = 0; k < one.layers.size(); ++k) {
    const auto a = cornersOf(one.layers[k]), b = cornersOf(other.layers[k]);
    for (std::size_t i = 0; i < 4; ++i) worst = std::max(worst, (a[i] - b[i]).length());
  }
  return worst;
}

TEST(Scatter, PatchesThatShareDistancesEqualSeparateOnes) {
  const NarrowBand base = ball();
  mapping::ScatterOptions options;
  options.density.count = 16;
  options.density.scale = [](const V3d& p) { return p.x > 0 ? 1.0 : 0.5; };
  options.uSize = options.vSize = 1;
  options.patch.layers = 4;
  for (const auto& [scheme, height] : {std::pair(mapping::LayerScheme::Reduced, 1.0),
                                       std::pair(mapping::LayerScheme::Reduced, 4.5),
                                       std::pair(mapping::LayerScheme::Conforming, 1.0)}) {
    options.patch.scheme = scheme;
    const auto together = mapping::scatter(base, height, options);
    ASSERT_EQ(together.patches.size(), 16u) << together.cause;
    for (std::size_t n = 0; n < together.patches.size(); n += 8) {
      const mapping::PatchSite& site = together.sites[n];
      const Patch alone =
          mapping::makePatch(base, site.corners, height * site.scale, options.patch).patch;
      // Tall patches alone use voxels of twice the size. Together, all use the voxels of the lowest
      // patch.
      const double voxel = (height > 4 ? 2 : 1) * base.voxelSize();
      EXPECT_LT(worstApart(alone, together.patches[n]), support::measured(0.016, 0.02) * voxel)
          << height;
    }
  }
}

TEST(PatchSpace, IsSharedWhereThatCostsLess) {
  const NarrowBand base = ball();
  const auto isShared = [&](std::size_t count, double lowest, double highest,
                            std::size_t maxMemory = levelset::kNoMemoryLimit) {
    return mapping::sweepSharedSpace(base, {count, 0.5, 0.5, lowest, highest},
                                     {.maxMemory = maxMemory});
  };
  const auto many = isShared(40, 1, 1);
  ASSERT_TRUE(many);
  EXPECT_DOUBLE_EQ(many->voxelSize(), base.voxelSize());
  EXPECT_GE(many->halfWidth() * many->voxelSize(), 1.6 - 1e-9);
  EXPECT_FALSE(isShared(1, 1, 1));
  EXPECT_FALSE(isShared(40, 1, 1, 1000));
  EXPECT_FALSE(isShared(40, 0.1, -1));  // the band covers it already
  // As coarse as the lowest patch permits, and no coarser.
  const auto tall = isShared(40, 4.5, 6);
  ASSERT_TRUE(tall);
  EXPECT_DOUBLE_EQ(tall->voxelSize(), 2 * base.voxelSize());
  const auto mixed = isShared(40, 1, 6);
  ASSERT_TRUE(mixed);
  EXPECT_DOUBLE_EQ(mixed->voxelSize(), base.voxelSize());
}

TEST(PatchSpace, IsSeparateWhereTheSharedOneIsUnsuitable) {
  const NarrowBand base = ball();
  const std::vector<V3d> border = {V3d(0, 0, kRadius), V3d(0.3, 0, std::sqrt(4 - 0.09))};
  const auto voxelOf = [&](const NarrowBand& shared, double height) {
    return mapping::sweepPatchSpace(base, border, 0.1, height, {.shared = &shared}).voxelSize();
  };
  const NarrowBand wide = mapping::sweepSharedSpace(base, {40, 0.5, 0.5, 4.5, 6}, {}).value();
  EXPECT_DOUBLE_EQ(voxelOf(wide, 5), wide.voxelSize());
  EXPECT_DOUBLE_EQ(voxelOf(wide, 1), base.voxelSize());  // too coarse
  const NarrowBand low = mapping::sweepSharedSpace(base, {40, 0.5, 0.5, 1, 1}, {}).value();
  const NarrowBand made = mapping::sweepPatchSpace(base, border, 0.1, 1.5, {.shared = &low});
  // The shared space is not high enough.
  EXPECT_GE(made.halfWidth() * made.voxelSize(), 2.1 - 1e-9);
}

TEST(PatchSpace, IsComputedAroundThePatchOnly) {
  const NarrowBand base = ball();
  const double height = 0.8, bulge = 0.1;
  const auto at = [](double x, double y) {
    return V3d(x, y, std::sqrt(kRadius * kRadius - x * x - y * y));
  };
  const NarrowBand own = mapping::sweepPatchSpace(
      base, std::vector<V3d>{at(-0.3, -0.3), at(0.3, -0.3), at(0.3, 0.3), at(-0.3, 0.3)}, bulge,
      height);
  const levelset::BandSampler sampler(own);
  // Valid within the extent of patch space, and little beyond the region that the sweep needs.
  EXPECT_NEAR(sampler.value(V3d(0.4, 0, kRadius + height)),
              V3d(0.4, 0, kRadius + height).length() - kRadius, support::measured(2.1e-6));
  const NarrowBand all =
      mapping::sweepSharedSpace(base, {40, 0.5, 0.5, height, height}, {}).value();
  // The box is 0.6 + 2 (height + bulge) = 2.4 wide, a ninth of the ball's 4π 2² seen from above.
  // The space above it spreads to about twice that.
  EXPECT_LT(static_cast<double>(own.activeVoxelCount()),
            0.25 * static_cast<double>(all.activeVoxelCount()));
}

TEST(Scatter, RefusesInvalidHeightsBeforeTheSweep) {
  for (const double height : {-1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW((void)mapping::scatter(ball(), height, small(40)), UsageError);
}

}  // namespace scatter_test
