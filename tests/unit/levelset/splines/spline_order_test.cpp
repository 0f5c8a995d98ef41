#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/error.h"
#include "levelset/splines/bcc_quadratic_spline.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/grid_extension.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "tests/support/measured.h"
#include "tests/support/rational.h"

namespace spline_order_test {

using namespace levelset;
using support::Rational;

using Point = std::array<double, 3>;

/// Smooth function with its derivatives: sin(2x + y) cos(3z − x + 1).
struct Wave {
  static double value(const Point& p) {
    return std::sin(2 * p[0] + p[1]) * std::cos(3 * p[2] - p[0] + 1);
  }
  static Point gradient(const Point& p) {
    const double a = 2 * p[0] + p[1], b = 3 * p[2] - p[0] + 1;
    return {2 * std::cos(a) * std::cos(b) + std::sin(a) * std::sin(b), std::cos(a) * std::cos(b),
            -3 * std::sin(a) * std::sin(b)};
  }
  static double secondByX(const Point& p) {
    const double a = 2 * p[0] + p[1], b = 3 * p[2] - p[0] + 1;
    return -5 * std::sin(a) * std::cos(b) + 4 * std::cos(a) * std::sin(b);
  }
};

struct Errors {
  double value = 0, gradient = 0, second = 0;  ///< largest
};

/// Largest errors at fixed points of a cube of side one.
/// @param atBorder  −1 or 1 for an axis along which points are within 0.6 spacings of the lower or
///                  the upper border
template <class Spline, class Sample>
Errors errorsOf(const Sample& sample, int n, const std::array<int, 3>& atBorder = {0, 0, 0}) {
  Errors errors;
  const double h = 1.0 / n;
  for (int m = 0; m < 4000; ++m) {
    Point p;
    for (int d = 0; d < 3; ++d) {
      const double wave = std::sin(1.7 * m * (d + 1) + d);
      p[d] = 0.5 + 0.5 * wave;
      if (atBorder[d] < 0) p[d] = 0.3 * h * (1 + wave);
      if (atBorder[d] > 0) p[d] = 1 - 0.3 * h * (1 + wave);
    }
    const auto found = splineDerivatives(Spline{}, sample, {p[0] * n, p[1] * n, p[2] * n});
    const Point gradient = Wave::gradient(p);
    errors.value = std::max(errors.value, std::abs(found.value - Wave::value(p)));
    for (int d = 0; d < 3; ++d)
      errors.gradient = std::max(errors.gradient, std::abs(found.gradient[d] * n - gradient[d]));
    errors.second =
        std::max(errors.second, std::abs(found.hessian[0][0] * n * n - Wave::secondByX(p)));
  }
  return errors;
}

double orderOf(double coarse, double fine) {
  return std::log2(coarse / fine);
}

auto sampledWave(int n) {
  return [n](int i, int j, int k) { return Wave::value({1.0 * i / n, 1.0 * j / n, 1.0 * k / n}); };
}

/// Errors at five resolutions, each of twice the one before it.
template <class Spline>
std::array<Errors, 5> errorsAtFiveResolutions() {
  std::array<Errors, 5> errors;
  for (int level = 0; level < 5; ++level)
    errors[level] = errorsOf<Spline>(sampledWave(16 << level), 16 << level);
  return errors;
}

/// @param value, gradient, second  the smallest orders measured between two resolutions
template <class Spline>
void expectOrders(const char* name, double value, double gradient, double second) {
  SCOPED_TRACE(name);
  const std::array<Errors, 5> errors = errorsAtFiveResolutions<Spline>();
  for (int level = 1; level < 5; ++level) {
    const Errors &coarse = errors[level - 1], &fine = errors[level];
    EXPECT_GE(orderOf(coarse.value, fine.value), support::measuredOrder(value));
    EXPECT_GE(orderOf(coarse.gradient, fine.gradient), support::measuredOrder(gradient));
    EXPECT_GE(orderOf(coarse.second, fine.second), support::measuredOrder(second));
  }
}

TEST(SplineOrder, IsTwoForValuesAndGradients) {
  expectOrders<QuadraticSuperSpline>("quadratic super", 1.998, 1.956, 0.93);
  expectOrders<CubicC1Spline>("cubic C1", 1.996, 1.98, 0.985);
  expectOrders<BccQuadraticSpline<2>>("Q_2", 1.997, 1.883, 0.848);
}

TEST(SplineOrder, IsOneForTheValuesOfQ3) {
  const std::array<Errors, 5> errors = errorsAtFiveResolutions<BccQuadraticSpline<3>>();
  for (int level = 1; level < 5; ++level) {
    const double order = orderOf(errors[level - 1].value, errors[level].value);
    EXPECT_NEAR(order, 1, support::measured(0.149));
  }
}

/// Orders near a part of the border where the data beyond it follow a rule.
template <class Spline>
std::array<double, 2> borderOrders(const std::array<int, 3>& atBorder, GridExtension rule) {
  const auto errors = [&](int n) {
    const ExtendedGrid grid(sampledWave(n), {n + 1, n + 1, n + 1}, rule);
    return errorsOf<Spline>(grid, n, atBorder);
  };
  const Errors coarse = errors(64), fine = errors(128);
  return {orderOf(coarse.value, fine.value), orderOf(coarse.gradient, fine.gradient)};
}

template <class Spline>
void expectBorderOrders(const char* name, const std::array<int, 3>& atBorder) {
  SCOPED_TRACE(name);
  const auto clamped = borderOrders<Spline>(atBorder, GridExtension::Clamp);
  EXPECT_NEAR(clamped[0], 1, support::measured(0.0156));
  EXPECT_NEAR(clamped[1], 0, support::measured(0.0129));
  const auto linear = borderOrders<Spline>(atBorder, GridExtension::Linear);
  EXPECT_NEAR(linear[0], 2, support::measured(0.104));
  EXPECT_NEAR(linear[1], 1, support::measured(0.0804));
  const auto quadratic = borderOrders<Spline>(atBorder, GridExtension::Quadratic);
  EXPECT_NEAR(quadratic[0], 2, support::measured(0.144));
  EXPECT_NEAR(quadratic[1], 2, support::measured(0.022));
}

TEST(SplineOrder, HoldsUpToTheBorderWithQuadraticExtension) {
  for (const std::array<int, 3>& atBorder :
       {std::array{-1, 0, 0}, {0, 1, 0}, {0, 1, -1}, {1, 1, 1}}) {
    expectBorderOrders<QuadraticSuperSpline>("quadratic super", atBorder);
    expectBorderOrders<CubicC1Spline>("cubic C1", atBorder);
    expectBorderOrders<BccQuadraticSpline<2>>("Q_2", atBorder);
  }
}

TEST(GridExtension, ContinuesPolynomials) {
  // Degree 0, 1 or 2 in each variable.
  const auto p = [](int degree, int i, int j, int k) {
    const auto along = [&](int n) { return degree == 0 ? 1 : degree == 1 ? n - 3 : n * n - 2 * n; };
    return Rational(along(i) * along(j) * along(k) + 5);
  };
  for (int degree = 0; degree <= 2; ++degree) {
    const auto sample = [&](int i, int j, int k) {
      if (i < 0 || j < 0 || k < 0 || i > 3 || j > 4 || k > 2) ADD_FAILURE() << "outside the grid";
      return p(degree, i, j, k);
    };
    const ExtendedGrid grid(sample, {4, 5, 3}, static_cast<GridExtension>(degree));
    for (int i = -4; i < 8; ++i)
      for (int j = -4; j < 9; ++j)
        for (int k = -4; k < 7; ++k) EXPECT_EQ(grid(i, j, k), p(degree, i, j, k));
  }
}

TEST(GridExtension, ClampsToTheBorder) {
  const auto sample = [](int i, int j, int k) { return 100.0 * i + 10 * j + k; };
  const ExtendedGrid grid(sample, {3, 3, 3}, GridExtension::Clamp);
  EXPECT_EQ(grid(-5, 1, 9), sample(0, 1, 2));
  EXPECT_EQ(grid(2, 3, -1), sample(2, 2, 0));
}

TEST(GridExtension, UsesFewerDataOnThinGrids) {
  const auto sample = [](int i, int j, int) { return 2.0 * i + 7 * j; };
  const ExtendedGrid grid(sample, {2, 1, 1}, GridExtension::Quadratic);
  EXPECT_EQ(grid(5, 4, -3), 10);
  EXPECT_THROW((ExtendedGrid(sample, {2, 0, 1}, GridExtension::Linear)), UsageError);
}

}  // namespace spline_order_test
