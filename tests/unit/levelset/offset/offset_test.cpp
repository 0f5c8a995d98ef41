#include "levelset/offset/offset.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace offset_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

// All shapes in voxels, off the grid points.
const V3d kCentre(0.31, -0.17, 0.43);

Shape sphere(double radius) {
  return [=](const V3d& p) { return (p - kCentre).length() - radius; };
}

Shape box(double half) {
  return [=](const V3d& p) {
    const V3d r = p - kCentre;
    const V3d q(std::abs(r.x) - half, std::abs(r.y) - half, std::abs(r.z) - half);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

NarrowBand sample(const Shape& shape, double extent) {
  return support::sampleBand(shape, {V3d(-extent), V3d(extent)}, 1);
}

struct BandError {
  double l1 = 0, linf = 0;
};

BandError bandError(const NarrowBand& band, const Shape& exact) {
  BandError e;
  double count = 0;
  support::forEachActive(band, [&](const V3d& p, double value) {
    const double error = std::abs(value - exact(p));
    e.l1 += error;
    e.linf = std::max(e.linf, error);
    ++count;
  });
  e.l1 /= count;
  return e;
}

TEST(Offset, MovesASphereExactly) {
  const NarrowBand ball = sample(sphere(40), 42);
  for (const double distance : {10.0, 0.7, -10.0, -30.0}) {
    const NarrowBand moved = offset(ball, distance);
    const BandError e = bandError(moved, sphere(40 + distance));
    EXPECT_LE(e.l1, support::measured(9.58e-6)) << distance;
    EXPECT_LE(e.linf, support::measured(6.74e-5)) << distance;
    EXPECT_NEAR(moved.halfWidth(), 3, support::rounding(3));
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(moved), 6), "") << distance;
  }
}

TEST(Offset, RoundsACubeOutwards) {
  const BandError e =
      bandError(offset(sample(box(20), 22), 5), [](const V3d& p) { return box(20)(p) - 5; });
  EXPECT_LE(e.l1, support::measured(1.98e-4));
  EXPECT_LE(e.linf, support::measured(0.00816));
}

TEST(Offset, KeepsACubeSharpInwards) {
  const NarrowBand moved = offset(sample(box(25), 27), -5);
  double nearFaces = 0, all = 0;
  support::forEachActive(moved, [&](const V3d& p, double value) {
    const double truth = box(20)(p), error = std::abs(value - truth);
    const V3d r = p - kCentre;
    int free = 0;
    for (int i = 0; i < 3; ++i) free += std::abs(r[i]) < 17;
    if (free >= 2) nearFaces = std::max(nearFaces, error);
    all = std::max(all, error);
  });
  EXPECT_LE(nearFaces, support::rounding(1));
  EXPECT_LE(bandError(moved, box(20)).l1, support::rounding(0.6));
  EXPECT_LE(all, support::rounding(2));
}

/// Cube rotated by Euler angles.
Shape turnedBox(double half, int turn) {
  Imath::M44d back;
  back.setEulerAngles(V3d(0.3 + 0.37 * turn, 0.5 + 0.11 * turn, 0.7 - 0.23 * turn));
  back.transpose();
  return [=](const V3d& p) {
    V3d r;
    back.multDirMatrix(p - kCentre, r);
    return box(half)(r + kCentre);
  };
}

TEST(Offset, KeepsARotatedCubeSharp) {
  for (int turn = 0; turn < 5; ++turn) {
    const NarrowBand cube = sample(turnedBox(20, turn), 36);
    const BandError shrunk = bandError(offset(cube, -5), turnedBox(15, turn));
    EXPECT_LE(shrunk.linf, support::measured(3.0e-4)) << turn;
    EXPECT_LE(shrunk.l1, support::measured(3.22e-7)) << turn;
    const BandError grown =
        bandError(offset(cube, 5), [&](const V3d& p) { return turnedBox(20, turn)(p) - 5; });
    EXPECT_LE(grown.linf, support::measured(0.00715)) << turn;
    EXPECT_LE(grown.l1, support::measured(2.68e-5)) << turn;
  }
}

/// Cuboid of half sizes `half`, rotated as in turnedBox(); not rotated if `turn` is negative.
Shape turnedCuboid(const V3d& half, int turn, const V3d& centre) {
  Imath::M44d back;
  if (turn >= 0) back.setEulerAngles(V3d(0.3 + 0.37 * turn, 0.5 + 0.11 * turn, 0.7 - 0.23 * turn));
  back.transpose();
  return [=](const V3d& p) {
    V3d r;
    back.multDirMatrix(p - centre, r);
    const V3d q(std::abs(r.x) - half.x, std::abs(r.y) - half.y, std::abs(r.z) - half.z);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

TEST(Offset, RestoresEdgesAndCornersOnTheWayBack) {
  // The roundings of the first offset become edges again. Curvature jumps beside the roundings.
  for (int turn = -1; turn < 3; ++turn) {
    const Shape solid = turnedCuboid(V3d(24, 18, 12), turn, kCentre);
    const NarrowBand back = offset(offset(sample(solid, 35), 5), -5);
    EXPECT_LE(bandError(back, solid).linf, support::measured(3.5e-4)) << turn;
    EXPECT_LE(bandError(back, solid).l1, support::measured(9.2e-6)) << turn;
  }
}

TEST(Offset, FindsTheCornersOfNarrowBoxes) {
  // Both edges of the narrow faces are near. They must not count as a corner with the wide face.
  for (const V3d& centre : {V3d(0.5), V3d(0.25, 0.5, 0.75), kCentre}) {
    const NarrowBand solid = sample(turnedCuboid(V3d(7.2, 5.4, 4.2), -1, centre), 10);
    EXPECT_LE(bandError(offset(solid, -2.4), turnedCuboid(V3d(4.8, 3, 1.8), -1, centre)).linf,
              support::measured(8.6e-6))
        << centre;
  }
}

TEST(Offset, DoesNotSharpenRoundSolids) {
  // Curvatures of 1/3 to 1/5 per voxel: curved, but no edge.
  for (const double radius : {3.0, 4.0, 5.0}) {
    const NarrowBand ball = sample(sphere(radius), radius + 1);
    EXPECT_LE(bandError(offset(ball, 2), sphere(radius + 2)).linf, support::measured(0.00724))
        << radius;
  }
}

TEST(Offset, AddsUpOnConvexSolids) {
  const NarrowBand cube = sample(box(12), 14);
  const NarrowBand twice = offset(offset(cube, 4), 5), once = offset(cube, 9);
  auto accessor = vdb(once).getConstAccessor();
  double sum = 0, count = 0;
  for (auto it = vdb(twice).cbeginValueOn(); it; ++it, ++count)
    sum += std::abs(*it - accessor.getValue(it.getCoord()));
  EXPECT_LE(sum / count, support::measured(0.0014));
}

TEST(Offset, RestoresSmoothSolidsOnTheWayBack) {
  const BandError e = bandError(offset(offset(sample(sphere(30), 32), 8), -8), sphere(30));
  EXPECT_LE(e.l1, support::measured(1.46e-5));
}

/// Prism of height 40 over a square of side 44 without its quarter x, y > −2, rotated about z. Five
/// of its edges along z are convex and one is concave.
struct Angle {
  static constexpr double kHalf = 22, kNotch = -2, kHeight = 20;
  double turn;

  /// Position relative to the centre, along the prism's own axes.
  [[nodiscard]] V3d own(const V3d& p) const {
    const V3d r = p - kCentre;
    return {r.x * std::cos(turn) + r.y * std::sin(turn),
            r.y * std::cos(turn) - r.x * std::sin(turn), r.z};
  }
  /// Distance from outside to the two arms after each side moves inwards by d.
  static double toArms(const V3d& q, double d) {
    const auto arm = [=](double x, double y) {
      return std::hypot(std::max({x - kHalf + d, -kHalf + d - x, 0.0}),
                        std::max({y - kNotch + d, -kHalf + d - y, 0.0}));
    };
    return std::min(arm(q.x, q.y), arm(q.y, q.x));
  }
  /// Distance from inside to the outside: the sides of the square and the notch.
  static double toOutside(const V3d& q) {
    const double notch = std::hypot(std::max(kNotch - q.x, 0.0), std::max(kNotch - q.y, 0.0));
    return std::min({kHalf - std::abs(q.x), kHalf - std::abs(q.y), notch});
  }
  static double section(const V3d& q) {
    const double inside = toOutside(q);
    return inside > 0 ? -inside : toArms(q, 0);
  }
  [[nodiscard]] Shape solid() const {
    return [angle = *this](const V3d& p) {
      const V3d q = angle.own(p);
      const double side = section(q), end = std::abs(q.z) - kHeight;
      return std::hypot(std::max(side, 0.0), std::max(end, 0.0)) +
             std::min(0.0, std::max(side, end));
    };
  }
  /// Distance in the cross-section of the solid grown by d, for positions within a band of three
  /// voxels.
  static double grown(const V3d& q, double d) {
    const double away = toArms(q, 0), x = q.x - kNotch, y = q.y - kNotch;
    const bool isInNotch = x > 0 && y > 0 && q.x < kHalf && q.y < kHalf;
    if (away >= d || !isInNotch) return away - d;
    return -std::hypot(std::max(d - x, 0.0), std::max(d - y, 0.0));  // sharp
  }
  /// Distance in the cross-section of the solid shrunk by d.
  static double shrunk(const V3d& q, double d) {
    const double inside = toOutside(q), x = q.x - kNotch, y = q.y - kNotch;
    if (inside >= d || (x < 0 && y < 0 && std::hypot(x, y) < d)) return d - inside;  // round
    return toArms(q, d);
  }
};

/// Errors in the middle of the prism: of all points, and near the concave edge.
struct EdgeError {
  double all = 0, concave = 0;
};
EdgeError edgeError(const NarrowBand& moved, const Angle& angle,
                    double (*exact)(const V3d&, double), double distance) {
  EdgeError error;
  support::forEachActive(moved, [&](const V3d& p, double value) {
    const V3d q = angle.own(p);
    if (std::abs(q.z) > 8) return;
    const double off = std::abs(value - exact(q, distance));
    error.all = std::max(error.all, off);
    if (std::hypot(q.x - Angle::kNotch, q.y - Angle::kNotch) < 9)
      error.concave = std::max(error.concave, off);
  });
  return error;
}

TEST(Offset, KeepsConcaveEdgesSharpOutwardsAndConvexOnesInwards) {
  constexpr double kDistance = 5;
  for (const double turn : {0.0, 0.6}) {
    const Angle angle{turn};
    const NarrowBand solid = sample(angle.solid(), 34);
    const EdgeError grown = edgeError(offset(solid, kDistance), angle, Angle::grown, kDistance);
    EXPECT_LE(grown.concave, support::rounding(1.5)) << turn;
    EXPECT_LE(grown.all, support::measured(0.00654)) << turn;
    const EdgeError shrunk = edgeError(offset(solid, -kDistance), angle, Angle::shrunk, kDistance);
    EXPECT_LE(shrunk.concave, support::measured(0.0052)) << turn;
    EXPECT_LE(shrunk.all, support::measured(0.0052)) << turn;
  }
}

TEST(Offset, MergesSurfacesThatMeet) {
  const Shape pair = [](const V3d& p) {
    return std::min((p - V3d(-14, 0, 0)).length(), (p - V3d(14, 0, 0)).length()) - 10;
  };
  const NarrowBand grown = offset(sample(pair, 26), 5);
  EXPECT_LT(vdb(grown).tree().getValue(openvdb::Coord(0)), 0);
  // The fronts meet in a crease, on which the distance is that to the circle.
  double worst = 0;
  support::forEachActive(grown, [&](const V3d& p, double value) {
    const V3d q(std::abs(p.x), p.y, p.z);
    const double radial = std::hypot(p.y, p.z), circle = std::sqrt(15.0 * 15 - 14 * 14);
    const double ball = (q - V3d(14, 0, 0)).length() - 15;
    const double truth = ball < 0 ? -std::min(-ball, std::hypot(q.x, radial - circle)) : ball;
    if (std::abs(q.x) > 1.5) worst = std::max(worst, std::abs(value - std::max(truth, -3.0)));
  });
  EXPECT_LE(worst, support::measured(0.371, 0.5));
}

/// Ball given by centre and radius, voxels.
struct Ball {
  V3d centre;
  double radius = 0;
};

bool isInAny(const std::vector<Ball>& balls, const V3d& p) {
  return std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
    return (p - ball.centre).length() < ball.radius - 1e-9;
  });
}

/// Signed distance to the union of balls. Inside, the nearest point of the surface lies on a ball,
/// on the circle of two balls or at a point of three balls.
double unionDistance(const std::vector<Ball>& balls, const V3d& p) {
  double outside = INFINITY, inside = INFINITY;
  const auto tryPoint = [&](const V3d& q) {
    if (!isInAny(balls, q)) inside = std::min(inside, (p - q).length());
  };
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const V3d to = p - balls[i].centre;
    outside = std::min(outside, to.length() - balls[i].radius);
    tryPoint(balls[i].centre + to.normalized() * balls[i].radius);
    for (std::size_t j = 0; j < i; ++j) {
      const V3d between = balls[i].centre - balls[j].centre;
      const double length = between.length();
      const V3d along = between / length;
      const auto square = [](double x) { return x * x; };
      const double at =
          (square(length) + square(balls[j].radius) - square(balls[i].radius)) / (2 * length);
      const double squared = square(balls[j].radius) - square(at);
      if (!(squared > 0)) continue;
      const V3d middle = balls[j].centre + along * at;
      const V3d across = (p - middle) - along * (p - middle).dot(along);
      tryPoint(middle + across.normalized() * std::sqrt(squared));
      for (std::size_t k = 0; k < j; ++k) {  // the circle meets a third ball at two points
        const V3d to3 = balls[k].centre - middle;
        const double height = to3.dot(along), radius = std::sqrt(squared);
        V3d u = to3 - along * height;
        const double flat = u.length();
        if (!(flat > 0)) continue;
        u /= flat;
        const double cosine = (square(flat) + square(height) + squared - square(balls[k].radius)) /
                              (2 * flat * radius);
        if (std::abs(cosine) > 1) continue;
        const V3d v = along.cross(u) * std::sqrt(1 - square(cosine));
        for (const double side : {-1.0, 1.0}) tryPoint(middle + (u * cosine + v * side) * radius);
      }
    }
  }
  return outside < 0 ? -inside : outside;
}

/// Balls whose surfaces meet in creases and corners after an offset by 6 voxels only.
std::vector<Ball> apartBalls() {
  std::vector<Ball> balls;
  for (const V3d& c : {V3d(0), V3d(17, 3, -2), V3d(7, 15, 5), V3d(6, -4, 15), V3d(-13, 9, 6)})
    balls.push_back({kCentre + c, 6.5 + 0.2 * c.x / 3});
  return balls;
}

NarrowBand sampledBalls() {
  const std::vector<Ball> balls = apartBalls();
  return sample([&](const V3d& p) { return unionDistance(balls, p); }, 40);
}

TEST(Offset, MeasuresCreasesInWhichPartsMeet) {
  std::vector<Ball> grown = apartBalls();
  for (Ball& ball : grown) ball.radius += 6;
  const BandError error =
      bandError(offset(sampledBalls(), 6), [&](const V3d& p) { return unionDistance(grown, p); });
  EXPECT_LE(error.l1, support::measured(3.22e-4));
  EXPECT_LE(error.linf, support::measured(1.92e-3));
}

TEST(Offset, FillsANarrowGapCompletely) {
  // Two slabs, 1 voxel apart; their edges are far from the middle.
  const auto slab = [](const V3d& p, double height) {
    const V3d r = p - kCentre - V3d(0, 0, height);
    const V3d q(std::abs(r.x) - 20, std::abs(r.y) - 20, std::abs(r.z) - 5);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
  const NarrowBand slabs =
      sample([&](const V3d& p) { return std::min(slab(p, -5.5), slab(p, 5.5)); }, 32);
  OffsetOptions options;
  for (const double halfWidth : {3.0, 6.0}) {
    options.halfWidth = halfWidth;
    const NarrowBand filled = offset(slabs, 2, options);
    std::size_t inGap = 0;
    support::forEachActive(filled, [&](const V3d& p, double) {
      const V3d r = p - kCentre;
      inGap += std::abs(r.x) < 12 && std::abs(r.y) < 12 && std::abs(r.z) < 3;
    });
    EXPECT_EQ(inGap, 0u) << halfWidth;
    EXPECT_LT(vdb(filled).tree().getValue(openvdb::Coord(0)), 0) << halfWidth;
  }
}

TEST(Offset, KeepsTheSolidForDistanceZero) {
  const NarrowBand ball = sample(sphere(10), 12);
  EXPECT_EQ(offset(ball, 0).contentHash(), ball.contentHash());
  EXPECT_NEAR(offset(ball, 0, {.halfWidth = 5}).halfWidth(), 5, support::rounding(5));
}

TEST(SlowOffset, MeetsItsBoundsOnTheCubeOfEighty) {
  for (const V3d& phase : {V3d(0), V3d(0.5), V3d(0.25), V3d(0.1, 0.6, 0.3), V3d(0.5, 0, 0.25)}) {
    const auto cube = [=](double half) {
      return [=](const V3d& p) { return box(half)(p - phase + kCentre); };
    };
    const NarrowBand moved = offset(sample(cube(40), 41), -5);
    EXPECT_LE(bandError(moved, cube(35)).linf, support::rounding(2)) << phase;
  }
}

TEST(SlowOffset, MeetsItsBoundsOnTurnedCubesOfEighty) {
  for (int turn = 0; turn < 8; ++turn) {
    const NarrowBand cube = sample(turnedBox(40, turn), 71);
    EXPECT_LE(bandError(offset(cube, -5), turnedBox(35, turn)).linf, support::measured(3.0e-4))
        << turn;
  }
}

TEST(SlowOffset, MeetsItsBoundsOnTheSphereOfSixtyFour) {
  const NarrowBand ball = sample(sphere(64), 65);
  EXPECT_LE(bandError(offset(ball, 10), sphere(74)).linf, support::measured(1.91e-5));
  EXPECT_LE(bandError(offset(ball, 10), sphere(74)).l1, support::measured(3.21e-6));
}

TEST(Offset, DoesNotDependOnThreads) {
  for (const NarrowBand& solid : {sample(box(12), 14), sampledBalls()}) {
    std::uint64_t hashes[3];
    for (const std::size_t threads : {1, 2, 4}) {
      hashes[threads / 2] =
          support::onThreads(threads, [&] { return offset(solid, 6).contentHash(); });
    }
    EXPECT_EQ(hashes[0], hashes[1]);
    EXPECT_EQ(hashes[0], hashes[2]);
  }
}

/// Returns the least number of leaves that a grid has while its solid is offset.
std::size_t leastLeavesDuringOffset(NarrowBand solid,
                                    const std::weak_ptr<openvdb::FloatGrid>& grid) {
  std::size_t least = grid.lock()->tree().leafCount();
  OffsetOptions options;
  options.progress = [&](double) {
    const auto held = grid.lock();
    least = std::min<std::size_t>(least, held ? held->tree().leafCount() : 0);
    return true;
  };
  (void)offset(std::move(solid), 0.3, options);
  return least;
}

TEST(Offset, FreesTheSolidOnTheWayUnlessItIsShared) {
  const auto longBox = [] { return makeBox(V3d(60, 2, 2), V3d(0), 0.1); };
  NarrowBand own = longBox();
  const std::weak_ptr<openvdb::FloatGrid> grid = own.shared()->grid;
  const std::size_t leaves = vdb(own).tree().leafCount();
  EXPECT_LT(leastLeavesDuringOffset(std::move(own), grid), leaves / 2);

  const NarrowBand shared = longBox();
  const std::uint64_t hash = shared.contentHash();
  EXPECT_EQ(leastLeavesDuringOffset(shared, shared.shared()->grid), leaves);
  EXPECT_EQ(shared.contentHash(), hash);
  const openvdb::FloatTree::Ptr tree = vdb(shared).deepCopy()->treePtr();
  const auto other = std::make_shared<openvdb::FloatGrid>(tree);
  other->setTransform(vdb(shared).transform().copy());
  (void)offset(makeBand(other), 0.3);
  EXPECT_EQ(tree->leafCount(), leaves);
}

/// Another owner edits the grid in place if it is the only one.
TEST(Offset, HoldsASharedSolidUntilTheEnd) {
  const NarrowBand solid = makeBox(V3d(6, 2, 2), V3d(0), 0.1);
  long least = 1000;
  OffsetOptions options;
  options.progress = [&](double) {
    least = std::min(least, solid.shared().use_count());
    return true;
  };
  (void)offset(solid, 0.3, options);
  EXPECT_EQ(least, 2);
}

TEST(Offset, FindsDistantBodies) {
  // The sweep passes slabs without a surface between the bodies.
  const NarrowBand left = makeSphere(8, V3d(0), 1), right = makeSphere(8, V3d(2000.5, 0.3, 0.1), 1);
  const NarrowBand both = offset(unite(left, right), 4);
  const NarrowBand alone = offset(left, 4);
  std::size_t compared = 0;
  for (auto it = vdb(alone).tree().cbeginValueOn(); it; ++it, ++compared)
    ASSERT_EQ(vdb(both).tree().getValue(it.getCoord()), *it);
  EXPECT_GT(compared, 1000u);
  EXPECT_EQ(vdb(both).activeVoxelCount(), compared + vdb(offset(right, 4)).activeVoxelCount());
}

TEST(Offset, Refuses) {
  const NarrowBand ball = sample(sphere(10), 12);
  EXPECT_THROW((void)offset(ball, std::numeric_limits<double>::quiet_NaN()), UsageError);
  EXPECT_THROW((void)offset(ball, std::numeric_limits<double>::infinity()), UsageError);
  EXPECT_THROW((void)offset(ball, 1, {.halfWidth = 0.2}), UsageError);
  EXPECT_THROW((void)offset(NarrowBand(), 1), InvalidInput);
  EXPECT_THROW((void)offset(ball, -10.5), InvalidInput);
  EXPECT_THROW((void)offset(ball, -1e6), InvalidInput);
  EXPECT_THROW((void)offset(ball, 1e6), ResourceLimit);
  EXPECT_THROW((void)offset(ball, 3e9), ResourceLimit);
  EXPECT_THROW((void)offset(ball, 30, {.maxMemory = 1000000}), ResourceLimit);
  EXPECT_THROW((void)offset(ball, 5, {.progress = [](double) { return false; }}), Cancelled);
}

// === Offset by a variable distance

/// Largest difference between the position of the zero set along rays from the centre and the
/// expected position.
double radialError(const NarrowBand& band, const std::function<double(const V3d&)>& radius) {
  const BandSampler phi(band, Interpolation::Tricubic);
  double worst = 0;
  for (int i = 0; i < 400; ++i) {
    const double z = 1 - (2 * i + 1) / 400.0, turn = 2.399963 * i, r = std::sqrt(1 - z * z);
    const V3d n(r * std::cos(turn), r * std::sin(turn), z);
    worst = std::max(worst, std::abs(phi.value(kCentre + n * radius(n)) /
                                     phi.gradient(kCentre + n * radius(n)).dot(n)));
  }
  return worst;
}

TEST(OffsetBy, AgreesWithTheConstantOffset) {
  const NarrowBand ball = sample(sphere(20), 22);
  for (const double distance : {4.0, -4.0, 0.0}) {
    const NarrowBand moved = offsetBy(ball, [=](const V3d&) { return distance; });
    EXPECT_LE(bandError(moved, sphere(20 + distance)).linf, support::measured(2.66e-4)) << distance;
  }
}

TEST(OffsetBy, DisplacesASphereAlongItsNormals) {
  const NarrowBand ball = sample(sphere(20), 22);
  // The field is read at the closest point, so that its values off the surface must not matter.
  const auto length = [](const V3d& n) { return 1 + 3 * n.z * n.z - 4 * n.x; };
  const NarrowBand moved = offsetBy(ball, [&](const V3d& p) {
    const double off = (p - kCentre).length() - 20;
    return length((p - kCentre).normalized()) + 100 * off;
  });
  EXPECT_LE(radialError(moved, [&](const V3d& n) { return 20 + length(n); }),
            support::measured(0.0115));
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(moved), 6), "");
}

TEST(OffsetBy, ConvergesToTheDisplacedSurface) {
  double previous = 0;
  for (const double scale : {1.0, 2.0, 4.0}) {
    const NarrowBand ball = sample(sphere(10 * scale), 12 * scale);
    const auto length = [=](const V3d& n) { return scale * (1 + 1.5 * n.z * n.z - 2 * n.x); };
    const NarrowBand moved =
        offsetBy(ball, [&](const V3d& p) { return length((p - kCentre).normalized()); });
    const double error =
        radialError(moved, [&](const V3d& n) { return 10 * scale + length(n); }) / scale;
    if (previous > 0) {
      EXPECT_LE(error, support::measured(0.217) * previous) << scale;
    }
    previous = error;
  }
}

TEST(OffsetBy, KeepsPartsWithZeroDistance) {
  const NarrowBand ball = sample(sphere(15), 17);
  const NarrowBand moved =
      offsetBy(ball, [](const V3d& p) { return std::clamp(p.x / 2 - 2, 0.0, 2.0); });
  auto before = vdb(ball).getConstAccessor();
  double worst = 0, moves = 0;
  support::forEachActive(moved, [&](const V3d& p, double value) {
    const double was = before.getValue(openvdb::Coord::round(toVdb(p)));
    if (p.x < -1) worst = std::max(worst, std::abs(value - was));
    if (p.x > 12) moves = std::max(moves, was - value);
  });
  EXPECT_LE(worst, support::measured(2.48e-4));
  EXPECT_GT(moves, 1.5);
}

TEST(OffsetBy, DoesNotDependOnThreads) {
  const NarrowBand cube = sample(box(12), 14);
  std::uint64_t hashes[3];
  for (const std::size_t threads : {1, 2, 4}) {
    hashes[threads / 2] = support::onThreads(threads, [&] {
      return offsetBy(cube, [](const V3d& p) { return std::sin(p.x / 3); }).contentHash();
    });
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(OffsetBy, Refuses) {
  const NarrowBand ball = sample(sphere(10), 12);
  EXPECT_THROW((void)offsetBy(ball, {}), UsageError);
  EXPECT_THROW((void)offsetBy(ball, [](const V3d& p) { return std::sqrt(p.x); }), InvalidInput);
  EXPECT_THROW((void)offsetBy(ball, [](const V3d&) { return -12.0; }), InvalidInput);
  EXPECT_THROW((void)offsetBy(NarrowBand(), [](const V3d&) { return 1.0; }), InvalidInput);
  EXPECT_THROW((void)offsetBy(ball, [](const V3d&) { return 1e6; }), ResourceLimit);
  EXPECT_THROW((void)offsetBy(ball, [](const V3d&) { return 1.0; },
                              {.progress = [](double) { return false; }}),
               Cancelled);
}

}  // namespace offset_test
