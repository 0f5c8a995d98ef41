#include "levelset/hamilton_jacobi/upwind_derivative.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/advection/advect.h"
#include "levelset/advection/grid_schemes.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"

/// Orders of the upwind scheme in space and in time.
namespace upwind_derivative_test {

using Imath::V3d;
using levelset::AdvectScheme;
using levelset::flow::kUpwindOrders;
using levelset::flow::upwindDerivative;

/// Largest error of the derivative of a function with derivatives of all orders, on a grid of
/// spacing h. Its slope is about 1, as that of a distance.
double largestError(int order, double h) {
  const auto f = [](double x) { return x + 0.1 * std::exp(0.7 * x); };
  double largest = 0;
  for (double x = 0; x < 1; x += 0.05) {
    std::array<double, 6> values;
    for (std::size_t k = 0; k < 6; ++k) values[k] = f(x + (static_cast<double>(k) - 3) * h) / h;
    largest =
        std::max(largest, std::abs(upwindDerivative(values, order) - 1 - 0.07 * std::exp(0.7 * x)));
  }
  return largest;
}

TEST(UpwindDerivative, HasItsOrder) {
  for (const int order : kUpwindOrders) {
    const double errors[] = {largestError(order, 0.2), largestError(order, 0.1),
                             largestError(order, 0.05)};
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(std::log2(errors[i] / errors[i + 1]), order, 0.2) << order << " " << errors[i];
  }
}

TEST(UpwindDerivative, IsExactOnPolynomials) {
  // A scheme of order n is exact up to degree n. ENO also chooses among stencils that all are.
  for (const int order : kUpwindOrders)
    for (int degree = 0; degree <= std::min(order, 3); ++degree) {
      std::array<double, 6> values;
      for (std::size_t k = 0; k < 6; ++k)
        values[k] = std::pow(static_cast<double>(k) - 3 + 0.25, degree);
      const double exact = degree == 0 ? 0 : degree * std::pow(0.25, degree - 1);
      EXPECT_NEAR(upwindDerivative(values, order), exact, 1e-5) << order << " " << degree;
    }
}

TEST(UpwindDerivative, DoesNotOscillateAtAKink) {
  // |x|, with the kink between any two of the points: all derivatives lie between the slopes.
  for (const int order : kUpwindOrders)
    for (double kink = -3.25; kink < 3; kink += 0.5) {
      std::array<double, 6> values;
      for (std::size_t k = 0; k < 6; ++k) values[k] = std::abs(static_cast<double>(k) - 3 - kink);
      EXPECT_LE(std::abs(upwindDerivative(values, order)), 1.05) << order << " " << kink;
    }
}

/// Error of the slope of φ = x − 3 that the velocity a(t) x stretches until time 2. φ stays linear,
/// so that all orders in space are exact, and the error is that of the time integration. The flow
/// leaves x = 0, so that the ends of the grid have no influence near it.
double errorInTime(int timeOrder, int steps) {
  const auto grid = openvdb::FloatGrid::create(1000);
  for (int x = -8; x <= 8; ++x)
    grid->tree().setValueOn(openvdb::Coord(x, 0, 0), static_cast<float>(x - 3));
  const levelset::flow::Velocity velocity = [](const V3d& p, double t) {
    return V3d((1 + 0.5 * std::sin(2 * t)) * p.x, 0, 0);
  };
  const double time = 2;
  const levelset::flow::TimeInterval interval{
      .velocity = velocity, .from = 0, .to = time, .toWorld = Imath::M44d()};
  openvdb::FloatGrid::Ptr moved = grid;
  for (int n = 0; n < steps; ++n)
    moved = upwindStep(*moved, interval, {1, timeOrder}, time * n / steps, time * (n + 1) / steps);
  const double exact = std::exp(-time - 0.25 * (1 - std::cos(2 * time)));
  const auto at = [&](int x) {
    return static_cast<double>(moved->tree().getValue(openvdb::Coord(x, 0, 0)));
  };
  return std::abs(at(1) - at(0) - exact);
}

TEST(Upwind, HasItsOrderInTime) {
  for (const int order : {1, 2, 3}) {
    const double errors[] = {errorInTime(order, 10), errorInTime(order, 20),
                             errorInTime(order, 40)};
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(std::log2(errors[i] / errors[i + 1]), order, 0.2) << order << " " << errors[i];
  }
}

TEST(Upwind, RefusesOrdersThatDoNotExist) {
  const levelset::NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.2);
  const auto advect = [&](int order, int timeOrder) {
    (void)levelset::advect(
        ball, [](const V3d&, double) { return V3d(1, 0, 0); }, 0.1,
        {.scheme = AdvectScheme::Upwind, .order = order, .timeOrder = timeOrder});
  };
  for (const int order : {0, 4, 6, -1}) EXPECT_THROW(advect(order, 3), levelset::UsageError);
  for (const int order : {0, 4, -1}) EXPECT_THROW(advect(5, order), levelset::UsageError);
}

}  // namespace upwind_derivative_test
