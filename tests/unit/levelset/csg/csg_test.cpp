#include "levelset/csg/csg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/offset/morphology.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace csg_test {

using namespace levelset;
using Imath::V3d;

constexpr double kPi = M_PI;

float minMax(CsgOperation operation, float a, float b) {
  if (operation == CsgOperation::Union) return std::min(a, b);
  return std::max(a, operation == CsgOperation::Intersection ? b : -b);
}

/// Expects that signs everywhere, and values beside the surface, are those of min and max to the
/// bit. Elsewhere the distance may only be larger.
void expectMinMax(CsgOperation operation, const NarrowBand& a, const NarrowBand& b) {
  const NarrowBand result = combine(operation, std::array{a, b}).band;
  const auto inA = vdb(a).getConstAccessor(), inB = vdb(b).getConstAccessor();
  const auto got = vdb(result).getConstAccessor();
  openvdb::CoordBBox box = vdb(a).evalActiveVoxelBoundingBox();
  box.expand(vdb(b).evalActiveVoxelBoundingBox());
  box.expand(2);
  const auto expected = [&](const openvdb::Coord& c) {
    return minMax(operation, inA.getValue(c), inB.getValue(c));
  };
  for (const openvdb::Coord& c : box) {
    const float want = expected(c), have = got.getValue(c);
    ASSERT_EQ(have < 0, want < 0) << c;
    bool beside = false;
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        openvdb::Coord next = c;
        next[axis] += step;
        beside |= (expected(next) < 0) != (want < 0);
      }
    if (beside)
      ASSERT_EQ(have, want) << c;
    else
      ASSERT_GE(std::abs(have), std::abs(want)) << c;
    ASSERT_EQ(got.isValueOn(c), std::abs(have) < vdb(result).background()) << c;
    if (!got.isValueOn(c)) {
      ASSERT_EQ(std::abs(have), vdb(result).background()) << c;
    }
  }
}

TEST(Csg, TakesMinAndMaxEverywhere) {
  const NarrowBand ball = makeSphere(1, V3d(0.1, 0, 0), 0.1);
  const NarrowBand rod = makeCylinder(0.4, 4, V3d(0.2, 0.1, 0), V3d(1, 2, 3), 0.1);
  const NarrowBand inner = makeSphere(0.5, V3d(0), 0.1);
  const NarrowBand apart = makeSphere(1, V3d(7, 0, 0), 0.1);
  for (const auto operation :
       {CsgOperation::Union, CsgOperation::Intersection, CsgOperation::Difference}) {
    expectMinMax(operation, ball, rod);
    expectMinMax(operation, rod, ball);
    expectMinMax(operation, ball, inner);
  }
  expectMinMax(CsgOperation::Union, ball, apart);
  expectMinMax(CsgOperation::Difference, ball, apart);
  // Larger than a leaf, so that tiles meet tiles, leaves and empty space.
  const NarrowBand large = makeSphere(40, V3d(0), 1), bite = makeSphere(25, V3d(31, 3, 2), 1);
  for (const auto operation :
       {CsgOperation::Union, CsgOperation::Intersection, CsgOperation::Difference})
    expectMinMax(operation, large, bite);
}

/// Distance to the surface of two overlapping spheres' union or intersection. The nearest point of
/// a sphere counts if it is on the surface. Otherwise the nearest point of the circle of
/// intersection counts.
struct TwoSpheres {
  double radius, half;  ///< centres at x = ± half

  double distance(const V3d& p, CsgOperation operation) const {
    const double side = operation == CsgOperation::Union ? 1 : -1;
    const double ring = std::sqrt(radius * radius - half * half);
    const double across = std::hypot(p.y, p.z);
    double best = std::hypot(p.x, across - ring);
    double phi[2];
    for (int i = 0; i < 2; ++i) {
      const V3d center(i == 0 ? -half : half, 0, 0);
      const V3d foot = center + (p - center).normalized() * radius;
      phi[i] = (p - center).length() - radius;
      if (side * ((foot + center).length() - radius) >= 0) best = std::min(best, std::abs(phi[i]));
    }
    const double bound = side > 0 ? std::min(phi[0], phi[1]) : std::max(phi[0], phi[1]);
    return std::copysign(best, bound);
  }
};

TEST(Csg, HoldsTheDistanceBeyondTheSeam) {
  const double h = 1.0 / 32;
  const TwoSpheres truth{1, 0.5};
  const NarrowBand a = makeSphere(1, V3d(-0.5, 0, 0), h, {.halfWidth = 4});
  const NarrowBand b = makeSphere(1, V3d(0.5, 0, 0), h, {.halfWidth = 4});
  for (const auto operation : {CsgOperation::Union, CsgOperation::Intersection}) {
    const NarrowBand result = combine(operation, std::array{a, b}).band;
    const auto accessor = vdb(result).getConstAccessor();
    for (auto it = vdb(result).cbeginValueOn(); it; ++it) {
      const openvdb::Coord c = it.getCoord();
      bool beside = false;
      for (const openvdb::Coord& near : openvdb::CoordBBox(c.offsetBy(-1), c.offsetBy(1)))
        beside |= (accessor.getValue(near) < 0) != (*it < 0);
      if (beside) continue;
      const double want = truth.distance(toImath(vdb(result).indexToWorld(c)), operation);
      // The spheres of 32 voxels are approximated by planes over a cell. The error is κ/4 for each,
      // and more where they meet.
      ASSERT_NEAR(*it, want, support::measured(0.0257) * h) << c;
    }
  }
}

TEST(Csg, OverlappingBoxesAreOneBox) {
  // The inner face is no surface and must leave no trace, whether or not it lies on grid points.
  const double h = 0.1;
  const NarrowBand both = makeBox(V3d(2, 2, 2), V3d(0), h, {.halfWidth = 4});
  const auto want = vdb(both).getConstAccessor();
  for (const double top : {0.05, 0.12, 0.55}) {
    const NarrowBand lower =
        makeBox(V3d(2, 2, 1 + top), V3d(0, 0, (top - 1) / 2), h, {.halfWidth = 4});
    const NarrowBand upper = makeBox(V3d(2, 2, 0.95), V3d(0, 0, 0.525), h, {.halfWidth = 4});
    const NarrowBand united = unite(lower, upper);
    const auto have = vdb(united).getConstAccessor();
    for (const openvdb::Coord& c : openvdb::CoordBBox(openvdb::Coord(-14), openvdb::Coord(14))) {
      // The outermost inside layer is beside the surface and keeps the values of min.
      if (std::max({std::abs(c.x()), std::abs(c.y()), std::abs(c.z())}) == 9) continue;
      // At the rim of the inner face four faces share a cell. The approximation has two planes
      // only.
      const bool isAtRim = std::max(std::abs(c.x()), std::abs(c.y())) > 5 && std::abs(c.z()) < 10;
      ASSERT_NEAR(have.getValue(c), want.getValue(c),
                  isAtRim ? support::measured(0.183) * h : support::rounding(1))
          << c << " top " << top;
    }
  }
}

TEST(Csg, TouchingFacesOnGridPointsLeaveNoCrack) {
  const double h = 0.1;
  // Sides on grid points and between them.
  for (const double side : {2.0, 1.92}) {
    const NarrowBand lower = makeBox(V3d(side, side, 1), V3d(0, 0, -0.5), h);
    const NarrowBand upper = makeBox(V3d(side, side, 1), V3d(0, 0, 0.5), h);
    const NarrowBand both = makeBox(V3d(side, side, 2), V3d(0), h);
    const NarrowBand united = unite(lower, upper);
    EXPECT_EQ(united.contentHash(), unite(upper, lower).contentHash());
    EXPECT_EQ(united.activeVoxelCount(), both.activeVoxelCount());
    const auto want = vdb(both).getConstAccessor(), have = vdb(united).getConstAccessor();
    for (const openvdb::Coord& c : openvdb::CoordBBox(openvdb::Coord(-14), openvdb::Coord(14)))
      ASSERT_NEAR(have.getValue(c), want.getValue(c), support::rounding(1))
          << c << " side " << side;
    // Subtracting the touching solid removes nothing.
    const double volume = measure(lower).volume;
    EXPECT_NEAR(measure(subtract(lower, upper)).volume, volume, support::rounding(0.4) * volume);
  }
}

TEST(Csg, CommonFacesLeaveNoSheetAfterSubtraction) {
  // Three, five and one common face, on grid points and between them, rotated too.
  const double h = 0.1;
  for (const double shift : {0.0, 0.037}) {
    const V3d at(shift, shift, shift);
    const NarrowBand whole = makeBox(V3d(2), at, h);
    const NarrowBand half = subtract(whole, makeBox(V3d(1, 2, 2), at + V3d(0.5, 0, 0), h));
    const NarrowBand want = makeBox(V3d(1, 2, 2), at - V3d(0.5, 0, 0), h);
    EXPECT_NEAR(static_cast<double>(half.activeVoxelCount()),
                static_cast<double>(want.activeVoxelCount()), support::measured(116))
        << shift;
    // Between grid points the position of the cut's edge is lost, so that the edge is rounded.
    const double tolerance =
        (shift == 0 ? support::measured(0.0446, 0.06) : support::measured(0.204)) * h;
    const auto exact = vdb(want).getConstAccessor(), have = vdb(half).getConstAccessor();
    for (const openvdb::Coord& c : openvdb::CoordBBox(openvdb::Coord(-14), openvdb::Coord(14)))
      ASSERT_NEAR(have.getValue(c), exact.getValue(c), tolerance) << c << " shift " << shift;

    // A corner: the remaining wall is one piece with a cavity, and has no crack.
    const NarrowBand corner = subtract(whole, makeBox(V3d(1), at + V3d(0.5, 0.5, 0.5), h));
    const Measurement wall = measure(shell(corner, 2 * h, ShellSide::Out));
    EXPECT_EQ(wall.euler, 4) << shift;
    EXPECT_EQ(wall.cavities, 1u) << shift;
    const NarrowBand slot = subtract(whole, makeBox(V3d(1, 1, 2), at + V3d(0.5, 0, 0), h));
    EXPECT_EQ(measure(slot).euler, 2) << shift;
    EXPECT_NEAR(measure(slot).volume, 6, support::measured(0.153, 0.2))
        << shift;  // a grid rounds edges
    EXPECT_TRUE(check(slot).passed()) << shift;
  }
}

TEST(Csg, SpheresThatTouchInAPointStaySeparate) {
  const NarrowBand a = makeSphere(1, V3d(-1, 0, 0), 0.125), b = makeSphere(1, V3d(1, 0, 0), 0.125);
  EXPECT_EQ(vdb(unite(a, b)).tree().getValue(openvdb::Coord(0)), 0);
}

/// d = R: the lens has 5/16 of a sphere's volume, the union 27/16.
void expectVolumesConverge(const std::vector<int>& resolutions) {
  double previous[2] = {0, 0};
  for (const int resolution : resolutions) {
    double error[2] = {0, 0};  // largest over the phases
    for (int i = 0; i < 5; ++i) {
      const V3d shift = V3d(0.17, 0.31, 0.43) * i;
      const NarrowBand a = makeSphere(resolution, shift, 1);
      const NarrowBand b = makeSphere(resolution, shift + V3d(resolution, 0, 0), 1);
      const double ball = 4 * kPi / 3 * std::pow(resolution, 3);
      const double united = measure(unite(a, b)).volume / (ball * 27 / 16) - 1,
                   common = measure(intersect(a, b)).volume / (ball * 5 / 16) - 1;
      error[0] = std::max(error[0], std::abs(united));
      error[1] = std::max(error[1], std::abs(common));
    }
    if (resolution == 32) {
      EXPECT_LT(error[0], support::measured(7.77e-5, 1e-4));
      EXPECT_LT(error[1], support::measured(3.89e-4, 5e-4));
    }
    for (int i = 0; i < 2; ++i) {
      if (previous[i] != 0) {
        EXPECT_GT(std::log2(previous[i] / error[i]), support::measuredOrder(1.91, 1.8));
      }
      previous[i] = error[i];
    }
  }
}

TEST(Csg, VolumesOfTwoSpheresConverge) {
  expectVolumesConverge({32, 64});
}

TEST(SlowCsg, VolumesOfTwoSpheresConverge) {
  expectVolumesConverge({32, 64, 128});
}

/// Expects that signs everywhere, and values beside the surface, agree to the bit.
void expectSameSurface(const NarrowBand& left, const NarrowBand& right) {
  const auto inLeft = vdb(left).getConstAccessor(), inRight = vdb(right).getConstAccessor();
  openvdb::CoordBBox box = vdb(left).evalActiveVoxelBoundingBox();
  box.expand(vdb(right).evalActiveVoxelBoundingBox());
  std::size_t besides = 0;
  for (const openvdb::Coord& c : box) {
    const float value = inLeft.getValue(c);
    ASSERT_EQ(value < 0, inRight.getValue(c) < 0) << c;
    bool beside = false;
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        openvdb::Coord next = c;
        next[axis] += step;
        beside |= (inLeft.getValue(next) < 0) != (value < 0);
      }
    if (!beside) continue;
    ++besides;
    ASSERT_EQ(value, inRight.getValue(c)) << c;
  }
  EXPECT_GT(besides, 0u);
}

TEST(Csg, ObeysTheLawsOfSetAlgebra) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.1), b = makeBox(V3d(1.5), V3d(0.7, 0.3, 0.2), 0.1),
                   c = makeTorus(0.8, 0.3, V3d(0.1), V3d(0, 0, 1), 0.1);
  EXPECT_EQ(unite(a, a).contentHash(), a.contentHash());
  EXPECT_EQ(intersect(a, a).contentHash(), a.contentHash());
  EXPECT_EQ(unite(a, b).contentHash(), unite(b, a).contentHash());
  EXPECT_EQ(intersect(a, b).contentHash(), intersect(b, a).contentHash());
  EXPECT_EQ(combine(CsgOperation::Union, std::array{a, b, c}).band.contentHash(),
            unite(unite(a, b), c).contentHash());
  EXPECT_EQ(combine(CsgOperation::Difference, std::array{a, b, c}).band.contentHash(),
            subtract(subtract(a, b), c).contentHash());
  // De Morgan: a − (b ∪ c) = (a − b) ∩ (a − c) and a − (b ∩ c) = (a − b) ∪ (a − c).
  expectSameSurface(subtract(a, unite(b, c)), intersect(subtract(a, b), subtract(a, c)));
  expectSameSurface(subtract(a, intersect(b, c)), unite(subtract(a, b), subtract(a, c)));
}

TEST(Csg, NestedSolidsAreKeptOrDropped) {
  const NarrowBand outer = makeSphere(1, V3d(0), 0.05), inner = makeSphere(0.5, V3d(0), 0.05);
  EXPECT_EQ(unite(outer, inner).contentHash(), outer.contentHash());
  EXPECT_EQ(intersect(outer, inner).contentHash(), inner.contentHash());
  EXPECT_NEAR(measure(subtract(outer, inner)).volume, 4 * kPi / 3 * (1 - 0.125),
              support::rounding(0.4));
}

TEST(Csg, ResamplesOperandsToTheFinestGrid) {
  const NarrowBand fine = makeSphere(1, V3d(-0.5, 0, 0), 0.05, {.halfWidth = 4});
  const NarrowBand coarse = makeSphere(1, V3d(0.5, 0, 0), 0.1);
  const CsgResult result = combine(CsgOperation::Union, std::array{coarse, fine});
  EXPECT_NEAR(result.band.voxelSize(), 0.05, support::doubleRounding(4));
  EXPECT_NEAR(result.band.halfWidth(), 3, support::rounding(3));
  ASSERT_EQ(result.notes.size(), 2u);
  EXPECT_EQ(result.notes[0],
            "operand 1 was resampled from voxels of 0.1 to the grid of operand 2 with voxels of "
            "0.05");
  EXPECT_EQ(result.notes[1], "operand 2 was narrowed to a half width of 3 voxels");
  const double direct = measure(unite(makeSphere(1, V3d(0.5, 0, 0), 0.05), fine)).volume;
  EXPECT_NEAR(measure(result.band).volume, direct, support::rounding(3) * direct);
  // Different half widths alone do not cause resampling.
  const NarrowBand wide = makeSphere(1, V3d(0), 0.1, {.halfWidth = 5});
  const CsgResult cut = combine(CsgOperation::Union, std::array{wide, coarse});
  EXPECT_EQ(cut.notes,
            std::vector<std::string>{"operand 1 was narrowed to a half width of 3 voxels"});
  EXPECT_TRUE(combine(CsgOperation::Union, std::array{coarse, coarse}).notes.empty());
  EXPECT_EQ(cut.band.contentHash(), unite(makeSphere(1, V3d(0), 0.1), coarse).contentHash());
}

TEST(Csg, IsInvariantUnderMotionAndScale) {
  Imath::M44d matrix;
  matrix.setTranslation(V3d(1 << 20, -(1 << 20), 1 << 20));
  matrix = Imath::M44d().setScale(8) * Imath::M44d().setEulerAngles(V3d(0.3, 0.2, 0.1)) * matrix;
  const NarrowBand a = makeSphere(1, V3d(0), 0.125),
                   b = makeBox(V3d(1.5), V3d(0.7, 0.3, 0.2), 0.125);
  const NarrowBand before = transform(subtract(a, b), matrix);
  const NarrowBand after = subtract(transform(a, matrix), transform(b, matrix));
  ASSERT_EQ(before.activeVoxelCount(), after.activeVoxelCount());
  auto it = vdb(before).cbeginValueOn();
  for (auto other = vdb(after).cbeginValueOn(); other; ++it, ++other) {
    ASSERT_EQ(it.getCoord(), other.getCoord());
    ASSERT_NEAR(*it, *other, support::rounding(3));
  }
}

TEST(Csg, SameBitsForAnyNumberOfThreads) {
  const NarrowBand a = makeSphere(10, V3d(0), 0.25), b = makeBox(V3d(14), V3d(5, 3, 2), 0.25),
                   c = makeTorus(8, 3, V3d(0.1), V3d(0, 1, 1), 0.25);
  std::vector<std::uint64_t> hashes;
  for (const std::size_t threads : {1, 2, 4}) {
    for (const CsgOperation operation : {CsgOperation::Union, CsgOperation::Difference})
      hashes.push_back(support::onThreads(threads, [&] {
        return combine(operation, std::array{a, b, c}).band.contentHash();
      }));
  }
  for (std::size_t i = 2; i < hashes.size(); ++i) EXPECT_EQ(hashes[i], hashes[i % 2]);
}

TEST(Csg, RefusesAnEmptyResult) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.1), apart = makeSphere(1, V3d(5, 0, 0), 0.1);
  EXPECT_THROW((void)intersect(a, apart), InvalidInput);
  EXPECT_THROW((void)subtract(a, a), InvalidInput);
  EXPECT_THROW((void)subtract(makeSphere(0.5, V3d(0), 0.1), a), InvalidInput);
  EXPECT_THROW((void)intersect(a, makeSphere(1, V3d(2, 0, 0), 0.1)), InvalidInput) << "touching";
}

TEST(Csg, RefusesInvalidArguments) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.1);
  EXPECT_THROW((void)combine(CsgOperation::Union, {}), UsageError);
  EXPECT_THROW((void)combine(CsgOperation::Union, std::array{a}), UsageError);
  EXPECT_THROW((void)unite(a, NarrowBand()), InvalidInput);
  EXPECT_THROW((void)combine(CsgOperation::Union, std::array{a, a}, {.maxMemory = 1000}),
               ResourceLimit);
  EXPECT_THROW((void)combine(CsgOperation::Union, std::array{a, a},
                             {.progress = [](double) { return false; }}),
               Cancelled);
  EXPECT_FALSE(shareGrid(a, NarrowBand()));
  EXPECT_TRUE(shareGrid(a, makeBox(V3d(1), V3d(0), 0.1)));
  EXPECT_FALSE(shareGrid(a, makeSphere(1, V3d(0), 0.1, {.halfWidth = 4})));
}

}  // namespace csg_test
