#include "levelset/inspect/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace compare_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;

NarrowBand ball(double radius, const V3d& centre, double voxelSize, double halfWidth = 3) {
  return support::sampleBand([=](const V3d& p) { return (p - centre).length() - radius; },
                             {centre - V3d(radius), centre + V3d(radius)}, voxelSize, halfWidth);
}

NarrowBand block(const V3d& half, const V3d& centre, double voxelSize) {
  return support::sampleBand(
      [=](const V3d& p) {
        const V3d q(std::abs(p.x - centre.x) - half.x, std::abs(p.y - centre.y) - half.y,
                    std::abs(p.z - centre.z) - half.z);
        const V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
        return outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.);
      },
      {centre - half, centre + half}, voxelSize);
}

TEST(Compare, FindsNoDifferenceBetweenEquals) {
  const NarrowBand a = ball(12, V3d(0.3, 0.1, -0.2), 1);
  const Comparison c = compare(a, a);
  EXPECT_LT(c.hausdorff(), support::rounding(1));
  EXPECT_LT(c.chamfer(), support::rounding(0.3));
  EXPECT_LT(c.symmetricDifference, support::measured(2.8e-14));
}

TEST(Compare, FindsNoDifferenceBetweenEqualsWithEdges) {
  for (const V3d& centre : {V3d(0), V3d(0.31, -0.17, 0.43)}) {
    const NarrowBand cube = block(V3d(10), centre, 1);
    NarrowBand turned = transform(cube, Imath::M44d().setEulerAngles(V3d(0.3, 0.5, 0.7)));
    turned = resample(turned, 1);
    for (const NarrowBand& solid : {cube, turned}) {
      const Comparison c = compare(solid, solid);
      EXPECT_LT(c.hausdorff(), support::rounding(8));
      EXPECT_LT(c.chamfer(), support::rounding(0.4));
    }
  }
}

TEST(Compare, MeasuresConcentricSpheres) {
  for (const double gap : {0.01, 0.4, 6.0}) {
    const Comparison c = compare(ball(20, V3d(0.2), 1), ball(20 + gap, V3d(0.2), 1));
    for (const double found : {c.hausdorffAtoB, c.hausdorffBtoA, c.meanAtoB, c.meanBtoA})
      EXPECT_NEAR(found, gap, support::measured(2.15e-4));
    const double exact = 4 * pi / 3 * (std::pow(20 + gap, 3) - 8000);
    EXPECT_NEAR(c.symmetricDifference, exact, support::measured(3.6e-4) * exact);
  }
}

TEST(Compare, MeasuresShiftedSpheresOnDifferentGrids) {
  // ∫
  // ‖R n + d‖ − R
  //  over a sphere is R² − …. Both Hausdorff distances equal the shift.
  const double radius = 10, shift = 2.5;
  const NarrowBand a = ball(radius, V3d(0), 0.5);
  for (const double voxelSize : {0.5, 0.4, 0.8}) {
    const Comparison c = compare(a, ball(radius, V3d(shift, 0, 0), voxelSize));
    EXPECT_NEAR(c.hausdorffAtoB, shift, support::measured(5.59e-4));
    EXPECT_NEAR(c.hausdorffBtoA, shift, support::measured(0.00145));
    // Both means:
    // √(R² + s² − 2 R s u) − R
    //  for u uniform in [−1, 1], by substitution.
    const auto part = [&](double u) {
      const double r = std::sqrt(radius * radius + shift * shift - 2 * radius * shift * u);
      return -(r * r * r / 3 - radius * r * r / 2) / (radius * shift);
    };
    const double middle = shift / (2 * radius);  // position at which r = R
    const double mean = (part(middle) - part(-1) - (part(1) - part(middle))) / 2;
    EXPECT_NEAR(c.meanAtoB, mean, support::measured(9.35e-5));
    EXPECT_NEAR(c.meanBtoA, mean, support::measured(2.79e-4));
    const double lens =
        pi * std::pow(2 * radius - shift, 2) * (shift * shift + 4 * shift * radius) / (12 * shift);
    const double exact = 2 * (4 * pi / 3 * std::pow(radius, 3) - lens);
    EXPECT_NEAR(c.symmetricDifference, exact, support::measured(8.45e-4) * exact);
  }
}

TEST(Compare, DistinguishesTheTwoDirections) {
  // A box, and the same box with a spike on top. All of the first box is near the second solid.
  const NarrowBand a = block(V3d(10), V3d(0), 0.5), b = block(V3d(10, 10, 14), V3d(0, 0, 4), 0.5);
  const Comparison c = compare(a, b);
  // From the first box's top, inside the second solid, to the walls or the top of the spike.
  EXPECT_NEAR(c.hausdorffAtoB, 8, support::rounding(8));
  EXPECT_NEAR(c.hausdorffBtoA, 8, support::rounding(8));
  EXPECT_NEAR(c.symmetricDifference, 8 * 20 * 20, support::measured(6.25e-4) * 8 * 20 * 20);
  const NarrowBand small = ball(1.5, V3d(20, 0, 0), 0.5);
  const Comparison apart = compare(a, small);
  EXPECT_NEAR(apart.hausdorffBtoA, 11.5,
              support::measured(0.0209));  // measured between two samples of a small ball
  EXPECT_NEAR(apart.hausdorffAtoB, V3d(30, 10, 10).length() - 1.5, support::measured(0.39));
  EXPECT_NEAR(apart.symmetricDifference, 8000 + 4 * pi / 3 * 3.375,
              support::measured(0.00194, 0.002) * 8000);
}

TEST(Compare, HoldsInNarrowBands) {
  const Comparison c = compare(ball(15, V3d(0.1), 1, 1), ball(15.5, V3d(0.1), 1, 1.5));
  EXPECT_NEAR(c.hausdorffAtoB, 0.5, support::measured(0.00388));
  EXPECT_NEAR(c.hausdorffBtoA, 0.5, support::measured(0.00384));
}

TEST(Compare, Refuses) {
  const NarrowBand a = ball(5, V3d(0), 1);
  EXPECT_THROW((void)compare(a, NarrowBand()), InvalidInput);
  EXPECT_THROW((void)compare(NarrowBand(), a), InvalidInput);
  auto outside = emptyLevelSet(uniformTransform(1), 3);
  outside->tree().setValueOn(openvdb::Coord(0), 1.f);
  EXPECT_THROW((void)compare(a, makeBand(outside)), InvalidInput);
  EXPECT_THROW((void)compare(a, a, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace compare_test
