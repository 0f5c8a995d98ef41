#include "levelset/csg/blend.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace blend_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

// All shapes in voxels, off the grid points.
Shape box(const V3d& centre, const V3d& half) {
  return [=](const V3d& p) {
    const V3d q(std::abs(p.x - centre.x) - half.x, std::abs(p.y - centre.y) - half.y,
                std::abs(p.z - centre.z) - half.z);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

Shape sphere(const V3d& centre, double radius) {
  return [=](const V3d& p) { return (p - centre).length() - radius; };
}

NarrowBand sample(const Shape& shape, const V3d& extent) {
  return support::sampleBand(shape, {-extent, extent}, 1);
}

/// Floor with its top at z = 0.3 and wall with its face at x = 0.2. Their concave crease runs along
/// y.
struct Corner {
  NarrowBand floor, wall;
  explicit Corner(double size)
      : floor(
            sample(box(V3d(0, 0.1, 0.3 - size / 4), V3d(size, size / 2, size / 4)), V3d(size + 2))),
        wall(sample(box(V3d(0.2 - size / 4, 0.1, 0), V3d(size / 4, size / 2, size)),
                    V3d(size + 2))) {}
};

/// Distance along the diagonal from the crease to the sign change of φ.
double fillDepth(const NarrowBand& band) {
  const openvdb::FloatGrid& grid = vdb(band);
  auto accessor = grid.getConstAccessor();
  const auto at = [&](double s) {
    const double x = 0.2 + s * M_SQRT1_2, z = 0.3 + s * M_SQRT1_2;
    const int i = static_cast<int>(std::floor(x)), k = static_cast<int>(std::floor(z));
    const double u = x - i, w = z - k;
    const auto v = [&](int di, int dk) {
      return static_cast<double>(accessor.getValue({i + di, 0, k + dk}));
    };
    return (1 - u) * ((1 - w) * v(0, 0) + w * v(0, 1)) + u * ((1 - w) * v(1, 0) + w * v(1, 1));
  };
  double low = -2, high = 40;
  while (high - low > 0.001) (at((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  return low;
}

TEST(Blend, UsesTheRequestedRadius) {
  const Corner corner(40);
  for (const double radius : {4.0, 8.0, 12.0}) {
    const CsgResult result = blend(CsgOperation::Union, corner.floor, corner.wall, radius);
    // A fillet of radius r fills a right angle up to (√2 − 1) r from the crease.
    const double filled = fillDepth(result.band) / (M_SQRT2 - 1);
    EXPECT_NEAR(filled, radius, support::measured(0.0524) * radius);
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(result.band), 6), "");
    EXPECT_TRUE(result.notes.empty());
  }
}

/// Two balls whose surfaces meet in the circle of radius √(20² − 14²) in the plane x = 0.
struct TwoBalls {
  NarrowBand left = sample(sphere(V3d(-14, 0.3, 0.1), 20), V3d(36, 22, 22));
  NarrowBand right = sample(sphere(V3d(14, 0.3, 0.1), 20), V3d(36, 22, 22));
  static double distanceToCurve(const V3d& p) {
    const double radial = std::hypot(p.y - 0.3, p.z - 0.1) - std::sqrt(20.0 * 20 - 14 * 14);
    return std::hypot(p.x, radial);
  }
};

TEST(Blend, ChangesNothingBeyondTheRadius) {
  const TwoBalls balls;
  const double radius = 6;
  const CsgResult hard = blend(CsgOperation::Union, balls.left, balls.right, 0);
  const CsgResult soft = blend(CsgOperation::Union, balls.left, balls.right, radius);
  auto before = vdb(hard.band).getConstAccessor(), after = vdb(soft.band).getConstAccessor();
  std::size_t changed = 0, beyond = 0;
  openvdb::Coord c;
  for (c[0] = -38; c[0] <= 38; ++c[0])
    for (c[1] = -26; c[1] <= 26; ++c[1])
      for (c[2] = -26; c[2] <= 26; ++c[2]) {
        const bool same =
            before.getValue(c) == after.getValue(c) && before.isValueOn(c) == after.isValueOn(c);
        // The position of the curve is known to a small fraction of a voxel.
        if (TwoBalls::distanceToCurve(toImath(c.asVec3d())) > radius + 0.1)
          beyond += !same;
        else
          changed += !same;
      }
  EXPECT_EQ(beyond, 0u);
  EXPECT_GT(changed, 100u);
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(soft.band), 6), "");
}

TEST(Blend, KeepsSeparateSolidsApart) {
  for (const double gap : {0.8, 1.5, 3.0}) {
    const NarrowBand left = sample(sphere(V3d(-15 - gap / 2, 0.3, 0.1), 15), V3d(34, 18, 18));
    const NarrowBand right = sample(sphere(V3d(15 + gap / 2, 0.3, 0.1), 15), V3d(34, 18, 18));
    const CsgResult hard = blend(CsgOperation::Union, left, right, 0);
    const CsgResult soft = blend(CsgOperation::Union, left, right, 8);
    EXPECT_EQ(hard.band.contentHash(), soft.band.contentHash()) << gap;
    EXPECT_EQ(soft.notes.size(), 1u);
  }
}

/// Volumes inside and outside by which `after` differs from `before`, counted in grid points.
std::pair<std::size_t, std::size_t> lostAndGained(const NarrowBand& before,
                                                  const NarrowBand& after) {
  auto read = vdb(after).getConstAccessor();
  std::size_t lost = 0, gained = 0;
  for (auto it = vdb(before).cbeginValueOn(); it; ++it) {
    const bool was = *it<-0.02f, wasNot = *it> 0.02f, is = read.getValue(it.getCoord()) < 0;
    lost += was && !is;
    gained += wasNot && is;
  }
  return {lost, gained};
}

TEST(Blend, WorksOnOneSideOnly) {
  const TwoBalls balls;
  for (const CsgOperation operation :
       {CsgOperation::Union, CsgOperation::Intersection, CsgOperation::Difference}) {
    const CsgResult hard = blend(operation, balls.left, balls.right, 0);
    const auto run = [&](BlendSide side) {
      return lostAndGained(hard.band,
                           blend(operation, balls.left, balls.right, 5, {.side = side}).band);
    };
    const auto add = run(BlendSide::Add), remove = run(BlendSide::Remove),
               both = run(BlendSide::Both);
    EXPECT_EQ(add.first, 0u);
    EXPECT_EQ(remove.second, 0u);
    // The crease of a union is concave, those of the other operations are convex.
    if (operation == CsgOperation::Union) {
      EXPECT_GT(add.second, 100u);
      EXPECT_GT(both.second, 100u);
    } else {
      EXPECT_GT(remove.first, 100u);
      EXPECT_GT(both.first, 100u);
    }
  }
}

TEST(Blend, KeepsSurfacesRounderThanTheRadius) {
  // The curvature of the balls themselves does not move them, however long the seam takes.
  const TwoBalls balls;
  const CsgResult soft = blend(CsgOperation::Union, balls.left, balls.right, 5);
  double worst = 0;
  support::forEachActive(soft.band, [&](const V3d& p, double value) {
    if (TwoBalls::distanceToCurve(p) < 5 || std::abs(value) > 1) return;
    const double truth =
        std::min((p - V3d(-14, 0.3, 0.1)).length(), (p - V3d(14, 0.3, 0.1)).length()) - 20;
    worst = std::max(worst, std::abs(value - truth));
  });
  EXPECT_LE(worst, support::rounding(0.4));
}

TEST(Blend, ReportsRadiiTheGridCannotResolve) {
  const TwoBalls balls;
  EXPECT_EQ(blend(CsgOperation::Union, balls.left, balls.right, 1).notes.size(), 1u);
  EXPECT_TRUE(blend(CsgOperation::Union, balls.left, balls.right, 0).notes.empty());
}

TEST(Blend, DoesNotDependOnThreads) {
  const TwoBalls balls;
  std::uint64_t hashes[3];
  for (const std::size_t threads : {1, 2, 4})
    hashes[threads / 2] = support::onThreads(threads, [&] {
      return blend(CsgOperation::Union, balls.left, balls.right, 4).band.contentHash();
    });
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Blend, Refuses) {
  const TwoBalls balls;
  const auto run = [&](double radius, const BlendOptions& options = {}) {
    return blend(CsgOperation::Union, balls.left, balls.right, radius, options);
  };
  EXPECT_THROW((void)run(-1), UsageError);
  EXPECT_THROW((void)run(std::numeric_limits<double>::quiet_NaN()), UsageError);
  EXPECT_THROW((void)run(std::numeric_limits<double>::infinity()), UsageError);
  EXPECT_THROW((void)run(1000), InvalidInput);
  EXPECT_THROW((void)run(5, {.progress = [](double f) { return f < 0.5; }}), Cancelled);
  EXPECT_THROW((void)blend(CsgOperation::Union, balls.left, NarrowBand(), 1), InvalidInput);
}

}  // namespace blend_test
