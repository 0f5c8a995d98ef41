#include "levelset/components/components.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace components_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;

using Distance = std::function<double(const V3d&)>;

NarrowBand sample(const Distance& phi, double half, double halfWidth = 3) {
  return support::sampleBand(phi, {V3d(-half), V3d(half)}, 1, halfWidth);
}

double ball(const V3d& p, const V3d& centre, double radius) {
  return (p - centre).length() - radius;
}

double ballVolume(double radius) {
  return 4 * pi / 3 * radius * radius * radius;
}

/// Distance to a hollow ball of radii 24 and 18 that contains a hollow ball of radii 10 and 5, and
/// to a ball of radius 6 beside it.
double nestedDistance(const V3d& p) {
  const double r = p.length();
  return std::min({std::max(r - 24, 18 - r), std::max(r - 10, 5 - r), ball(p, V3d(40, 0, 0), 6)});
}
NarrowBand nestedShells() {
  return sample(nestedDistance, 46);
}

/// Expects a small difference, in voxels, from the exact distance over the band, and the correct
/// half width.
void expectDistance(const NarrowBand& band, const Distance& exact, double tolerance) {
  double worst = 0;
  std::size_t count = 0;
  support::forEachActive(band, [&](const V3d& p, double phi) {
    worst = std::max(worst, std::abs(phi - exact(p)));
    ++count;
  });
  EXPECT_LT(worst, tolerance);
  const auto box = band.zeroSetBounds();
  const double half = std::max(box.max.length(), box.min.length());
  const auto expected = static_cast<double>(sample(exact, half).activeVoxelCount());
  EXPECT_NEAR(static_cast<double>(count), expected, support::rounding(1) * expected);
}

TEST(Topology, CountsNestedComponents) {
  const Topology t = topology(nestedShells());
  EXPECT_EQ(t.components, 3u);
  EXPECT_EQ(t.surfaces, 5u);
  EXPECT_EQ(t.cavities, 2u);
  const Topology none = topology(NarrowBand());
  EXPECT_EQ(none.components + none.surfaces + none.cavities, 0u);
}

TEST(Topology, SeparatesDiagonalNeighbours) {
  // Two inside voxels that share only the diagonal of a face are two solids.
  auto grid = emptyLevelSet(uniformTransform(1), 3);
  grid->tree().setValueOn(openvdb::Coord(7, 7, 7), -0.5f);
  grid->tree().setValueOn(openvdb::Coord(8, 8, 7), -0.5f);
  EXPECT_EQ(topology(makeBand(grid)).components, 2u);
  grid->tree().setValueOn(openvdb::Coord(7, 8, 7), -0.5f);
  EXPECT_EQ(topology(makeBand(grid)).components, 1u);
}

TEST(KeepLargest, RemovesSmallerSolidsAndKeepsBitsOfTheRest) {
  const NarrowBand solid = nestedShells();
  const NarrowBand one = keepLargest(solid, 1);
  const Topology t = topology(one);
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.surfaces, 2u);
  EXPECT_EQ(t.cavities, 1u);
  EXPECT_EQ(one.contentHash(),
            sample([](const V3d& p) { return std::max(p.length() - 24, 18 - p.length()); }, 46)
                .contentHash());
  const NarrowBand two = keepLargest(solid, 2);
  EXPECT_EQ(topology(two).surfaces, 4u);
  EXPECT_EQ(two.contentHash(), sample(
                                   [](const V3d& p) {
                                     const double r = p.length();
                                     return std::min(std::max(r - 24, 18 - r),
                                                     std::max(r - 10, 5 - r));
                                   },
                                   46)
                                   .contentHash());
  EXPECT_EQ(keepLargest(solid, 3).contentHash(), solid.contentHash());
  EXPECT_EQ(keepLargest(solid, 99).contentHash(), solid.contentHash());
}

TEST(KeepLargest, KeepsASolidInsideARemovedOne) {
  // The outer hollow ball has less volume than the ball inside it.
  const auto thin = [](const V3d& p) { return std::max(p.length() - 30, 29 - p.length()); };
  const auto inner = [](const V3d& p) { return p.length() - 22; };
  const NarrowBand kept =
      keepLargest(sample([&](const V3d& p) { return std::min(thin(p), inner(p)); }, 31), 1);
  EXPECT_EQ(topology(kept).surfaces, 1u);
  EXPECT_EQ(kept.contentHash(), sample(inner, 31).contentHash());
}

TEST(KeepLargest, RestoresDistanceBesideARemovedSolid) {
  // The two bands meet. Values that belonged to the small solid are measured from the large solid
  // again.
  const auto large = [](const V3d& p) { return ball(p, V3d(-0.3, 0.2, 0.1), 16); };
  const auto small = [](const V3d& p) { return ball(p, V3d(20.1, 0, 0), 2.8); };
  const NarrowBand both = sample([&](const V3d& p) { return std::min(large(p), small(p)); }, 24);
  ASSERT_EQ(topology(both).components, 2u);
  const NarrowBand kept = keepLargest(both, 1);
  EXPECT_EQ(topology(kept).surfaces, 1u);
  expectDistance(kept, large, 0.05);
  EXPECT_TRUE(check(kept).passed());
  std::size_t changed = 0;
  support::forEachActive(kept, [&](const V3d& p, double phi) {
    changed += static_cast<float>(phi) != static_cast<float>(large(p));
  });
  EXPECT_LT(changed, 400u);  // only beside the small solid
}

TEST(KeepLargest, CountsNegativeZerosAsOutside) {
  // A value of -0 above a face, which is measured again because a ball beside it vanishes.
  const auto slab = [](const V3d& p) {
    return std::max({std::abs(p.x) - 12, std::abs(p.y) - 12, std::abs(p.z + 8) - 8});
  };
  const auto both = [&](const V3d& p) {
    if ((p - V3d(0, 0, 1)).length() < 0.1) return -0.0;
    return std::min(slab(p), ball(p, V3d(0.3, 0.2, 4.4), 1.9));
  };
  const NarrowBand kept = keepLargest(sample(both, 20), 1);
  EXPECT_EQ(topology(kept).components, 1u);
  EXPECT_EQ(topology(kept).surfaces, 1u);
}

TEST(KeepLargest, BreaksTiesByPosition) {
  const NarrowBand twins = sample(
      [](const V3d& p) { return std::min(ball(p, V3d(-16, 0, 0), 5), ball(p, V3d(16, 0, 0), 5)); },
      22);
  EXPECT_LT(keepLargest(twins, 1).zeroSetBounds().max.x, 0);
}

TEST(KeepLargest, RefusesAnEmptyResult) {
  EXPECT_THROW((void)keepLargest(nestedShells(), 0), UsageError);
  EXPECT_THROW((void)keepLargest(NarrowBand(), 1), InvalidInput);
}

TEST(FillCavities, FillsAllOrOnlySmallOnes) {
  const NarrowBand solid = nestedShells();
  const NarrowBand full = fillCavities(solid);
  EXPECT_EQ(topology(full).surfaces, 2u);
  EXPECT_EQ(topology(full).cavities, 0u);
  EXPECT_EQ(
      full.contentHash(),
      sample([](const V3d& p) { return std::min(p.length() - 24, ball(p, V3d(40, 0, 0), 6)); }, 46)
          .contentHash());
  // The cavity of radius 5 has volume 524. The cavity around the inner solid has 18² 4π/3 less the
  // volume of that solid.
  const NarrowBand small = fillCavities(solid, 1.02 * ballVolume(5));
  EXPECT_EQ(topology(small).surfaces, 4u);
  EXPECT_EQ(topology(small).cavities, 1u);
  EXPECT_EQ(fillCavities(solid, 0.95 * ballVolume(5)).contentHash(), solid.contentHash());
  const double outer = ballVolume(18) - ballVolume(10);
  EXPECT_EQ(topology(fillCavities(solid, 1.01 * outer)).surfaces, 2u);
  EXPECT_EQ(topology(fillCavities(solid, 0.99 * outer)).surfaces, 4u);
}

TEST(FillCavities, RestoresDistanceUnderThinWalls) {
  const auto hull = [](const V3d& p) { return p.length() - 14.2; };
  const NarrowBand hollow =
      sample([&](const V3d& p) { return std::max(hull(p), -ball(p, V3d(0, 0, 3), 8.5)); }, 15);
  ASSERT_EQ(topology(hollow).cavities, 1u);
  const NarrowBand filled = fillCavities(hollow);
  EXPECT_EQ(topology(filled).surfaces, 1u);
  expectDistance(filled, hull, 0.05);
  EXPECT_TRUE(check(filled).passed());
  EXPECT_NEAR(measure(filled).volume, ballVolume(14.2), support::measured(4e-9) * ballVolume(14.2));
}

TEST(FillCavities, KeepsOpenHollowsAndEmptyBands) {
  const NarrowBand cup = sample(
      [](const V3d& p) {
        const double hole = std::max(std::hypot(p.x, p.y) - 3, -p.z);
        return std::max({p.length() - 20, 12 - p.length(), -hole});
      },
      21);
  EXPECT_EQ(topology(cup).cavities, 0u);
  EXPECT_EQ(fillCavities(cup).contentHash(), cup.contentHash());
  EXPECT_TRUE(fillCavities(NarrowBand()).isEmpty());
  EXPECT_THROW((void)fillCavities(cup, -1), UsageError);
  EXPECT_THROW((void)fillCavities(cup, std::numeric_limits<double>::quiet_NaN()), UsageError);
}

TEST(FillCavities, FindsCavitiesOfTilesOnly) {
  // A cavity many thousand voxels wide. Its middle is one large tile.
  auto grid =
      vdb(sample([](const V3d& p) { return std::max(p.length() - 60, 50 - p.length()); }, 61))
          .deepCopy();
  grid->pruneGrid();
  const NarrowBand filled = fillCavities(makeBand(grid));
  EXPECT_EQ(topology(filled).surfaces, 1u);
  EXPECT_LT(vdb(filled).tree().getValue(openvdb::Coord(0)), 0);
}

TEST(Components, GiveSameBitsForAnyNumberOfThreads) {
  const NarrowBand solid = sample(
      [](const V3d& p) {
        return std::min(std::max(p.length() - 14.2, -ball(p, V3d(0, 0, 3), 8.5)),
                        ball(p, V3d(17, 3, 0), 1.9));
      },
      20);
  std::uint64_t kept = 0, filled = 0;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    std::uint64_t k = 0, f = 0;
    support::onThreads(threads, [&] {
      k = keepLargest(solid, 1).contentHash();
      f = fillCavities(solid).contentHash();
    });
    if (threads == 1) kept = k, filled = f;
    EXPECT_EQ(k, kept);
    EXPECT_EQ(f, filled);
  }
}

}  // namespace components_test
