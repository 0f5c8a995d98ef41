#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include "levelset/volumes/filters/filtered_volume.h"
#include "tests/support/measured.h"
#include "tests/support/volumes.h"

namespace volume_filter_test {

using Imath::V3d;
using Imath::V3i;
using levelset::factsOf;
using levelset::FilteredVolume;
using levelset::kVolumeFilters;
using levelset::Volume;
using levelset::VolumeDerivatives;
using levelset::VolumeFilter;
using levelset::VolumeFilterFacts;
using levelset::VolumeGrid;
using support::measured;
using support::measuredOrder;
using support::sampled;

Volume noise(const V3i& size) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return sampled({size, {}}, [&](const V3d&) { return uniform(random); });
}

/// Largest differences of values, gradients and second derivatives.
struct Difference {
  std::array<double, 3> of{};

  void add(const VolumeDerivatives& a, const VolumeDerivatives& b) {
    of[0] = std::max(of[0], std::abs(a.value - b.value));
    of[1] = std::max(of[1], (a.gradient - b.gradient).length());
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        of[2] = std::max(of[2], std::abs(a.hessian[r][c] - b.hessian[r][c]));
  }
};

/// Polynomial with whole coefficients, so that its samples at whole numbers have no rounding.
struct Polynomial {
  struct Term {
    int factor;
    V3i power;
  };
  std::vector<Term> terms;

  /// All terms of a total degree up to `degree`.
  explicit Polynomial(int degree) {
    int n = 0;
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; a + b <= degree; ++b)
        for (int c = 0; a + b + c <= degree; ++c) terms.push_back({++n % 5 - 7, V3i(a, b, c)});
  }

  [[nodiscard]] static double factor(int power, double x, int order) {
    double product = 1;
    for (int n = 0; n < order; ++n) product *= power - n;
    return product == 0 ? 0 : product * std::pow(x, power - order);
  }
  [[nodiscard]] double derivative(const V3d& p, const V3i& order) const {
    double sum = 0;
    for (const Term& t : terms)
      sum += t.factor * factor(t.power.x, p.x, order.x) * factor(t.power.y, p.y, order.y) *
             factor(t.power.z, p.z, order.z);
    return sum;
  }
  [[nodiscard]] VolumeDerivatives at(const V3d& p) const {
    VolumeDerivatives d;
    d.value = derivative(p, V3i(0));
    for (int r = 0; r < 3; ++r) {
      V3i one(0);
      ++one[r];
      d.gradient[r] = derivative(p, one);
      for (int c = 0; c < 3; ++c) {
        V3i two = one;
        ++two[c];
        d.hessian[r][c] = derivative(p, two);
      }
    }
    return d;
  }
};

/// Differences from a polynomial at random points, `margin` spacings from the border.
Difference fromPolynomial(VolumeFilter filter, int degree, double margin) {
  const Polynomial polynomial(degree);
  const V3i size(9, 8, 7);
  const FilteredVolume f(
      sampled({size, {}}, [&](const V3d& p) { return polynomial.derivative(p, V3i(0)); }), filter);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  Difference found;
  for (int n = 0; n < 300; ++n) {
    V3d p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = margin + (size[axis] - 1 - 2 * margin) * uniform(random);
    found.add(f.derivatives(p), polynomial.at(p));
  }
  return found;
}

TEST(VolumeFilter, ReproducesPolynomialsOfItsDegreeAndNoMore) {
  for (const VolumeFilter filter : kVolumeFilters) {
    const VolumeFilterFacts& facts = factsOf(filter);
    SCOPED_TRACE(facts.name);
    // The border rule is a parabola, so that cubics are kept two cells from the border only.
    const Difference kept = fromPolynomial(filter, facts.reproduced, facts.reproduced > 2 ? 2 : 0);
    const Difference lost = fromPolynomial(filter, facts.reproduced + 1, 2);
    for (std::size_t order = 0; order < 3; ++order) EXPECT_LT(kept.of[order], 1e-10) << order;
    EXPECT_GT(lost.of[0], 0.01);
  }
}

TEST(VolumeFilter, SmoothingSplinesKeepGradientsOfQuadratics) {
  for (const VolumeFilter filter : {VolumeFilter::BSpline, VolumeFilter::SuperQuadratic,
                                    VolumeFilter::CubicC1, VolumeFilter::BccQuadratic}) {
    SCOPED_TRACE(factsOf(filter).name);
    const Difference found = fromPolynomial(filter, 2, 0);
    EXPECT_LT(found.of[1], 1e-10);
    EXPECT_LT(found.of[2], 1e-10);
  }
}

TEST(VolumeFilter, DerivativesAreThoseOfTheValue) {
  const Volume volume = noise(V3i(7, 6, 5));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  for (const VolumeFilter filter : kVolumeFilters) {
    SCOPED_TRACE(factsOf(filter).name);
    const FilteredVolume f(volume, filter);
    double gradient = 0, hessian = 0;
    for (int n = 0; n < 300; ++n) {
      const V3d p(6 * uniform(random), 5 * uniform(random), 4 * uniform(random));
      const VolumeDerivatives at = f.derivatives(p);
      EXPECT_NEAR(at.value, f.value(p), 1e-14);
      constexpr double kStep = 1e-6;
      for (int axis = 0; axis < 3; ++axis) {
        V3d step(0);
        step[axis] = kStep;
        const VolumeDerivatives above = f.derivatives(p + step), below = f.derivatives(p - step);
        gradient = std::max(
            gradient, std::abs((above.value - below.value) / (2 * kStep) - at.gradient[axis]));
        const V3d slope = (above.gradient - below.gradient) / (2 * kStep);
        for (int other = 0; other < 3; ++other)
          hessian = std::max(hessian, std::abs(slope[other] - at.hessian[axis][other]));
      }
    }
    EXPECT_LT(gradient, 1e-8);
    EXPECT_LT(hessian, 1e-8);
  }
}

TEST(VolumeFilter, DerivativesAreContinuousUpToTheStatedOrder) {
  const Volume volume = noise(V3i(6));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 5);
  constexpr int kSteps = 4000;
  for (const VolumeFilter filter : kVolumeFilters) {
    SCOPED_TRACE(factsOf(filter).name);
    const FilteredVolume f(volume, filter);
    Difference jump;
    for (int line = 0; line < 6; ++line) {
      const V3d from(uniform(random), uniform(random), uniform(random)),
          to(uniform(random), uniform(random), uniform(random));
      VolumeDerivatives last = f.derivatives(from);
      for (int n = 1; n <= kSteps; ++n) {
        const VolumeDerivatives next = f.derivatives(from + (to - from) * n / kSteps);
        jump.add(next, last);
        last = next;
      }
    }
    for (int order = 0; order < 3; ++order) {
      const double found = jump.of[static_cast<std::size_t>(order)];
      if (order <= factsOf(filter).continuity) {
        EXPECT_LT(found, 0.03) << order;
      } else if (order == factsOf(filter).continuity + 1) {
        EXPECT_GT(found, 0.1) << order;
      }
    }
  }
}

double wave(const V3d& p) {
  return std::sin(p.x + 0.3) * std::cos(p.y - 0.2) + std::exp(0.5 * p.z) * std::sin(p.x + p.y);
}

VolumeDerivatives waveDerivatives(const V3d& p) {
  const double sx = std::sin(p.x + 0.3), cx = std::cos(p.x + 0.3), sy = std::sin(p.y - 0.2),
               cy = std::cos(p.y - 0.2), e = std::exp(0.5 * p.z), s = std::sin(p.x + p.y),
               c = std::cos(p.x + p.y);
  VolumeDerivatives d;
  d.value = sx * cy + e * s;
  d.gradient = V3d(cx * cy + e * c, -sx * sy + e * c, 0.5 * e * s);
  d.hessian = Imath::M33d(-sx * cy - e * s, -cx * sy - e * s, 0.5 * e * c,  //
                          -cx * sy - e * s, -sx * cy - e * s, 0.5 * e * c,  //
                          0.5 * e * c, 0.5 * e * c, 0.25 * e * s);
  return d;
}

/// Errors on the cube [0, 2]³ with n cells along each side. @param margin  distance of the points
/// from the border, world units
Difference waveError(VolumeFilter filter, int n, double margin) {
  VolumeGrid grid;
  grid.size = V3i(n + 1);
  for (int axis = 0; axis < 3; ++axis) grid.indexToWorld[axis][axis] = 2.0 / n;
  const FilteredVolume f(sampled(grid, [&](const V3d& p) { return wave(p); }), filter);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(margin, 2 - margin);
  Difference found;
  for (int at = 0; at < 6000; ++at) {
    const V3d p(uniform(random), uniform(random), uniform(random));
    found.add(f.worldDerivatives(p), waveDerivatives(p));
  }
  return found;
}

TEST(VolumeFilter, ErrorsHaveTheStatedOrders) {
  for (const VolumeFilter filter : kVolumeFilters) {
    const VolumeFilterFacts& facts = factsOf(filter);
    SCOPED_TRACE(facts.name);
    const std::array<int, 3> stated = {facts.valueOrder, facts.gradientOrder, facts.hessianOrder};
    const std::array<Difference, 3> errors = {
        waveError(filter, 8, 0.55), waveError(filter, 16, 0.55), waveError(filter, 32, 0.55)};
    for (std::size_t order = 0; order < 3; ++order) {
      for (std::size_t n = 0; n < 2; ++n) {
        const double found = std::log2(errors[n].of[order] / errors[n + 1].of[order]);
        EXPECT_GT(found, stated[order] - 0.3) << order;
        if (n == 1) {
          EXPECT_LT(found, stated[order] + 0.3) << order;
        }
      }
    }
  }
}

TEST(VolumeFilter, ErrorsAtTheBorderKeepTheSecondOrder) {
  for (const VolumeFilter filter : kVolumeFilters) {
    const VolumeFilterFacts& facts = factsOf(filter);
    SCOPED_TRACE(facts.name);
    const Difference coarse = waveError(filter, 16, 0), fine = waveError(filter, 32, 0);
    EXPECT_GE(std::log2(coarse.of[0] / fine.of[0]), measuredOrder(std::min(facts.valueOrder, 3)));
    EXPECT_GE(std::log2(coarse.of[1] / fine.of[1]),
              measuredOrder(std::min(facts.gradientOrder, 2)));
  }
}

TEST(VolumeFilter, InterpolatesWhereStated) {
  const Volume volume = noise(V3i(5, 4, 6));
  for (const VolumeFilter filter : kVolumeFilters) {
    SCOPED_TRACE(factsOf(filter).name);
    const FilteredVolume f(volume, filter);
    double worst = 0;
    for (int k = 0; k < 6; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 5; ++i)
          worst = std::max(worst, std::abs(f.value(V3d(i, j, k)) - volume.at(i, j, k)));
    EXPECT_EQ(worst < 1e-15, factsOf(filter).interpolates) << worst;
    EXPECT_TRUE(worst < 1e-15 || worst > 0.01) << worst;
  }
}

TEST(VolumeFilter, BSplineQiHasTheSamplesLessASixthOfTheirLaplacianAsCoefficients) {
  // The B-spline of the corrected samples, which are rounded to single precision.
  const Volume volume = noise(V3i(12));
  const Volume corrected = sampled({V3i(12), {}}, [&](const V3d& p) {
    const V3i at(p);
    for (int axis = 0; axis < 3; ++axis)
      if (at[axis] == 0 || at[axis] == 11) return 0.0;
    const auto value = [&](int i, int j, int k) { return volume.at(at.x + i, at.y + j, at.z + k); };
    const double sum = value(-1, 0, 0) + value(1, 0, 0) + value(0, -1, 0) + value(0, 1, 0) +
                       value(0, 0, -1) + value(0, 0, 1);
    return value(0, 0, 0) - (sum - 6 * value(0, 0, 0)) / 6;
  });
  const FilteredVolume ours(volume, VolumeFilter::BSplineQi),
      spline(corrected, VolumeFilter::BSpline);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(2, 9);
  Difference worst;
  for (int n = 0; n < 500; ++n) {
    const V3d at(inside(random), inside(random), inside(random));
    worst.add(ours.derivatives(at), spline.derivatives(at));
    EXPECT_NEAR(ours.value(at), ours.derivatives(at).value, support::doubleRounding(8));
  }
  EXPECT_LE(worst.of[0], support::rounding(2));
  EXPECT_LE(worst.of[1], support::rounding(4));
  EXPECT_LE(worst.of[2], support::rounding(8));
}

TEST(VolumeFilter, TrilinearIsThatOfTheVolume) {
  const Volume volume = noise(V3i(5, 4, 6));
  const FilteredVolume f(volume, VolumeFilter::Trilinear);
  for (const V3d& p : {V3d(0), V3d(0.25, 1.5, 3.75), V3d(4, 3, 5), V3d(-1, 9, 2.5)})
    EXPECT_NEAR(f.value(p), volume.trilinear(p), 1e-15);
}

TEST(VolumeFilter, WorldDerivativesFollowAnObliqueMap) {
  // Catmull-Rom splines keep quadratic polynomials in any frame.
  VolumeGrid grid;
  grid.size = V3i(8);
  Imath::M44d turn, shear;
  turn.rotate(V3d(0.3, -0.5, 0.7));
  shear[1][0] = 0.25;
  grid.indexToWorld[0][0] = 0.5;
  grid.indexToWorld[2][2] = 2;
  grid.indexToWorld = grid.indexToWorld * shear * turn;
  grid.indexToWorld[3][1] = 3;
  const auto quadratic = [](const V3d& p) {
    return 1 + p.x - 2 * p.y + p.x * p.y + 0.5 * p.z * p.z;
  };
  const FilteredVolume f(sampled(grid, [&](const V3d& p) { return quadratic(p); }),
                         VolumeFilter::Tricubic);
  const V3d at = V3d(2.3, 4.1, 6.6) * grid.indexToWorld;
  const VolumeDerivatives found = f.worldDerivatives(at);
  // The samples are rounded to single precision.
  EXPECT_NEAR(found.value, quadratic(at), 1e-4);
  EXPECT_LT((found.gradient - V3d(1 + at.y, -2 + at.x, at.z)).length(), 1e-4);
  EXPECT_NEAR(found.hessian[0][1], 1, 1e-4);
  EXPECT_NEAR(found.hessian[2][2], 1, 1e-4);
  EXPECT_NEAR(found.hessian[0][0], 0, 1e-4);
}

TEST(VolumeFilter, WorksOnSmallGridsAndAnyPosition) {
  for (const VolumeFilter filter : kVolumeFilters)
    for (const V3i& size : {V3i(1), V3i(2), V3i(1, 2, 3)}) {
      SCOPED_TRACE(factsOf(filter).name);
      const FilteredVolume f(sampled({size, {}}, [](const V3d&) { return 2.5; }), filter);
      for (const V3d& p : {V3d(0), V3d(0.5, 0.7, 1.2), V3d(-1e30, 1e30, 4), V3d(NAN, 0, 0)}) {
        const VolumeDerivatives at = f.derivatives(p);
        EXPECT_NEAR(at.value, 2.5, 1e-14);
        EXPECT_LT(at.gradient.length(), 1e-13);
      }
    }
}

TEST(VolumeFilter, RescalesStoredNumbers) {
  const auto owner = std::make_shared<std::vector<std::uint8_t>>();
  for (int n = 0; n < 125; ++n) owner->push_back(static_cast<std::uint8_t>(n * 7 % 31));
  const auto volumeOf = [&](const levelset::VolumeScale& scale) {
    return Volume({V3i(5), {}}, levelset::VolumeType::U8, scale,
                  {owner, reinterpret_cast<const char*>(owner->data()), false});
  };
  for (const VolumeFilter filter : kVolumeFilters) {
    SCOPED_TRACE(factsOf(filter).name);
    const V3d at(1.3, 2.6, 3.2);
    const VolumeDerivatives plain = FilteredVolume(volumeOf({}), filter).derivatives(at),
                            scaled = FilteredVolume(volumeOf({-2, 100}), filter).derivatives(at);
    EXPECT_NEAR(scaled.value, 100 - 2 * plain.value, 1e-12);
    EXPECT_LT((scaled.gradient + plain.gradient * 2).length(), 1e-12);
    EXPECT_NEAR(scaled.hessian[0][1], -2 * plain.hessian[0][1], 1e-12);
  }
}

TEST(VolumeFilter, IsFoundByName) {
  for (const VolumeFilter filter : kVolumeFilters)
    EXPECT_EQ(levelset::volumeFilterNamed(factsOf(filter).name), filter);
  EXPECT_FALSE(levelset::volumeFilterNamed("cubic"));
}

}  // namespace volume_filter_test
