#include "levelset/distance/redistance.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/rounded_solids.h"
#include "tests/support/threads.h"

namespace redistance_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

struct BandError {
  double l1 = 0, linf = 0;  ///< voxels
  std::size_t count = 0;
};

BandError bandError(const NarrowBand& band, const Shape& exact) {
  BandError e;
  support::forEachActive(band, [&](const V3d& p, double value) {
    const double error = std::abs(value - exact(p)) / band.voxelSize();
    e.l1 += error;
    e.linf = std::max(e.linf, error);
    ++e.count;
  });
  e.l1 /= static_cast<double>(e.count);
  return e;
}

/// Mean distance to `exact`, in voxels, of the sign changes along grid edges, found by cubic
/// interpolation. This is the position error of the surface.
double surfaceError(const NarrowBand& band, const Shape& exact) {
  const openvdb::FloatGrid& grid = vdb(band);
  auto accessor = grid.getConstAccessor();
  double sum = 0, count = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it)
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](int k) {
        openvdb::Coord c = it.getCoord();
        c[axis] += k;
        return static_cast<double>(accessor.getValue(c));
      };
      const double a = at(-1), b = at(0), c = at(1), d = at(2);
      if ((b < 0) == (c < 0)) continue;
      double t = b / (b - c);
      for (int i = 0; i < 5; ++i) {
        const double c1 = (c - a) / 2, c2 = a - 2.5 * b + 2 * c - 0.5 * d,
                     c3 = 1.5 * (b - c) + (d - a) / 2;
        t -= (((c3 * t + c2) * t + c1) * t + b) / ((3 * c3 * t + 2 * c2) * t + c1);
      }
      openvdb::Vec3d p = it.getCoord().asVec3d();
      p[axis] += t;
      sum += std::abs(exact(toImath(grid.indexToWorld(p)))) / band.voxelSize();
      ++count;
    }
  return sum / count;
}

const V3d kCentre(0.013, -0.007, 0.021);

Shape sphere(double radius) {
  return [=](const V3d& p) { return (p - kCentre).length() - radius; };
}

/// Sphere whose slope varies from 0.7 to 2.3.
Shape distortedSphere(double radius) {
  return [=](const V3d& p) {
    const V3d q = (p - kCentre) / radius;
    return sphere(radius)(p) * (1.5 + 0.8 * std::sin(3 * q.x) * std::cos(2 * q.y + q.z));
  };
}

Shape box(const V3d& half) {
  return [=](const V3d& p) {
    const V3d q(std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

/// Sphere in voxels whose slope varies between 0.7 and 2.3 within a few voxels. One radian of that
/// variation has length `wave`.
Shape rippledSphere(double radius, double wave) {
  return [=](const V3d& p) {
    const double ripple = std::sin(p.x / wave) * std::sin(p.y / wave) * std::sin(p.z / wave);
    return sphere(radius)(p) * (1.5 + 0.8 * ripple);
  };
}

NarrowBand sampleVoxels(const Shape& shape, double extent, double halfWidth = 3) {
  return support::sampleBand(shape, {V3d(-extent), V3d(extent)}, 1, halfWidth);
}

NarrowBand sampleUnit(const Shape& shape, int voxelsPerUnit, double halfWidth = 3,
                      double size = 1.1) {
  return support::sampleBand(shape, {V3d(-size), V3d(size)}, 1.0 / voxelsPerUnit, halfWidth);
}

/// Largest difference between the values of two bands, voxels.
double largestDifference(const NarrowBand& a, const NarrowBand& b) {
  auto accessor = vdb(b).getConstAccessor();
  double largest = vdb(a).activeVoxelCount() == vdb(b).activeVoxelCount() ? 0 : a.halfWidth();
  for (auto it = vdb(a).cbeginValueOn(); it; ++it)
    largest = std::max(largest, std::abs(static_cast<double>(*it) -
                                         static_cast<double>(accessor.getValue(it.getCoord()))));
  return largest / a.voxelSize();
}

void expectSound(const NarrowBand& band) {
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(band), 6), "");
}

TEST(Redistance, KeepsAnExactDistance) {
  const NarrowBand result = redistance(sampleUnit(sphere(1), 24));
  EXPECT_LE(bandError(result, sphere(1)).linf, support::rounding(1.25));
  EXPECT_NEAR(result.halfWidth(), 3, support::rounding(3));
  expectSound(result);
}

TEST(Redistance, RestoresSlopesWithoutMovingTheSurface) {
  const NarrowBand field = sampleUnit(distortedSphere(1), 64);
  const NarrowBand result = redistance(field);
  EXPECT_LE(bandError(result, sphere(1)).linf, support::measured(3.03e-4));
  EXPECT_LE(surfaceError(result, sphere(1)), support::measured(7.49e-6));
  expectSound(result);
}

TEST(Redistance, ConvergesSecondOrderOverTheBand) {
  double previous = 0;
  for (const int n : {12, 24, 48}) {
    // Errors in voxels times the voxel size.
    const double error =
        bandError(redistance(sampleUnit(distortedSphere(1), n)), sphere(1)).linf / n;
    if (previous > 0) {
      EXPECT_GE(std::log2(previous / error), support::measuredOrder(2.01, 1.8)) << "at " << n;
    }
    previous = error;
  }
}

TEST(Redistance, RestoresRipplesThatTheBandTruncates) {
  const NarrowBand result = redistance(sampleVoxels(rippledSphere(32, 4), 33));
  EXPECT_LE(bandError(result, sphere(32)).linf, support::measured(0.00578));
  EXPECT_LE(surfaceError(result, sphere(32)), support::measured(2.57e-4));
  expectSound(result);
}

TEST(Redistance, ExtendsToTheRequestedHalfWidth) {
  const int n = 20;
  const NarrowBand result = redistance(sampleUnit(sphere(1), n), {.halfWidth = 1.5 * n});
  const BandError e = bandError(result, sphere(1));
  EXPECT_NEAR(static_cast<double>(e.count), 4.0 / 3 * M_PI * std::pow(2.5 * n, 3),
              support::measured(6.42e-5) * 1e6);
  EXPECT_LE(e.l1, support::measured(3.13e-5));
  // At the centre every point of the sphere is equally near. There the error is first order.
  EXPECT_LE(e.linf, support::measured(1.42e-4));
  expectSound(result);
}

TEST(Redistance, StaysInItsRegion) {
  const int n = 20;
  const Imath::Box3d region(V3d(0.5, -0.3, 0.8), V3d(1.2, 0.5, 1.7));
  const NarrowBand field = sampleUnit(sphere(1), n);
  const NarrowBand part = redistance(field, {.halfWidth = 15, .region = region});
  const NarrowBand whole = redistance(field, {.halfWidth = 15});
  auto accessor = vdb(whole).getConstAccessor();
  std::size_t count = 0;
  for (auto it = vdb(part).cbeginValueOn(); it; ++it, ++count) {
    const V3d p = toImath(vdb(part).indexToWorld(it.getCoord()));
    EXPECT_TRUE(Imath::Box3d(region.min - V3d(1.0 / n), region.max + V3d(1.0 / n)).intersects(p));
    ASSERT_NEAR(*it * n, accessor.getValue(it.getCoord()) * n, support::rounding(125));
  }
  EXPECT_GT(count, 1000u);
  // Signs are correct outside the region as well.
  EXPECT_LT(vdb(part).tree().getValue(openvdb::Coord(0)), 0);
  EXPECT_LT(vdb(part).tree().getValue(openvdb::Coord(-n + 2, 0, 0)), 0);
  EXPECT_GT(vdb(part).tree().getValue(openvdb::Coord(-n - 2, 0, 0)), 0);
}

TEST(Redistance, MeasuresAroundTheEdgesOfACube) {
  const V3d half(0.413, 0.377, 0.291);
  const int n = 32;
  const NarrowBand flat = sampleUnit(
      [=](const V3d& p) {
        return std::max({std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z});
      },
      n, 4, 0.5);
  const NarrowBand result = redistance(flat, {.halfWidth = 8});
  double nearFaces = 0, nearEdges = 0;  // by the position of the closest point
  support::forEachActive(result, [&](const V3d& p, double value) {
    const double error = std::abs(value - box(half)(p)) * n;
    int free = 0;  // number of axes along which the closest point is well inside a face
    for (int i = 0; i < 3; ++i) free += std::abs(p[i]) < half[i] - 2.0 / n;
    double& worst = box(half)(p) > 0 && free == 2 ? nearFaces : nearEdges;
    worst = std::max(worst, error);
  });
  EXPECT_LE(nearFaces, support::rounding(3));
  EXPECT_LE(nearEdges, support::rounding(4));
  expectSound(result);
}

TEST(Redistance, SeesBothWallsOfANarrowGap) {
  // Two slabs 1.6 voxels apart. Grid points in the gap have a wall on either side.
  const double gap = 0.8;
  const NarrowBand field = support::sampleBand(
      [=](const V3d& p) { return gap - std::abs(p.z - 0.3); }, {V3d(-12), V3d(12)}, 1, 3);
  const NarrowBand result = redistance(field);
  double worst = 0;
  support::forEachActive(result, [&](const V3d& p, double value) {
    if (std::max(std::abs(p.x), std::abs(p.y)) > 6 || std::abs(p.z) > 3) return;
    worst = std::max(worst, std::abs(value - (gap - std::abs(p.z - 0.3))));
  });
  EXPECT_LE(worst, support::measured(0.0731));
}

TEST(Redistance, FindsNoSurfaceWhereValuesOnlyDip) {
  // Near the ball the field falls to 0.02 along sheets and rises again. An interpolant that
  // overshoots would pass zero there.
  const Shape dipped = [](const V3d& p) {
    const double sheet = 0.02 + std::abs(p.x - 9.5) + 0.6 * std::max(0.0, p.z);
    return std::min(sphere(8)(p), std::hypot(p.y, p.z) < 5 ? sheet : 4.0);
  };
  const NarrowBand result = redistance(sampleVoxels(dipped, 16), {.halfWidth = 6});
  // Part of the dip is within the interpolant's stencil at the ball. A false surface would be an
  // entire voxel off.
  EXPECT_LE(bandError(result, sphere(8)).linf, support::measured(0.0577));
}

TEST(Redistance, DoesNotDependOnScaleOrPosition) {
  const double l1 = bandError(redistance(sampleVoxels(sphere(10), 11)), sphere(10)).l1;
  for (const double h : {1e-6, 1e6}) {
    const Shape ball = [=](const V3d& p) { return h * sphere(10)(p / h); };
    const NarrowBand field = support::sampleBand(ball, {V3d(-11 * h), V3d(11 * h)}, h);
    EXPECT_NEAR(bandError(redistance(field), ball).l1, l1, support::measured(1.11e-9)) << h;
  }
  const V3d away(1e6, -1e6, 1e6);
  const Shape ball = [=](const V3d& p) { return sphere(10)(p - away); };
  const NarrowBand field = support::sampleBand(ball, {away - V3d(11), away + V3d(11)}, 1);
  EXPECT_NEAR(bandError(redistance(field), ball).l1, l1, support::rounding(1));
}

TEST(Redistance, KeepsRoundedEdgesRound) {
  for (const support::RoundedSolid& solid : support::roundedSolids()) {
    const BandError e = bandError(redistance(solid.band()), solid.distance);
    EXPECT_LE(e.l1, support::measured(0.00793)) << solid.name;
    EXPECT_LE(e.linf, support::measured(0.105)) << solid.name;
  }
}

TEST(Redistance, WorksAtAnyHalfWidth) {
  for (const double from : {1.0, 1.5, 3.0})
    for (const double to : {1.0, 1.5, 3.0, 50.0}) {
      const NarrowBand result = redistance(sampleVoxels(sphere(12), 13, from), {.halfWidth = to});
      const BandError e = bandError(result, sphere(12));
      // One layer on each side resolves curvature badly, and at the centre the entire surface is
      // equally near.
      EXPECT_LE(e.l1, from < 2 ? support::measured(0.00115) : support::measured(9.42e-5))
          << from << " to " << to;
      EXPECT_LE(e.linf, from < 2 ? support::measured(0.00486) : support::measured(0.00166))
          << from << " to " << to;
      EXPECT_NEAR(result.halfWidth(), to, support::rounding(50));
    }
}

TEST(Redistance, AcceptsABackgroundOtherThanTheBand) {
  const NarrowBand field = sampleVoxels(sphere(12), 13, 5);
  openvdb::FloatGrid::Ptr grid = vdb(field).deepCopy();
  // A band of three voxels with a background of five.
  for (auto it = grid->beginValueOn(); it; ++it)
    if (std::abs(*it) > 3) it.setActiveState(false), it.setValue(std::copysign(5.0f, *it));
  const NarrowBand result = redistance(makeBand(grid), {.halfWidth = 6});
  EXPECT_LE(bandError(result, sphere(12)).linf, support::measured(4.01e-4));
}

TEST(Redistance, KeepsASingleVoxel) {
  openvdb::FloatGrid::Ptr grid = emptyLevelSet(uniformTransform(1), 3);
  for (int i = 0; i < 27; ++i)
    grid->tree().setValueOn(openvdb::Coord(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1), 0.5f);
  grid->tree().setValueOn(openvdb::Coord(0), -0.5f);
  const NarrowBand result = redistance(makeBand(grid));
  EXPECT_LT(vdb(result).tree().getValue(openvdb::Coord(0)), 0);
  EXPECT_GT(vdb(result).tree().getValue(openvdb::Coord(1, 0, 0)), 0);
  EXPECT_NEAR(vdb(result).tree().getValue(openvdb::Coord(2, 0, 0)), 1.5,
              support::measured(0.18, 0.25));
}

TEST(Redistance, IsStableUnderRepetition) {
  // A field that is already a distance keeps its values to the bit. Any other field converges to
  // one.
  for (const int radius : {10, 16}) {
    const NarrowBand ball = sampleUnit(sphere(1), radius);
    EXPECT_EQ(largestDifference(ball, redistance(ball)), 0) << radius;
  }
  const NarrowBand cuboid = sampleUnit(box(V3d(0.413, 0.377, 0.291)), 32);
  EXPECT_LE(largestDifference(redistance(cuboid), redistance(redistance(cuboid))),
            support::rounding(1));
  NarrowBand band = sampleUnit(distortedSphere(1), 24);
  for (int i = 0; i < 10; ++i) band = redistance(std::move(band));
  EXPECT_EQ(largestDifference(band, redistance(band)), 0);
  EXPECT_LE(surfaceError(band, sphere(1)), support::measured(7.97e-5));
  EXPECT_LE(bandError(band, sphere(1)).linf, support::measured(8.26e-4));
}

TEST(Redistance, CountsZeroAsOutside) {
  // Faces on grid points. One of them is a single layer thick beside the band's end.
  const NarrowBand field =
      support::sampleBand(box(V3d(8, 6, 4)), {V3d(-8, -6, -4), V3d(8, 6, 4)}, 1, 3);
  const NarrowBand result = redistance(field);
  EXPECT_EQ(vdb(result).tree().getValue(openvdb::Coord(8, 0, 0)), 0.0f);
  EXPECT_FALSE(std::signbit(vdb(result).tree().getValue(openvdb::Coord(8, 0, 0))));
  EXPECT_NEAR(vdb(result).tree().getValue(openvdb::Coord(7, 0, 0)), -1, support::rounding(1));
  EXPECT_NEAR(vdb(result).tree().getValue(openvdb::Coord(10, 0, 0)), 2, support::rounding(2));
  expectSound(result);
}

TEST(Redistance, ReadsABandOfTwoVoxels) {
  // Slopes of 2.3 in a band of three leave little more than one voxel on each side.
  const int n = 32;
  const NarrowBand result =
      redistance(sampleUnit([](const V3d& p) { return 2.3 * sphere(1)(p); }, n), {.halfWidth = 5});
  EXPECT_LE(bandError(result, sphere(1)).linf, support::measured(0.00173));
}

TEST(Redistance, DoesNotDependOnThreads) {
  const NarrowBand field = sampleUnit(distortedSphere(1), 24);
  std::uint64_t hashes[3];
  for (const std::size_t threads : {1, 2, 4})
    hashes[threads / 2] = support::onThreads(
        threads, [&] { return redistance(field, {.halfWidth = 10}).contentHash(); });
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Redistance, Refuses) {
  EXPECT_THROW((void)redistance(NarrowBand()), InvalidInput);
  const NarrowBand positive = sampleUnit([](const V3d& p) { return std::abs(sphere(1)(p)); }, 10);
  EXPECT_THROW((void)redistance(positive), InvalidInput);
  const NarrowBand ball = sampleUnit(sphere(1), 10);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)redistance(ball, {.halfWidth = nan}), UsageError);
  EXPECT_THROW((void)redistance(ball, {.halfWidth = 0.5}), UsageError);
  EXPECT_THROW((void)redistance(ball, {.region = Imath::Box3d()}), UsageError);
  EXPECT_THROW((void)redistance(ball, {.region = Imath::Box3d(V3d(50), V3d(51))}), InvalidInput);
  EXPECT_THROW((void)redistance(ball, {.halfWidth = 1e6}), ResourceLimit);
  EXPECT_THROW((void)redistance(ball, {.halfWidth = 50, .maxMemory = 100000}), ResourceLimit);
  EXPECT_THROW((void)redistance(ball, {.progress = [](double) { return false; }}), Cancelled);
}

TEST(SlowRedistance, MeetsItsBoundsAtThreeSizes) {
  // The length of ripples is a fixed fraction of the radius, four voxels at R = 64.
  double previous = 0;
  for (const double radius : {32.0, 64.0, 128.0}) {
    const NarrowBand result =
        redistance(sampleVoxels(rippledSphere(radius, radius / 16), radius + 1));
    const BandError e = bandError(result, sphere(radius));
    if (radius >= 64) {
      EXPECT_LE(e.linf, support::measured(0.00536)) << radius;
      EXPECT_LE(surfaceError(result, sphere(radius)), support::measured(2.55e-4)) << radius;
    }
    // World units: the radius is one.
    if (previous > 0) {
      EXPECT_GE(std::log2(previous / (e.l1 / radius)), support::measuredOrder(3.1)) << radius;
    }
    previous = e.l1 / radius;
  }
}

TEST(SlowRedistance, HundredRepetitionsMoveTheSurfaceLittle) {
  NarrowBand band = sampleVoxels(rippledSphere(64, 4), 65);
  for (int i = 0; i < 100; ++i) band = redistance(std::move(band));
  // Neither a grid point of the band nor the zero set has a larger error.
  EXPECT_LE(bandError(band, sphere(64)).linf, support::measured(0.00321));
  EXPECT_LE(surfaceError(band, sphere(64)), support::measured(2.15e-4));
}

}  // namespace redistance_test
