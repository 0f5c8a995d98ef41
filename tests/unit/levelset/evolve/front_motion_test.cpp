#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/evolve/front_motion_vdb.h"
#include "levelset/fields/expression.h"
#include "levelset/hamilton_jacobi/hamiltonian.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"

/// Orders of the schemes, without redistancing.
namespace front_motion_test {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::flow::FrontMotion;
using levelset::flow::kUpwindOrders;
using levelset::flow::OneSidedSlopes;

/// Returns the mean error beside the surface of a ball with a radius of 1 that grows or shrinks by
/// a quarter. φ − F t is the exact solution, so the integration in time is exact and the error is
/// that of the differences.
double errorInSpace(int order, double speed, double h, const char* formula) {
  const NarrowBand ball =
      levelset::makeSphere(1, V3d(0.013, -0.021, 0.034), h, {.halfWidth = 0.75 / h});
  const FrontMotion motion({.speed = levelset::speedExpression(formula), .orders = {order, 3}},
                           ball.indexToWorld(), h);
  openvdb::FloatGrid::Ptr grid = levelset::vdb(ball).deepCopy();
  const double time = 0.25 / std::abs(speed);
  const int steps = static_cast<int>(std::ceil(1 / h));
  for (int n = 0; n < steps; ++n)
    grid = motion.step(*grid, time * n / steps, time * (n + 1) / steps);
  double sum = 0, count = 0;
  const auto accessor = levelset::vdb(ball).getConstAccessor();
  for (auto it = grid->cbeginValueOn(); it; ++it) {
    const double exact = static_cast<double>(accessor.getValue(it.getCoord())) - speed * time;
    if (std::abs(exact) > 0.1) continue;
    sum += std::abs(static_cast<double>(*it) - exact);
    ++count;
  }
  return sum / count;
}

TEST(FrontMotion, HasItsOrderInSpace) {
  for (const char* formula : {"1", "-1", "sqrt(nx^2 + ny^2 + nz^2)"})
    for (const int order : kUpwindOrders) {
      const double speed = formula[0] == '-' ? -1 : 1;
      const double coarsest = order == 5 ? 1 / 6.0 : 1 / 8.0;
      double errors[3];
      for (int i = 0; i < 3; ++i)
        errors[i] = errorInSpace(order, speed, coarsest / (1 << i), formula);
      printf("%s order %d: %g %g %g: %.3f %.3f\n", formula, order, errors[0], errors[1], errors[2],
             std::log2(errors[0] / errors[1]), std::log2(errors[1] / errors[2]));
    }
}

/// Error of the slope of φ = x − 3 that the speed a(t) x stretches until time 2. φ stays linear, so
/// that all orders in space are exact. The flow leaves x = 0, so that the ends of the grid have no
/// influence near it.
double errorInTime(int timeOrder, int steps) {
  const auto grid = openvdb::FloatGrid::create(1000);
  for (int x = -8; x <= 8; ++x)
    grid->tree().setValueOn(openvdb::Coord(x, 0, 0), static_cast<float>(x - 3));
  const double time = 2;
  const FrontMotion motion({.speed = levelset::speedExpression("(1 + 0.5*sin(2*t))*max(x, 0)"),
                            .orders = {1, timeOrder}},
                           Imath::M44d(), 1);
  openvdb::FloatGrid::Ptr moved = grid;
  for (int n = 0; n < steps; ++n)
    moved = motion.step(*moved, time * n / steps, time * (n + 1) / steps);
  const double exact = std::exp(-time - 0.25 * (1 - std::cos(2 * time)));
  const auto at = [&](int x) {
    return static_cast<double>(moved->tree().getValue(openvdb::Coord(x, 0, 0)));
  };
  return std::abs(at(1) - at(0) - exact);
}

TEST(FrontMotion, HasItsOrderInTime) {
  for (const int order : {1, 2, 3}) {
    const double errors[] = {errorInTime(order, 10), errorInTime(order, 20),
                             errorInTime(order, 40)};
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(std::log2(errors[i] / errors[i + 1]), order, 0.2) << order << " " << errors[i];
  }
}

TEST(Hamiltonian, GodunovTakesTheSlopeFromWhichTheFrontComes) {
  using levelset::flow::godunovSlope;
  const OneSidedSlopes smooth{V3d(0.6, -0.8, 0), V3d(0.6, -0.8, 0)};
  for (const double speed : {1.0, -3.0}) EXPECT_DOUBLE_EQ(godunovSlope(smooth, speed), 1);
  // A ridge of φ, and a valley, along x. Outwards, a valley opens to a flat; a ridge stays sharp.
  const OneSidedSlopes ridge{V3d(0.5, 0, 0), V3d(-1, 0, 0)}, valley{V3d(-0.5, 0, 0), V3d(1, 0, 0)};
  EXPECT_DOUBLE_EQ(godunovSlope(ridge, 1), 1);
  EXPECT_DOUBLE_EQ(godunovSlope(valley, 1), 0);
  EXPECT_DOUBLE_EQ(godunovSlope(ridge, -1), 0);
  EXPECT_DOUBLE_EQ(godunovSlope(valley, -1), 1);
  EXPECT_EQ(godunovSlope(ridge, 0), 0);
}

TEST(Hamiltonian, UpwindIsGodunovAwayFromKinks) {
  using levelset::flow::upwindHamiltonian;
  const auto isotropic = [](const V3d& p) { return 2 * p.length(); };
  const OneSidedSlopes slopes{V3d(0.6, -0.7, 0.2), V3d(0.5, -0.8, 0.3)};
  const auto numeric = upwindHamiltonian(slopes, isotropic);
  EXPECT_NEAR(numeric.value, 2 * levelset::flow::godunovSlope(slopes, 2), 1e-12);
  // The derivatives of |p| are at most 1.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(numeric.speeds[axis], 2 * std::abs(slopes.lower[axis]) / 1.2);
    EXPECT_LE(numeric.speeds[axis], 2);
  }
  // In a valley the dissipation raises φ by as much as the mean slope is wrong.
  const OneSidedSlopes valley{V3d(-1, 0, 0), V3d(1, 0, 0)};
  EXPECT_NEAR(upwindHamiltonian(valley, isotropic).value, -2, 1e-3);
}

}  // namespace front_motion_test
