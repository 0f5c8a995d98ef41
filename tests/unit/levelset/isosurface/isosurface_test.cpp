#include "levelset/isosurface/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/isosurface/trilinear_piece.h"
#include "levelset/vdb.h"
#include "levelset/volumes/synthetic.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/support/volumes.h"

namespace isosurface_test {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::InvalidInput;
using levelset::isosurface;
using levelset::IsosurfaceResult;
using levelset::NoSurface;
using levelset::UsageError;
using levelset::Volume;
using levelset::VolumeBorder;
using levelset::VolumeGrid;
using levelset::VolumeType;
using support::BandError;
using support::cubeGrid;
using support::errorOf;
using support::measured;
using support::refusal;
using support::sampled;

/// Turns a grid about the origin, and shears it.
VolumeGrid oblique(VolumeGrid grid) {
  M44d turn, shear;
  turn.rotate(V3d(0.3, -0.5, 0.7));
  shear[1][0] = 0.25;
  grid.indexToWorld = grid.indexToWorld * shear * turn;
  return grid;
}

double unitSphere(const V3d& p) {
  return p.length() - 1;
}

// === Exactness on the trilinear surface itself

/// Squared distance of the nearest of many points of the surface in the unit cube, refined by a
/// search around the best one. Shares nothing with the search of the library.
double searched(const levelset::trilinear::Cubic& f, const openvdb::Mat3d& metric,
                const openvdb::Vec3d& target) {
  double best = HUGE_VAL;
  openvdb::Vec3d at(0.0);
  const auto look = [&](openvdb::Vec3d p, int axis) {
    p[axis] = 0;
    p[axis] = -f.value(p) / f.gradient(p)[axis];  // the function is linear along an axis
    if (!(p[axis] >= 0 && p[axis] <= 1)) return;
    const openvdb::Vec3d d = p - target;
    if (const double squared = d.dot(metric * d); squared < best) {
      best = squared;
      at = p;
    }
  };
  const auto lookAround = [&](const openvdb::Vec3d& center, double reach, int steps) {
    for (int axis = 0; axis < 3; ++axis)
      for (int a = -steps; a <= steps; ++a)
        for (int b = -steps; b <= steps; ++b) {
          openvdb::Vec3d p = center;
          const int u = (axis + 1) % 3, v = (axis + 2) % 3;
          p[u] = std::clamp(p[u] + reach * a / steps, 0.0, 1.0);
          p[v] = std::clamp(p[v] + reach * b / steps, 0.0, 1.0);
          look(p, axis);
        }
  };
  lookAround(openvdb::Vec3d(0.5), 0.5, 10);
  for (double reach = 0.1; reach > 1e-8 && std::isfinite(best); reach *= 0.6)
    lookAround(at, reach, 4);
  return best;
}

TEST(Isosurface, DistancesToTrilinearPiecesAreExact) {
  using openvdb::Mat3d;
  using openvdb::Vec3d;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Mat3d edges[] = {Mat3d::identity(), Mat3d(1., .2, 0., 0., .7, .3, .1, 0., 2.),
                         Mat3d(1., 0., 0., 0., 1., 0., 0., 0., 3.)};
  double worst = 0;
  int count = 0;
  for (int round = 0; count < 1500; ++round) {
    Vec3d normal(uniform(random), uniform(random), uniform(random));
    normal.normalize();
    const double offset = 0.5 * uniform(random), bend = 0.35 * std::abs(uniform(random));
    std::array<float, 8> corner{};
    for (std::size_t n = 0; n < 8; ++n) {
      const Vec3d p(n & 4 ? 0.5 : -0.5, n & 2 ? 0.5 : -0.5, n & 1 ? 0.5 : -0.5);
      corner[n] = static_cast<float>(normal.dot(p) + offset + bend * uniform(random));
    }
    const levelset::trilinear::Cubic f(corner);
    const Mat3d& edge = edges[round % 3];
    const Mat3d metric = edge * edge.transpose();
    const Vec3d target(0.5 + 3 * uniform(random), 0.5 + 3 * uniform(random),
                       0.5 + 3 * uniform(random));
    const double expected = std::sqrt(searched(f, metric, target));
    const double found = std::sqrt(
        levelset::trilinear::squaredDistance(f, metric, metric.inverse(0.0), target, HUGE_VAL));
    if (std::isinf(expected)) continue;
    ++count;
    worst = std::max(worst, found - expected);
    // The search of this test has an error of its own, so it may end further away.
    EXPECT_GT(found - expected, -1e-5);
  }
  EXPECT_LT(worst, 1e-14);  // 1.8e-15 among 20,000
}

TEST(Isosurface, NoisyCellsAreMeasuredExactly) {
  // Random values bend the surface in almost every cell; the distances are compared with those to
  // dense points on the surface, which are never nearer.
  VolumeGrid grid = cubeGrid(5);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Volume volume = sampled(grid, [&](const V3d&) { return uniform(random); });
  const IsosurfaceResult made =
      isosurface(volume, {.low = 0.0}, {.border = VolumeBorder::Close, .halfWidth = 2});
  std::vector<V3d> points;
  constexpr int kFine = 24;
  for (int axis = 0; axis < 3; ++axis)
    for (int u = 0; u <= 5 * kFine; ++u)
      for (int v = 0; v <= 5 * kFine; ++v)
        for (int cell = 0; cell < 5; ++cell) {
          V3d low, high;
          low[axis] = cell;
          high[axis] = cell + 1;
          low[(axis + 1) % 3] = high[(axis + 1) % 3] = static_cast<double>(u) / kFine;
          low[(axis + 2) % 3] = high[(axis + 2) % 3] = static_cast<double>(v) / kFine;
          const double from = volume.trilinear(low), to = volume.trilinear(high);
          if ((from > 0) != (to > 0))
            points.push_back((low + (high - low) * (from / (from - to))) * grid.indexToWorld);
          // Points of the border that close the solid.
          if (cell == 0 && from > 0) points.push_back(low * grid.indexToWorld);
          if (cell == 4 && to > 0) points.push_back(high * grid.indexToWorld);
        }
  const auto& tree = levelset::vdb(made.band);
  double excess = 0, nearer = 0;
  for (auto it = tree.cbeginValueOn(); it; ++it) {
    const V3d at = levelset::toImath(tree.transform().indexToWorld(it.getCoord()));
    double least = HUGE_VAL;
    for (const V3d& point : points) least = std::min(least, (point - at).length2());
    const double found = std::abs(static_cast<double>(*it)) / made.band.voxelSize();
    least = std::sqrt(least) / made.band.voxelSize();
    excess = std::max(excess, found - least);
    nearer = std::max(nearer, least - found);
  }
  EXPECT_LT(excess, measured(1.19e-7));
  // The spacing of the points bounds this difference.
  EXPECT_LT(nearer, measured(9.7e-3));
}

TEST(Isosurface, DistancesOfNoisyIntegersDifferByAtMostTheSpacing) {
  // A third of the samples equal the isovalue, so that the surface has needles and touches faces of
  // cells. A distance that is too large shows as a difference above one voxel.
  std::mt19937 random(5);
  VolumeGrid grid = cubeGrid(20);
  const Volume volume =
      sampled(grid, [&](const V3d&) { return static_cast<double>(random() % 3) - 1; });
  const IsosurfaceResult made = isosurface(volume, {.low = 0.0});
  const auto& tree = levelset::vdb(made.band);
  auto accessor = tree.getConstAccessor();
  double most = 0;
  std::size_t count = 0;
  for (auto it = tree.cbeginValueOn(); it; ++it)
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = it.getCoord();
      ++next[axis];
      if (!accessor.isValueOn(next)) continue;
      const double step = static_cast<double>(*it) - static_cast<double>(accessor.getValue(next));
      most = std::max(most, std::abs(step) / made.band.voxelSize());
      ++count;
    }
  EXPECT_GT(count, 20'000u);
  EXPECT_LT(most, 1 + support::rounding(4));
}

// === Convergence to an analytic surface

TEST(Isosurface, OfASphereConvergesInSecondOrder) {
  struct Case {
    const char* name;
    V3d ratio;
    bool isOblique;
    double finest;  ///< measured largest error at the finest grid, world units
  };
  for (const Case& one : {Case{"isotropic", V3d(1), false, 4.12e-4},
                          Case{"anisotropic", V3d(1, 1, 2.5), false, 1.56e-3},
                          Case{"oblique", V3d(1, 2, 1), true, 1.1e-3}}) {
    SCOPED_TRACE(one.name);
    std::vector<BandError> errors;
    for (const int n : {16, 32, 64}) {
      VolumeGrid grid = cubeGrid(n, one.ratio);
      if (one.isOblique) grid = oblique(grid);
      const Volume volume = sampled(grid, [](const V3d& p) { return 1 - p.length(); });
      const IsosurfaceResult made = isosurface(volume, {.low = 0.0});
      EXPECT_EQ(made.report.closedArea, 0);
      errors.push_back(errorOf(made.band, unitSphere));
      EXPECT_EQ(errors.back().wrongSigns, 0u);
    }
    for (std::size_t n = 0; n + 1 < errors.size(); ++n) {
      EXPECT_GT(std::log2(errors[n].inside / errors[n + 1].inside), 1.7);
      EXPECT_GT(std::log2(errors[n].outside / errors[n + 1].outside), 1.7);
    }
    EXPECT_LT(errors.back().inside, measured(one.finest));
    EXPECT_LT(errors.back().outside, measured(one.finest));
  }
}

TEST(Isosurface, OfALinearFunctionIsAPlaneInAnyFrame) {
  // Trilinear interpolation reproduces linear functions, so the only error is that of rounding.
  const V3d normal = V3d(0.4, -0.5, 0.8).normalized();
  const VolumeGrid grid = oblique(cubeGrid(12, V3d(1, 0.5, 2)));
  const Volume volume = sampled(grid, [&](const V3d& p) { return 0.1 - p.dot(normal); });
  const IsosurfaceResult made = isosurface(volume, {.low = 0.0}, {.voxelSize = 0.15});
  const auto& tree = levelset::vdb(made.band);
  double worst = 0;
  for (auto it = tree.cbeginValueOn(); it; ++it) {
    const V3d at = levelset::toImath(tree.transform().indexToWorld(it.getCoord()));
    if (at.length() > 0.5) continue;  // further away, the border of the volume is nearer
    worst = std::max(worst, std::abs(static_cast<double>(*it) - (at.dot(normal) - 0.1)));
  }
  EXPECT_LT(worst, measured(1.63e-8));
}

// === Sides, types and limits

TEST(Isosurface, SidesAreComplements) {
  const Volume volume = levelset::sphereVolume(24, 0.6);
  const auto above = isosurface(volume, {.low = 0.0});
  const auto below = isosurface(volume, {.high = 0.0}, {.halfWidth = 3});
  EXPECT_EQ(above.report.closedArea, 0);
  // Below, everything but the ball is solid, and the cube's faces close it.
  EXPECT_NEAR(below.report.closedArea, 24, 1e-9);
  const auto& a = levelset::vdb(above.band);
  auto b = levelset::vdb(below.band).getConstAccessor();
  std::size_t compared = 0;
  for (auto it = a.cbeginValueOn(); it; ++it) {
    const V3d at = levelset::toImath(a.transform().indexToWorld(it.getCoord()));
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) > 0.7) continue;
    if (std::abs(*it) > 1 - 0.7 - 1e-3) continue;
    EXPECT_EQ(b.getValue(it.getCoord()), -*it);
    ++compared;
  }
  EXPECT_GT(compared, 1000u);
  EXPECT_NEAR(levelset::measure(above.band).volume + levelset::measure(below.band).volume, 8,
              measured(1.04e-3));
}

TEST(Isosurface, TypesAndRescalingGiveTheSameSurface) {
  // The same ball as bytes, as rescaled 16-bit integers and with a negative slope.
  const VolumeGrid grid = cubeGrid(20);
  std::vector<std::uint8_t> bytes;
  std::vector<std::int16_t> words, negative;
  for (int k = 0; k <= 20; ++k)
    for (int j = 0; j <= 20; ++j)
      for (int i = 0; i <= 20; ++i) {
        const V3d p = V3d(i, j, k) * grid.indexToWorld;
        const int value =
            std::clamp(static_cast<int>(std::lround(100 + 80 * (1 - p.length()))), 0, 255);
        bytes.push_back(static_cast<std::uint8_t>(value));
        words.push_back(static_cast<std::int16_t>(4 * value - 500));
        negative.push_back(static_cast<std::int16_t>(-2 * value));
      }
  const auto volumeOf = [&](const auto& numbers, VolumeType type,
                            const levelset::VolumeScale& scale) {
    using Numbers = std::decay_t<decltype(numbers)>;
    const auto owner = std::make_shared<Numbers>(numbers);
    return Volume(grid, type, scale, {owner, reinterpret_cast<const char*>(owner->data()), false});
  };
  const auto solid = [](const Volume& volume) { return isosurface(volume, {.low = 100.0}).band; };
  const levelset::NarrowBand one = solid(volumeOf(bytes, VolumeType::U8, {}));
  EXPECT_EQ(solid(volumeOf(words, VolumeType::I16, {0.25, 125})).contentHash(), one.contentHash());
  EXPECT_EQ(solid(volumeOf(negative, VolumeType::I16, {-0.5, 0})).contentHash(), one.contentHash());
  EXPECT_LT(errorOf(one, unitSphere).outside, measured(6.81e-3));
  EXPECT_TRUE(levelset::check(one).passed());
}

TEST(Isosurface, SamplesEqualToTheIsovalueAreOutside) {
  // A block of ones in zeros: at isovalue 0, the surface is where the interpolant leaves 0.
  VolumeGrid grid;
  grid.size = V3i(9);
  const Volume volume = sampled(grid, [](const V3d& p) {
    return std::max({std::abs(p.x - 4), std::abs(p.y - 4), std::abs(p.z - 4)}) < 1.5 ? 1.0 : 0.0;
  });
  const IsosurfaceResult made = isosurface(volume, {.low = 0.0}, {.voxelSize = 0.5});
  EXPECT_EQ(made.report.closedArea, 0);
  const auto m = levelset::measure(made.band);
  EXPECT_EQ(m.components, 1u);
  const BandError error = errorOf(made.band, [](const V3d& p) {
    const V3d out(std::abs(p.x - 4) - 2, std::abs(p.y - 4) - 2, std::abs(p.z - 4) - 2);
    const V3d ahead(std::max(out.x, 0.0), std::max(out.y, 0.0), std::max(out.z, 0.0));
    return ahead.length() + std::min(std::max({out.x, out.y, out.z}), 0.0);
  });
  EXPECT_EQ(error.wrongSigns, 0u);
  // A sample that equals the isovalue counts as 2^-24 of the range below it. At a corner of the
  // block, where x y z = 2^-24, that moves the surface by sqrt(3) 2^-8.
  EXPECT_LT(std::max(error.inside, error.outside), measured(std::sqrt(3) / 256));
}

TEST(Isosurface, BetweenTwoLimitsIsAShell) {
  const Volume volume = sampled(cubeGrid(40), [](const V3d& p) { return 1 - p.length(); });
  const IsosurfaceResult made = isosurface(volume, {.low = 0.0, .high = 0.4});
  const BandError error =
      errorOf(made.band, [](const V3d& p) { return std::abs(p.length() - 0.8) - 0.2; });
  EXPECT_EQ(error.wrongSigns, 0u);
  EXPECT_LT(std::max(error.inside, error.outside), measured(2e-3));
  const auto m = levelset::measure(made.band);
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.cavities, 1u);
}

// === Border

TEST(Isosurface, BorderClosesTheSolid) {
  // The ball reaches two faces of the box: half of it is left.
  VolumeGrid grid = cubeGrid(32);
  grid.indexToWorld[3][2] = 0;  // z from 0 to 2.6
  const Volume volume = sampled(grid, [](const V3d& p) { return 1 - p.length(); });
  const IsosurfaceResult made = isosurface(volume, {.low = 0.0});
  EXPECT_NEAR(made.report.closedArea, M_PI, measured(3.38e-3));
  const BandError error = errorOf(made.band, [](const V3d& p) {
    if (p.length() < 1 && p.z >= 0) return -std::min(1 - p.length(), p.z);
    if (p.z >= 0) return p.length() - 1;
    const double rim = std::hypot(p.x, p.y);
    return rim < 1 ? -p.z : std::hypot(rim - 1, p.z);
  });
  EXPECT_EQ(error.wrongSigns, 0u);
  EXPECT_LT(std::max(error.inside, error.outside), measured(2e-3));
  EXPECT_NEAR(levelset::measure(made.band).volume, 2 * M_PI / 3, measured(1.47e-2));
  EXPECT_SAYS(refusal<InvalidInput>([&] {
                (void)isosurface(volume, {.low = 0.0}, {.border = VolumeBorder::Refuse});
              }),
              "reaches the border");
}

TEST(Isosurface, ClosingFacesAreOutside) {
  // The closing face lies on grid points, whose distance is 0.
  VolumeGrid grid;
  grid.size = V3i(17);
  const IsosurfaceResult made = isosurface(
      sampled(grid, [](const V3d& p) { return 6.2 - (p - V3d(8, 8, 0)).length(); }), {.low = 0.0});
  const auto& tree = levelset::vdb(made.band).tree();
  std::size_t zeros = 0;
  for (auto value = tree.cbeginValueOn(); value; ++value) {
    zeros += *value == 0;
    EXPECT_FALSE(std::signbit(*value) && *value == 0) << value.getCoord();
  }
  EXPECT_GT(zeros, 100u);
}

TEST(Isosurface, IsTheSameOnAnyNumberOfThreads) {
  const Volume volume = levelset::marschnerLobb(24);
  std::uint64_t first = 0;
  for (const std::size_t threads : {1u, 2u, 5u}) {
    const std::uint64_t hash = support::onThreads(
        threads, [&] { return isosurface(volume, {.low = 0.5}).band.contentHash(); });
    if (first == 0) first = hash;
    EXPECT_EQ(hash, first) << threads;
  }
}

TEST(Isosurface, RefusesWhatHasNoSurface) {
  const Volume volume = levelset::sphereVolume(8, 0.6);
  EXPECT_SAYS(refusal<NoSurface>([&] { (void)isosurface(volume, {.low = 5.0}); }), "no value");
  EXPECT_SAYS(refusal<NoSurface>([&] { (void)isosurface(volume, {.low = -5.0}); }), "every value");
  EXPECT_SAYS(refusal<UsageError>([&] { (void)isosurface(volume, {.low = 1.0, .high = 0.5}); }),
              "not below");
  EXPECT_SAYS(refusal<UsageError>([&] { (void)isosurface(volume, {.low = NAN}); }), "isovalue");
  EXPECT_SAYS(
      refusal<UsageError>([&] { (void)isosurface(volume, {.low = 0.0}, {.halfWidth = 1}); }),
      "half width");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { (void)isosurface(volume, {.low = 0.0}, {.maxMemory = 10'000}); }),
              "memory");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { (void)isosurface(volume, {.low = 0.0}, {.voxelSize = 1e-10}); }),
              "32 bits");
  VolumeGrid flat;
  flat.size = V3i(4, 4, 1);
  const Volume slice = sampled(flat, [](const V3d& p) { return p.x; });
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)isosurface(slice, {.low = 1.5}); }),
              "two along each axis");
}

}  // namespace isosurface_test
