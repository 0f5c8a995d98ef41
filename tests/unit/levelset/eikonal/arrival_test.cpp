#include "levelset/eikonal/arrival.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace arrival_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

const V3d kCentre(0.31, -0.17, 0.43);  // voxels

Shape sphere(double radius, const V3d& centre = kCentre) {
  return [=](const V3d& p) { return (p - centre).length() - radius; };
}

NarrowBand sample(const Shape& shape, double extent, double voxelSize = 1) {
  return support::sampleBand(shape, {V3d(-extent), V3d(extent)}, voxelSize);
}

struct Errors {
  double l1 = 0, inside = 0, outside = 0;  ///< largest errors on the two sides, voxels
  std::size_t count = 0;
};

/// Errors at grid points whose exact value is between the limits.
Errors errors(const openvdb::FloatGrid& grid, const Shape& exact, double from, double to) {
  Errors e;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const double truth = exact(toImath(grid.indexToWorld(it.getCoord())));
    if (std::abs(truth) < from || std::abs(truth) > to) continue;
    const double error = std::abs(static_cast<double>(*it) - truth) / grid.voxelSize()[0];
    double& worst = truth < 0 ? e.inside : e.outside;
    worst = std::max(worst, error);
    e.l1 += error;
    ++e.count;
  }
  e.l1 /= static_cast<double>(e.count);
  return e;
}

const openvdb::FloatGrid& grid(const ArrivalTimes& times) {
  return *times.times.shared()->scalar;
}

ArrivalOptions options(FrontMethod method, int order) {
  return {.method = method, .order = order};
}

constexpr FrontMethod kMethods[] = {FrontMethod::Marching, FrontMethod::Sweeping};

TEST(Arrival, MeasuresDistancesAroundASphere) {
  const NarrowBand ball = sample(sphere(24), 25);
  for (const FrontMethod method : kMethods) {
    const FrontDistance second = frontDistance(ball, 9, options(method, 2));
    const Errors two = errors(vdb(second.band), sphere(24), 0, 8.9);
    EXPECT_LE(std::max(two.inside, two.outside), support::measured(0.0126));
    EXPECT_NEAR(second.band.halfWidth(), 9, support::rounding(10));
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(second.band), 6), "");
    // First order loses half the curvature for each voxel of distance, about 7 / 48 in total.
    const Errors one =
        errors(vdb(frontDistance(ball, 9, options(method, 1)).band), sphere(24), 0, 8.5);
    EXPECT_LE(one.inside, support::measured(0.196));
    EXPECT_LE(one.outside, support::measured(0.14, 0.2));
    EXPECT_GT(one.outside, 3 * two.outside);
  }
}

TEST(Arrival, ConvergesWithItsOrder) {
  const double reach = 0.8;
  for (const FrontMethod method : kMethods)
    for (const int order : {1, 2}) {
      double previous = 0;
      for (const int n : {8, 16, 32}) {
        const double h = 1.0 / n;
        const Shape exact = sphere(1, kCentre * h);
        const NarrowBand ball = support::sampleBand(exact, {V3d(-1), V3d(1)}, h);
        const FrontDistance result = frontDistance(ball, reach, options(method, order));
        // Error per unit of distance beyond the initial band.
        const double error =
            errors(vdb(result.band), exact, 0, reach - h).outside * h / (reach - 2 * h);
        if (previous > 0) {
          const double least = n == 32 ? 0.9 : 0.75;  // eight voxels of distance are few
          EXPECT_GE(std::log2(previous / error), order == 1 ? least : 1.7) << n << ", " << order;
        }
        previous = error;
      }
    }
}

TEST(Arrival, MethodsAgreeInFirstOrder) {
  const NarrowBand ball = sample(sphere(12), 13);
  ArrivalOptions march = options(FrontMethod::Marching, 1),
                 sweep = options(FrontMethod::Sweeping, 1);
  march.speed = sweep.speed = [](const V3d& p) { return 1.2 + std::sin(0.3 * p.x + 0.2 * p.y); };
  const ArrivalTimes a = arrivalTimes(ball, 8, march), b = arrivalTimes(ball, 8, sweep);
  auto other = grid(b).getConstAccessor();
  std::size_t count = 0;
  for (auto it = grid(a).cbeginValueOn(); it; ++it, ++count) {
    if (std::abs(*it) > 7.9f) continue;
    ASSERT_NEAR(*it, other.getValue(it.getCoord()), support::measured(4.2e-5));
  }
  EXPECT_GT(count, 10000u);
}

TEST(Arrival, TakesTheEarlierOfTwoFronts) {
  const Shape pair = [](const V3d& p) {
    return std::min(sphere(8, V3d(-14, 0, 0))(p), sphere(8, V3d(14, 0.3, 0))(p));
  };
  const NarrowBand balls = sample(pair, 23);
  for (const FrontMethod method : kMethods) {
    const Errors e = errors(vdb(frontDistance(balls, 7, options(method, 2)).band), pair, 0, 6.9);
    EXPECT_LE(e.outside, support::measured(0.025));
  }
}

TEST(Arrival, FollowsALinearSpeedFromAPoint) {
  // F = 1 + g·(p − source): T = acosh(1 + |g|² d² / (2 F)) / |g|.
  const V3d source(0.01, 0.02, -0.013), slope(0.5, 0.3, 0.2);
  const auto speed = [=](const V3d& p) { return 1 + slope.dot(p - source); };
  const Shape exact = [=](const V3d& p) {
    const double g = slope.length(), d = (p - source).length();
    return std::acosh(1 + g * g * d * d / (2 * speed(p))) / g;
  };
  const V3d sources[] = {source};
  for (const FrontMethod method : kMethods) {
    double coarser = 0;
    for (const int n : {16, 32, 64}) {
      const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1.0 / n), 3));
      ArrivalOptions o = options(method, 2);
      o.speed = speed;
      const Errors e =
          errors(grid(arrivalTimesFromPoints(lattice, sources, 0.8, o)), exact, 0, 0.78);
      EXPECT_LE(e.l1, support::measured(0.0166, 0.02)) << n;
      EXPECT_LE(e.outside, support::measured(0.0398)) << n;
      // In voxels; the order is 1.8 in world units.
      if (n == 64) {
        EXPECT_LE(e.l1, std::exp2(-0.8) * coarser);
      }
      coarser = e.l1;
    }
  }
}

TEST(Arrival, IsExactAroundPointsAtConstantSpeed) {
  const V3d sources[] = {V3d(0.01, 0.02, -0.013), V3d(0.9, 0.1, 0.2)};
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1.0 / 32), 3));
  const Shape nearest = [&](const V3d& p) {
    return std::min((p - sources[0]).length(), (p - sources[1]).length());
  };
  for (const FrontMethod method : kMethods) {
    const std::span<const V3d> one(sources, 1);
    const Errors alone = errors(
        grid(arrivalTimesFromPoints(lattice, one, 1, options(method, 2))),
        [&](const V3d& p) { return (p - sources[0]).length(); }, 0, 0.98);
    EXPECT_LE(alone.outside, support::measured(9.11e-6));
    const Errors two = errors(grid(arrivalTimesFromPoints(lattice, sources, 1, options(method, 2))),
                              nearest, 0, 0.98);
    EXPECT_LE(two.l1, support::measured(1.78e-4));
    EXPECT_LE(two.outside, support::measured(0.128, 0.15));  // where the fronts meet
  }
}

/// Fermat's principle: the fastest path from a point below z = 0, at speed 1, to a point above, at
/// speed v.
double refracted(const V3d& from, const V3d& to, double v) {
  const double across = std::hypot(to.x - from.x, to.y - from.y);
  double low = 0, high = across;
  const auto time = [&](double s) {
    return std::hypot(s, from.z) + std::hypot(across - s, to.z) / v;
  };
  for (int i = 0; i < 100; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (time(a) < time(b) ? high : low) = time(a) < time(b) ? b : a;
  }
  return time(low);
}

TEST(Arrival, RefractsIntoSlowAndFastInclusions) {
  const V3d source(0.2, -0.3, -14.5);
  const V3d sources[] = {source};
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  for (const FrontMethod method : kMethods)
    for (const double v : {0.5, 2.0}) {
      ArrivalOptions o = options(method, 2);
      o.speed = [=](const V3d& p) { return p.z < 0 ? 1 : v; };
      const ArrivalTimes times = arrivalTimesFromPoints(lattice, sources, 28, o);
      double sum = 0, worst = 0, count = 0;
      for (auto it = grid(times).cbeginValueOn(); it; ++it) {
        const V3d p = toImath(it.getCoord().asVec3d());
        if (p.z < 0.5 || *it > 26) continue;
        // The solver places the interface half way between grid points.
        const double truth = refracted(source + V3d(0, 0, 0.5), p + V3d(0, 0, 0.5), v);
        sum += std::abs(static_cast<double>(*it) - truth);
        worst = std::max(worst, std::abs(static_cast<double>(*it) - truth));
        ++count;
      }
      EXPECT_GT(count, 1000) << v;
      EXPECT_LE(sum / count, support::measured(0.0262)) << v;
      EXPECT_LE(worst, support::measured(0.0601)) << v;
    }
}

TEST(Arrival, GoesAroundObstacles) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  const V3d sources[] = {V3d(0, 0, -10)};
  for (const double blocked : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    for (const FrontMethod method : kMethods) {
      ArrivalOptions o = options(method, 2);
      // A disk as obstacle, and a closed shell that no front enters.
      o.speed = [=](const V3d& p) {
        const bool disk = std::abs(p.z) < 1.1 && std::hypot(p.x, p.y) < 8;
        const double shell = (p - V3d(0, 20, -10)).length();
        return disk || (shell > 4 && shell < 6.5) ? blocked : 1.0;
      };
      const ArrivalTimes times = arrivalTimesFromPoints(lattice, sources, 30, o);
      const auto& tree = grid(times).tree();
      EXPECT_FALSE(tree.isValueOn(openvdb::Coord(0)));
      EXPECT_FALSE(tree.isValueOn(openvdb::Coord(0, 20, -10)));
      // Over the rim and back: about twice the hypotenuse.
      EXPECT_TRUE(tree.isValueOn(openvdb::Coord(0, 0, 10)));
      EXPECT_NEAR(tree.getValue(openvdb::Coord(0, 0, 10)), 2 * std::hypot(8.5, 9) + 2,
                  support::measured(0.202));
    }
}

TEST(Arrival, StopsAtAWallBesideItsSource) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  // Walls that three samples of a straight path of eight voxels miss. The last wall is oblique.
  const std::pair<V3d, Shape> cases[] = {
      {V3d(0), [](const V3d& p) { return p.x - 4; }},
      {V3d(0.3, 0.2, -0.4), [](const V3d& p) { return p.x - 3; }},
      {V3d(0), [](const V3d& p) { return (p.x + p.y + p.z) / 3 - 1.7; }}};
  for (const auto& [source, plane] : cases)
    for (const FrontMethod method : kMethods)
      for (const int order : {1, 2}) {
        ArrivalOptions o = options(method, order);
        o.speed = [&plane = plane](const V3d& p) { return std::abs(plane(p)) < 0.4 ? 0.0 : 1.0; };
        const V3d sources[] = {source};
        const ArrivalTimes times = arrivalTimesFromPoints(lattice, sources, 12, o);
        EXPECT_GT(times.figures.reached, 1000u);
        for (auto it = grid(times).cbeginValueOn(); it; ++it)
          ASSERT_LT(plane(toImath(it.getCoord().asVec3d())), 0) << it.getCoord();
      }
}

TEST(Arrival, RespectsSlowAndFastRegionsNearItsSource) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  const V3d sources[] = {V3d(0)};
  for (const FrontMethod method : kMethods) {
    ArrivalOptions o = options(method, 2);
    // A wall one grid point wide and a hundred times slower, inside a box.
    o.speed = [](const V3d& p) {
      if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 9) return 0.0;
      return std::abs(p.x - 4) < 0.4 ? 0.01 : 1.0;
    };
    const ArrivalTimes slowed = arrivalTimesFromPoints(lattice, sources, 150, o);
    EXPECT_NEAR(grid(slowed).tree().getValue(openvdb::Coord(3, 0, 0)), 3, support::rounding(3));
    EXPECT_NEAR(grid(slowed).tree().getValue(openvdb::Coord(6, 0, 0)), 105,
                support::measured(3.67));
    // A lane in which the detour is faster than the straight path.
    o.speed = [](const V3d& p) {
      if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 9) return 0.0;
      return std::abs(p.y - 3) < 0.6 ? 50.0 : 1.0;
    };
    const ArrivalTimes sped = arrivalTimesFromPoints(lattice, sources, 12, o);
    EXPECT_LT(grid(sped).tree().getValue(openvdb::Coord(7, 2, 0)), 4.5f);
    EXPECT_NEAR(grid(sped).tree().getValue(openvdb::Coord(0, -6, 0)), 6, support::rounding(6));
  }
}

TEST(Arrival, HasTheSameErrorAtAnySpeed) {
  const NarrowBand ball = sample(sphere(12), 13);
  for (const FrontMethod method : kMethods)
    for (const int order : {1, 2}) {
      Errors expected;
      for (const double speed : {1.0, 1e-6, 1e9}) {
        ArrivalOptions o = options(method, order);
        o.speed = [=](const V3d&) { return speed; };
        const Shape exact = [=](const V3d& p) { return sphere(12)(p) / speed; };
        Errors e = errors(grid(arrivalTimes(ball, 6 / speed, o)), exact, 0, 5.9 / speed);
        e.inside *= speed;
        e.outside *= speed;
        if (speed == 1) expected = e;
        EXPECT_NEAR(e.inside, expected.inside, support::measured(6.66e-6) * expected.inside)
            << speed << ", " << order;
        EXPECT_NEAR(e.outside, expected.outside, support::measured(8.89e-6) * expected.outside)
            << speed << ", " << order;
        EXPECT_EQ(e.count, expected.count) << speed;
      }
    }
}

TEST(Arrival, ComputesLittleBeyondTheLimit) {
  const NarrowBand ball = sample(sphere(12), 13);
  ArrivalOptions o = options(FrontMethod::Sweeping, 2);
  // A limit of one voxel at speed 1 would be a hundred voxels here, 270 MB of blocks.
  o.speed = [](const V3d&) { return 100.0; };
  o.maxMemory = 40 << 20;
  EXPECT_GT(arrivalTimes(ball, 0.06, o).figures.reached, 10000u);
}

TEST(Arrival, TakesManySourcesInLittleMemory) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  std::vector<V3d> sources;
  for (int i = 0; i < 3000; ++i) sources.emplace_back(i % 50 * 0.2, i / 50 * 0.1, 0.3);
  ArrivalOptions o = options(FrontMethod::Sweeping, 2);
  o.maxMemory = 20 << 20;  // separate start solutions would take 100 MB
  int early = 0;
  o.progress = [&](double fraction) {
    early += fraction < 0.1;
    return true;
  };
  EXPECT_GT(arrivalTimesFromPoints(lattice, sources, 9, o).figures.reached, 1000u);
  EXPECT_GT(early, 10);
  for (V3d& p : sources) p *= 100;
  EXPECT_THROW((void)arrivalTimesFromPoints(lattice, sources, 9, o), ResourceLimit);
  o.progress = [](double fraction) { return fraction > 0.1; };
  EXPECT_THROW((void)arrivalTimesFromPoints(lattice, sources, 9, o), Cancelled);
}

TEST(Arrival, StartsAtTheSurfaceWithItsLocalSpeed) {
  // The speed is constant on spheres: T = ∫ dr / F(r).
  const auto speed = [](const V3d& p) { return 0.5 + 0.05 * (p - kCentre).length(); };
  const Shape exact = [](const V3d& p) {
    return std::log((0.5 + 0.05 * (p - kCentre).length()) / (0.5 + 0.05 * 16)) / 0.05;
  };
  const NarrowBand ball = sample(sphere(16), 17);
  for (const FrontMethod method : kMethods) {
    ArrivalOptions o = options(method, 2);
    o.speed = speed;
    const ArrivalTimes times = arrivalTimes(ball, 7, o);
    const Errors e = errors(grid(times), exact, 0, 6.8);
    EXPECT_LE(e.outside, support::measured(0.0163));
    EXPECT_LE(e.inside, support::measured(0.0358));
    EXPECT_EQ(times.figures.reached, grid(times).activeVoxelCount());
  }
}

TEST(Arrival, DoesNotDependOnThreads) {
  const NarrowBand ball = sample(sphere(14), 15);
  ArrivalOptions o = options(FrontMethod::Sweeping, 2);
  o.speed = [](const V3d& p) { return 1 + 0.5 * std::sin(p.x) * std::cos(p.z); };
  std::uint64_t hashes[2];
  for (const std::size_t threads : {1, 3}) {
    hashes[threads / 2] =
        support::onThreads(threads, [&] { return arrivalTimes(ball, 9, o).times.contentHash(); });
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Arrival, FromPointsDoesNotDependOnThreads) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  const V3d sources[] = {V3d(0.3, 0.1, -0.4), V3d(13, 2, 5)};
  ArrivalOptions o = options(FrontMethod::Sweeping, 2);
  o.speed = [](const V3d& p) { return 1 + 0.5 * std::sin(p.x) * std::cos(p.z); };
  std::uint64_t hashes[2];
  for (const std::size_t threads : {1, 3}) {
    hashes[threads / 2] = support::onThreads(threads, [&] {
      return arrivalTimesFromPoints(lattice, sources, 20, o).times.contentHash();
    });
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

// The contribution of the straight path exceeds the total there, so that a root of a negative
// number arose.
TEST(Arrival, EndsNearASourceInALayer) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  const V3d sources[] = {V3d(0.5, 0.5, 0.9)};
  for (const FrontMethod method : kMethods) {
    ArrivalOptions o = options(method, 2);
    o.speed = [](const V3d& p) {
      if (p.z > 0.9) return 1.0;
      return p.z > 0.45 ? 2.5 - (p.z - 0.45) / 0.3 : 1.9 + std::max(0.0, p.z) / 0.75;
    };
    const ArrivalTimes times = arrivalTimesFromPoints(lattice, sources, 8, o);
    EXPECT_GT(times.figures.reached, 2000u);
    for (auto it = grid(times).cbeginValueOn(); it; ++it) EXPECT_TRUE(*it >= 0 && *it <= 8) << *it;
  }
}

// Two neighbours are equally far from the source, up to rounding.
TEST(Arrival, IsExactAroundAPointMidwayBetweenTwoGridPoints) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  for (const double off : {0.0, 1e-12, -1e-5, 1e-3}) {
    const V3d sources[] = {V3d(0.5 + off, 0.5 - off, 0.2)};
    for (const FrontMethod method : kMethods) {
      const Errors e = errors(
          grid(arrivalTimesFromPoints(lattice, sources, 20, options(method, 2))),
          [&](const V3d& p) { return (p - sources[0]).length(); }, 0, 19.9);
      EXPECT_LE(e.outside, support::measured(5.17e-6)) << off;
    }
  }
}

// One voxel from a point source along an axis, the second upwind grid point lies beyond the source.
// The front arrived later there. On that axis only first order is possible, on the others second
// order is.
TEST(Arrival, CountsGridPointsWithAFirstOrderAxis) {
  const NarrowBand lattice = makeBand(emptyLevelSet(uniformTransform(1), 3));
  const V3d sources[] = {V3d(0.2, -0.3, 0.1)};  // nearest to the grid point 0, 0, 0
  for (const FrontMethod method : kMethods) {
    const ArrivalTimes times = arrivalTimesFromPoints(lattice, sources, 20, options(method, 2));
    std::size_t beside = 0, perhapsStarted = 0;
    for (auto it = grid(times).cbeginValueOn(); it; ++it) {
      const openvdb::Coord c = it.getCoord();
      if (std::abs(c.x()) != 1 && std::abs(c.y()) != 1 && std::abs(c.z()) != 1) continue;
      ++beside;
      perhapsStarted += (toImath(c.asVec3d()) - sources[0]).length() < 9;
    }
    EXPECT_GT(beside, 2 * perhapsStarted);
    EXPECT_GE(times.figures.firstOrder, beside - perhapsStarted);
    EXPECT_LE(times.figures.firstOrder, beside);
    EXPECT_EQ(arrivalTimesFromPoints(lattice, sources, 20, options(method, 1)).figures.firstOrder,
              0u);
  }
}

TEST(Arrival, DoesNotDependOnTheVoxelSize) {
  const NarrowBand unit = sample(sphere(8), 9);
  const Errors expected = errors(vdb(frontDistance(unit, 6).band), sphere(8), 0, 5.9);
  for (const double h : {1e-6, 1e6}) {
    const NarrowBand ball = sample(sphere(8 * h, kCentre * h), 9 * h, h);
    const Errors e =
        errors(vdb(frontDistance(ball, 6 * h).band), sphere(8 * h, kCentre * h), 0, 5.9 * h);
    EXPECT_NEAR(e.outside, expected.outside, support::rounding(3));
    EXPECT_EQ(e.count, expected.count);
  }
}

TEST(Arrival, Refuses) {
  const NarrowBand ball = sample(sphere(6), 7);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const V3d origin[] = {V3d(0)}, nowhere[] = {V3d(nan, 0, 0)}, far[] = {V3d(1e12, 0, 0)};
  for (const FrontMethod method : kMethods) {
    const ArrivalOptions o = options(method, 2);
    EXPECT_THROW((void)frontDistance(NarrowBand(), 3, o), InvalidInput);
    EXPECT_THROW((void)frontDistance(ball, nan, o), UsageError);
    EXPECT_THROW((void)frontDistance(ball, -1, o), UsageError);
    EXPECT_THROW((void)frontDistance(ball, 0.5, o), UsageError);
    EXPECT_THROW((void)frontDistance(ball, 1e6, o), ResourceLimit);
    EXPECT_THROW((void)frontDistance(ball, 3, options(method, 3)), UsageError);
    EXPECT_THROW((void)arrivalTimesFromPoints(ball, {}, 3, o), UsageError);
    EXPECT_THROW((void)arrivalTimesFromPoints(ball, nowhere, 3, o), UsageError);
    EXPECT_THROW((void)arrivalTimesFromPoints(ball, far, 3, o), ResourceLimit);
    ArrivalOptions still = o;
    still.speed = [](const V3d&) { return 0.0; };
    EXPECT_THROW((void)arrivalTimes(ball, 3, still), InvalidInput);
    EXPECT_THROW((void)arrivalTimesFromPoints(ball, origin, 3, still), InvalidInput);
    EXPECT_THROW((void)frontDistance(ball, 3, still), UsageError);
    ArrivalOptions fast = o;
    fast.speed = [](const V3d&) { return 1e9; };
    fast.maxMemory = 20 << 20;
    EXPECT_THROW((void)arrivalTimes(ball, 3, fast), ResourceLimit);
    ArrivalOptions cancelled = o;
    cancelled.progress = [](double) { return false; };
    EXPECT_THROW((void)frontDistance(ball, 30, cancelled), Cancelled);
  }
}

TEST(SlowArrival, SweepsEightVoxelsAroundASphere) {
  const NarrowBand ball = sample(sphere(64), 65);
  const Errors e = errors(vdb(frontDistance(ball, 11).band), sphere(64), 0, 10.9);
  EXPECT_LE(std::max(e.inside, e.outside), support::measured(0.00186));
  const Errors exact = errors(vdb(redistance(ball, {.halfWidth = 11})), sphere(64), 0, 11);
  EXPECT_LE(std::max(exact.inside, exact.outside), support::measured(1.58e-5));
}

}  // namespace arrival_test
