#include "levelset/csg/smooth_csg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"

namespace levelset {
namespace {

using Imath::V3d;

/// An exact distance with its gradient.
struct Distance {
  std::function<double(const V3d&)> value;
  std::function<V3d(const V3d&)> gradient;
};

Distance ball(const V3d& centre, double radius) {
  return {[=](const V3d& p) { return (p - centre).length() - radius; },
          [=](const V3d& p) { return (p - centre).normalized(); }};
}

/// The half space below a plane.
Distance halfSpace(const V3d& point, const V3d& normal) {
  return {[=](const V3d& p) { return (p - point).dot(normal); },
          [=](const V3d&) { return normal; }};
}

Distance negated(const Distance& d) {
  return {[=](const V3d& p) { return -d.value(p); }, [=](const V3d& p) { return -d.gradient(p); }};
}

Distance smoothUnion(const Distance& a, const Distance& b, double k) {
  return {[=](const V3d& p) {
            const double u = a.value(p), v = b.value(p), h = std::max(k - std::abs(u - v), 0.0);
            return std::min(u, v) - h * h / (4 * k);
          },
          [=](const V3d& p) {
            const double u = a.value(p), v = b.value(p), h = std::max(k - std::abs(u - v), 0.0);
            const double weight = (u < v ? 1 - h / (2 * k) : h / (2 * k));
            return a.gradient(p) * weight + b.gradient(p) * (1 - weight);
          }};
}

Distance smoothResult(CsgOperation operation, const Distance& a, const Distance& b, double k) {
  switch (operation) {
    case CsgOperation::Union:
      return smoothUnion(a, b, k);
    case CsgOperation::Intersection:
      return negated(smoothUnion(negated(a), negated(b), k));
    case CsgOperation::Difference:
      return negated(smoothUnion(negated(a), b, k));
  }
  return a;
}

/// Largest distance, in voxels, from the exact surface to the zeros of a band's tricubic
/// interpolant between its grid points, to first order in F / |∇F|; by the side of the band that
/// the zero is found from.
struct SurfaceErrors {
  double inside = 0, outside = 0;
  std::size_t zeros = 0;
  [[nodiscard]] double largest() const { return std::max(inside, outside); }
};
SurfaceErrors surfaceErrors(const NarrowBand& band, const Distance& exact,
                            const std::function<bool(const V3d&)>& compared) {
  const BandSampler phi(band, Interpolation::Tricubic);
  SurfaceErrors errors;
  support::forEachActive(band, [&](const V3d& p, double value) {
    if (std::abs(value) > 1.5 * band.voxelSize()) return;
    V3d q = p;
    for (int i = 0; i < 4; ++i) q -= phi.normal(q) * phi.value(q);
    if (!compared(q)) return;
    ++errors.zeros;
    double& side = value < 0 ? errors.inside : errors.outside;
    side = std::max(side, std::abs(exact.value(q)) / exact.gradient(q).length());
  });
  errors.inside /= band.voxelSize();
  errors.outside /= band.voxelSize();
  return errors;
}

const auto kEverywhereCompared = [](const V3d&) { return true; };
constexpr CsgOperation kOperations[] = {CsgOperation::Union, CsgOperation::Intersection,
                                        CsgOperation::Difference};

SmoothCsgOptions radiusOf(double radius) {
  return {.radius = radius};
}

/// Measured errors at one voxel size, in voxels.
struct Measured {
  double voxelSize, inside, outside;
};

/// The error found is at most 1.5 times the measured one, and the latter is not out of date.
void expectMeasured(double found, double measured) {
  EXPECT_LE(found, 1.5 * measured);
  EXPECT_GE(found, measured / 2);
}

/// Compares blends of two balls with the formula.
/// @param resolutions  of each operation, coarsest first; with three the order is tested
void expectBlendsOfBalls(const std::array<std::size_t, 3>& resolutions) {
  const V3d centreA(0.013, 0.029, 0.017), centreB = centreA + V3d(0.9, 0.3, 0.2);
  const std::vector<std::vector<Measured>> measured = {
      {{0.08, 0.00267, 0.00309}, {0.04, 0.0014, 0.00148}, {0.02, 0.000731, 0.000705}},
      {{0.08, 0.00636, 0.00697}, {0.04, 0.00355, 0.0039}, {0.02, 0.00171, 0.00178}},
      {{0.08, 0.0129, 0.0128}, {0.04, 0.00669, 0.00618}, {0.02, 0.00313, 0.0031}}};
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const CsgOperation operation = kOperations[i];
    const Distance exact = smoothResult(operation, ball(centreA, 1), ball(centreB, 0.8), 0.4);
    std::vector<double> errors;
    for (const Measured& at : std::span(measured[i]).first(resolutions[i])) {
      SCOPED_TRACE("operation " + std::to_string(i) + ", voxel " + std::to_string(at.voxelSize));
      const NarrowBand a = makeSphere(1, centreA, at.voxelSize),
                       b = makeSphere(0.8, centreB, at.voxelSize);
      const NarrowBand made = smoothCombine(operation, a, b, radiusOf(0.4)).band;
      const SurfaceErrors found = surfaceErrors(made, exact, kEverywhereCompared);
      expectMeasured(found.inside, at.inside);
      expectMeasured(found.outside, at.outside);
      errors.push_back(found.largest() * at.voxelSize);
      EXPECT_TRUE(check(made).passed());
    }
    if (errors.size() == 3) {
      EXPECT_GT(std::log2(errors[1] / errors[2]), 1.9);  // measured 2.0 to 2.1
    }
  }
}

TEST(SmoothCsg, BlendsTwoBallsLikeTheFormulaWithSecondOrder) {
  expectBlendsOfBalls({2, 3, 2});
}

TEST(SlowSmoothCsg, BlendsTwoBallsLikeTheFormulaWithSecondOrder) {
  expectBlendsOfBalls({3, 1, 3});
}

/// Compares blends of two planes with the formula.
/// @param resolutions  of union and intersection, coarsest first; with three the order is tested
void expectBlendsOfPlanes(const std::array<std::size_t, 2>& resolutions) {
  const V3d corner(0.011, 0.023, 0.007);
  const Imath::Box3d box(V3d(-0.7), V3d(0.7));
  const double half = 0.785;
  const V3d normalA(std::sin(half), std::cos(half), 0), normalB(std::sin(half), -std::cos(half), 0);
  const Distance a = halfSpace(corner, normalA), b = halfSpace(corner, normalB);
  const std::vector<std::vector<Measured>> measured = {
      {{0.08, 0.00782, 0.00679}, {0.04, 0.00441, 0.00444}, {0.02, 0.00144, 0.00135}},
      {{0.08, 0.00832, 0.00827}, {0.04, 0.0038, 0.00419}, {0.02, 0.00165, 0.00172}}};
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const Distance exact = smoothResult(kOperations[i], a, b, 0.3);
    std::vector<double> errors;
    for (const Measured& at : std::span(measured[i]).first(resolutions[i])) {
      SCOPED_TRACE("operation " + std::to_string(i) + ", voxel " + std::to_string(at.voxelSize));
      const NarrowBand made =
          smoothCombine(kOperations[i], support::sampleBand(a.value, box, at.voxelSize),
                        support::sampleBand(b.value, box, at.voxelSize), radiusOf(0.3))
              .band;
      const SurfaceErrors found =
          surfaceErrors(made, exact, [&](const V3d& p) { return (p - corner).length() < 0.4; });
      expectMeasured(found.inside, at.inside);
      expectMeasured(found.outside, at.outside);
      errors.push_back(found.largest() * at.voxelSize);
    }
    if (errors.size() == 3) {
      EXPECT_GT(std::log2(errors[0] / errors[2]) / 2, 1.9);  // measured 2.1 to 2.2
    }
  }
}

TEST(SmoothCsg, BlendsTwoPlanesLikeTheFormulaWithSecondOrder) {
  expectBlendsOfPlanes({3, 2});
}

TEST(SlowSmoothCsg, BlendsTwoPlanesLikeTheFormulaWithSecondOrder) {
  expectBlendsOfPlanes({1, 3});
}

TEST(SmoothCsg, IsPlainCsgWithoutARadius) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.05), b = makeSphere(0.8, V3d(0.9, 0.3, 0.2), 0.05);
  for (const CsgOperation operation : kOperations) {
    const std::vector<NarrowBand> pair = {a, b};
    EXPECT_EQ(smoothCombine(operation, a, b, radiusOf(0)).band.contentHash(),
              combine(operation, pair).band.contentHash());
  }
}

TEST(SmoothCsg, ChangesNothingWhereDistancesDifferByTheRadius) {
  const V3d centreB(0.9, 0.3, 0.2);
  const Distance first = ball(V3d(0), 1), second = ball(centreB, 0.8);
  const NarrowBand a = makeSphere(1, V3d(0), 0.04), b = makeSphere(0.8, centreB, 0.04);
  const NarrowBand hard = unite(a, b),
                   made = smoothCombine(CsgOperation::Union, a, b, radiusOf(0.3)).band;
  std::size_t equal = 0;
  for (auto it = vdb(made).cbeginValueOn(); it; ++it) {
    const V3d p = toImath(vdb(made).indexToWorld(it.getCoord()));
    // The closest point of the surface is off the blend by less than the width of the band.
    if (std::abs(first.value(p) - second.value(p)) < 0.3 + 4 * 3 * 0.04) continue;
    ++equal;
    EXPECT_EQ(*it, vdb(hard).tree().getValue(it.getCoord())) << p;
  }
  EXPECT_GT(equal, 1000u);
}

TEST(SmoothCsg, IsSymmetric) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.05), b = makeSphere(0.8, V3d(0.9, 0.3, 0.2), 0.05);
  for (const CsgOperation operation : {CsgOperation::Union, CsgOperation::Intersection})
    EXPECT_EQ(smoothCombine(operation, a, b, radiusOf(0.3)).band.contentHash(),
              smoothCombine(operation, b, a, radiusOf(0.3)).band.contentHash());
}

TEST(SmoothCsg, BridgesGapsBelowHalfTheRadiusOnly) {
  for (const bool joins : {true, false}) {
    const double gap = joins ? 0.12 : 0.18, radius = 0.3;
    const NarrowBand a = makeSphere(0.5, V3d(0), 0.02),
                     b = makeSphere(0.5, V3d(1 + gap, 0, 0), 0.02);
    const NarrowBand made = smoothCombine(CsgOperation::Union, a, b, radiusOf(radius)).band;
    EXPECT_EQ(measure(made).components, joins ? 1u : 2u);
  }
}

TEST(SmoothCsg, LeavesSolidsAloneThatAreFarFromEachOther) {
  const NarrowBand large = makeSphere(1, V3d(0), 0.05), inner = makeSphere(0.2, V3d(0), 0.05),
                   far = makeSphere(0.5, V3d(4, 0, 0), 0.05);
  EXPECT_EQ(smoothCombine(CsgOperation::Union, large, inner, radiusOf(0.1)).band.contentHash(),
            unite(large, inner).contentHash());
  EXPECT_EQ(smoothCombine(CsgOperation::Union, large, far, radiusOf(0.1)).band.contentHash(),
            unite(large, far).contentHash());
  EXPECT_EQ(smoothCombine(CsgOperation::Difference, large, inner, radiusOf(0.1)).band.contentHash(),
            subtract(large, inner).contentHash());
}

TEST(SmoothCsg, ResamplesTheCoarserOperandAndSaysSo) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.04), b = makeSphere(0.8, V3d(0.9, 0.3, 0.2), 0.06);
  const CsgResult made = smoothCombine(CsgOperation::Union, a, b, radiusOf(0.3));
  EXPECT_TRUE(shareGrid(made.band, a));
  ASSERT_FALSE(made.notes.empty());
  EXPECT_NE(made.notes[0].find("the second operand was resampled"), std::string::npos);
}

TEST(SmoothCsg, RefusesWhatItCannotUse) {
  const NarrowBand a = makeSphere(1, V3d(0), 0.1), b = makeSphere(0.3, V3d(1.2, 0, 0), 0.1);
  for (const double radius : {-1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW((void)smoothCombine(CsgOperation::Union, a, b, radiusOf(radius)), UsageError);
  EXPECT_THROW((void)smoothCombine(CsgOperation::Union, a, NarrowBand(), radiusOf(0.1)),
               InvalidInput);
  // The smooth intersection of a thin lens is empty: it loses a quarter of the radius.
  EXPECT_THROW((void)smoothCombine(CsgOperation::Intersection, a, b, radiusOf(3)), InvalidInput);
}

}  // namespace
}  // namespace levelset
