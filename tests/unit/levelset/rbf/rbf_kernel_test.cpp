#include "levelset/rbf/sums/rbf_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "levelset/rbf/sums/rbf_adders.h"
#include "levelset/rbf/sums/rbf_sum.h"
#include "tests/support/clouds.h"
#include "tests/support/measured.h"

namespace rbf_kernel_test {

using Imath::V3d;
using levelset::rbf::RbfKernel;
using levelset::rbf::withKernel;

class Kernel : public ::testing::TestWithParam<RbfKernel> {
 protected:
  static double value(double r) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::value(r); });
  }
  static double slope(double r) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::slope(r); });
  }
  static double sixth(double d) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::sixth(d); });
  }
  static double slopeBound(double lo, double hi) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::slopeBound(lo, hi); });
  }
  static double bendBound(double lo, double hi) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::bendBound(lo, hi); });
  }
  static double farBound(double d) {
    return withKernel(GetParam(), [&](auto k) { return decltype(k)::farBound(d); });
  }
};

INSTANTIATE_TEST_SUITE_P(All, Kernel, ::testing::ValuesIn(support::kKernels),
                         ::testing::PrintToStringParamName());

// Σ a_i a_j φ has one sign for weights that are orthogonal to the linear polynomials. λ is added to
// this quadratic form.
TEST_P(Kernel, IsConditionallyDefiniteWithItsSign) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double sign = withKernel(GetParam(), [](auto k) { return decltype(k)::kSign; });
  for (const double size : {0.3, 2.0, 9.0})
    for (int trial = 0; trial < 20; ++trial) {
      std::array<V3d, 5> p;
      for (V3d& q : p) q = V3d(unit(random), unit(random), unit(random)) * size;
      // Five points in space have one linear relation: the barycentric coordinates of the last
      // point.
      const V3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0], d = p[4] - p[0];
      const double volume = a.dot(b.cross(c));
      const double x = d.dot(b.cross(c)) / volume, y = a.dot(d.cross(c)) / volume,
                   z = a.dot(b.cross(d)) / volume;
      const std::array<double, 5> weight = {1 - x - y - z, x, y, z, -1};
      double sum = 0;
      for (std::size_t i = 0; i < 5; ++i)
        for (std::size_t j = 0; j < 5; ++j)
          sum += weight[i] * weight[j] * value((p[i] - p[j]).length());
      EXPECT_GT(sign * sum, 0) << size;
    }
}

TEST_P(Kernel, SlopeIsTheDerivative) {
  for (double r = 0.003; r < 30; r *= 1.7) {
    const double step = 1e-4 * r;
    const double expected = (value(r + step) - value(r - step)) / (2 * step);
    EXPECT_NEAR(slope(r), expected,
                support::measured(2.15e-7) * (std::abs(expected) + slopeBound(r, r)) + 1e-11)
        << r;
  }
  EXPECT_EQ(slope(0), GetParam() == RbfKernel::Biharmonic ? 1 : 0);
}

TEST_P(Kernel, BoundsHold) {
  for (double lo = 0.004; lo < 20; lo *= 1.6)
    for (const double ratio : {1.001, 1.5, 6.0}) {
      const double hi = lo * ratio;
      for (int i = 0; i <= 20; ++i) {
        const double r = lo + (hi - lo) * i / 20, step = 1e-5 * r;
        EXPECT_LE(std::abs(slope(r)), slopeBound(lo, hi) * (1 + 1e-9)) << lo << " " << hi;
        EXPECT_LE(std::abs(slope(r)), slopeBound(0, hi) * (1 + 1e-9)) << hi;
        const double second = (slope(r + step) - slope(r - step)) / (2 * step);
        const double bend = std::max(std::abs(second), std::abs(slope(r) / r));
        EXPECT_LE(bend, bendBound(lo, hi) * (1 + 1e-5) + 1e-9) << lo << " " << hi;
        EXPECT_LE(std::abs(value(r)), farBound(lo) * (1 + 1e-12));
      }
    }
}

/// Along a line, the divided difference of seven values equals f⁽⁶⁾/6! at a position between them.
TEST_P(Kernel, SixthDerivativeIsBounded) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  double closest = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const double across = 0.5 + 6 * unit(random), from = 4 * unit(random) - 2,
                 step = 0.03 + 0.1 * unit(random);
    std::array<double, 7> difference;
    double nearest = HUGE_VAL;
    for (int i = 0; i < 7; ++i) {
      const double t = from + i * step;
      difference[static_cast<std::size_t>(i)] = value(std::hypot(across, t));
      nearest = std::min(nearest, std::hypot(across, t));
    }
    if (from < 0 && from + 6 * step > 0) nearest = across;
    for (int order = 1; order < 7; ++order)
      for (std::size_t i = 0; i + static_cast<std::size_t>(order) < 7; ++i)
        difference[i] = (difference[i + 1] - difference[i]) / (order * step);
    const double rounding = 1e-14 * (1 + std::abs(value(9))) / std::pow(step, 6);
    EXPECT_LE(std::abs(difference[0]), sixth(nearest) + rounding) << across << " " << from;
    if (rounding < 0.01 * sixth(nearest))
      closest = std::max(closest, std::abs(difference[0]) / sixth(nearest));
  }
  // Sharp for the homogeneous kernels, far from sharp for the sums of exponentials.
  // The derivatives of a compact kernel jump at its support radius.
  const bool isSharp = GetParam() != RbfKernel::Laplacian && GetParam() != RbfKernel::Gaussian;
  if (levelset::rbf::isCompact(GetParam())) {
    EXPECT_EQ(sixth(1), 0);
    EXPECT_EQ(sixth(0.999), HUGE_VAL);
  } else {
    EXPECT_GT(closest, isSharp ? 0.8 : 0);
  }
}

TEST_P(Kernel, VectorCodeAgreesWithScalarCode) {
  const std::vector<levelset::rbf::RbfParticle> particle = {{V3d(0), V3d(1, -2, 0.5)}};
  const std::vector<std::uint32_t> chosen = {0};
  std::vector<double> radii = {0, 1e-140, 1e-20, 1, std::sqrt(0.5), 25, 400};
  for (double r = 1e-9; r < 1e5; r *= 1.0137) radii.push_back(r);
  for (const levelset::rbf::RbfAdders& adders : levelset::rbf::supportedRbfAdders()) {
    SCOPED_TRACE(adders.name);
    levelset::rbf::RbfPoints points(radii.size());
    for (std::size_t i = 0; i < radii.size(); ++i) points.z[i] = radii[i];
    addRbfSums(adders, GetParam(), particle, chosen, points);
    for (std::size_t i = 0; i < radii.size(); ++i) {
      const double r = radii[i], expected = value(r);
      const double size = std::abs(expected) + std::min(1.0, r * r);
      EXPECT_NEAR(points.u[i], expected, support::doubleRounding(3) * size) << r;
      EXPECT_EQ(points.v[i], -2 * points.u[i]);
      EXPECT_EQ(points.w[i], 0.5 * points.u[i]);
    }
  }
}

// Sums of many particles, near and far, with counts of points that are no multiple of a vector or a
// tile.
TEST_P(Kernel, EveryInstructionSetGivesTheSameBits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto place = [&] { return V3d(unit(random), unit(random), unit(random)); };
  std::vector<levelset::rbf::RbfParticle> particles;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t n = 0; n < 200; ++n) {
    particles.push_back({place() * std::pow(10, 3 * unit(random)), place()});
    if (n % 3 != 0) chosen.push_back(n);
  }
  std::shuffle(chosen.begin(), chosen.end(), random);
  for (const std::size_t count : {1, 2, 3, 5, 7, 64, 1021}) {
    levelset::rbf::RbfPoints start(count);
    for (std::size_t i = 0; i < count; ++i) {
      const V3d x = i % 17 == 4 ? particles[i % 200].position : place() * 10;
      start.x[i] = x.x, start.y[i] = x.y, start.z[i] = x.z;
      start.u[i] = unit(random), start.v[i] = unit(random), start.w[i] = unit(random);
    }
    const auto bitsOf = [](const levelset::rbf::RbfPoints& points) {
      std::vector<std::uint64_t> bits;
      for (const auto* numbers : {&points.u, &points.v, &points.w})
        for (const double number : *numbers) bits.push_back(std::bit_cast<std::uint64_t>(number));
      return bits;
    };
    const auto by = [&](const levelset::rbf::RbfAdders& adders) {
      levelset::rbf::RbfPoints points = start;
      addRbfSums(adders, GetParam(), particles, chosen, points);
      return bitsOf(points);
    };
    const std::vector<std::uint64_t> plain = by(levelset::rbf::supportedRbfAdders().front());
    if (count > 4) {  // the fifth point lies on a particle
      ASSERT_NE(plain, bitsOf(start));
    }
    for (const levelset::rbf::RbfAdders& adders : levelset::rbf::supportedRbfAdders())
      EXPECT_EQ(by(adders), plain) << adders.name << " at " << count;
    levelset::rbf::RbfPoints chosenItself = start;
    addRbfSums(GetParam(), particles, chosen, chosenItself);
    EXPECT_EQ(bitsOf(chosenItself), plain) << count;
  }
}

TEST(RbfAdders, IncludeEveryInstructionSetOfTheProcessor) {
  std::vector<std::string> expected = {"plain"};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) expected.emplace_back("avx2");
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    expected.emplace_back("avx512");
#endif
  std::vector<std::string> found;
  for (const levelset::rbf::RbfAdders& adders : levelset::rbf::supportedRbfAdders())
    found.emplace_back(adders.name);
  EXPECT_EQ(found, expected);
}

// The limit at 0, where the closed form cannot be evaluated, and the far field of a point charge.
TEST(LaplacianKernel, HasItsLimits) {
  using levelset::rbf::kernels::kLaplacian;
  using levelset::rbf::kernels::Laplacian;
  constexpr double kDelta = 5;
  EXPECT_NEAR(1 / (4 * M_PI * kDelta * kDelta * kLaplacian.scale), 0.014529, support::rounding(3));
  EXPECT_NEAR(kLaplacian.fast * kLaplacian.fast, 2474.74, support::measured(0.00487));
  EXPECT_NEAR(kLaplacian.slow * kLaplacian.slow, 25.26, support::measured(0.00487));
  EXPECT_NEAR(Laplacian::value(0), 1, support::doubleRounding(4));
  EXPECT_NEAR(Laplacian::value(1e-7), 1, support::measured(4.17e-13));
  EXPECT_NEAR(Laplacian::value(50), kLaplacian.scale / 50, support::doubleRounding(1));
  EXPECT_NEAR((1 - Laplacian::value(1e-4)) * 2e8, kLaplacian.bendAtZero,
              support::measured(0.00137) * kLaplacian.bendAtZero);
}

}  // namespace rbf_kernel_test
