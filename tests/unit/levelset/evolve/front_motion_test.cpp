#include <gtest/gtest.h>

#include <cmath>

#include "levelset/evolve/front_motion_vdb.h"
#include "levelset/fields/expression.h"
#include "levelset/hamilton_jacobi/hamiltonian.h"
#include "tests/support/measured.h"

/// Orders of the schemes, without redistancing.
namespace front_motion_test {

using Imath::V3d;
using levelset::flow::FrontMotion;
using levelset::flow::kUpwindOrders;
using levelset::flow::OneSidedSlopes;

/// Returns the error of a wave on φ = ± x that the speed 1 moves by 1, at |x| < 2. The row of grid
/// points ends far from there. On the other axes the background is above φ, so that Godunov's
/// scheme ignores it.
double errorInSpace(int order, int direction, double h) {
  const auto grid = openvdb::FloatGrid::create(1000);
  grid->setTransform(levelset::uniformTransform(h));
  const auto start = [](double x) { return x + 0.5 * std::sin(x); };
  const int end = static_cast<int>(12 / h);
  for (int x = -end; x <= end; ++x)
    grid->tree().setValueOn(openvdb::Coord(x, 0, 0), static_cast<float>(start(direction * x * h)));
  Imath::M44d toWorld;
  toWorld.setScale(h);
  const FrontMotion motion({.speed = levelset::speedExpression("1"), .orders = {order, 3}}, toWorld,
                           h);
  openvdb::FloatGrid::Ptr moved = grid;
  constexpr int kSteps = 60;
  for (int n = 0; n < kSteps; ++n)
    moved = motion.step(*moved, static_cast<double>(n) / kSteps, (n + 1.0) / kSteps);
  double sum = 0, count = 0;
  for (int x = static_cast<int>(-2 / h); x <= 2 / h; ++x) {
    const auto value = static_cast<double>(moved->tree().getValue(openvdb::Coord(x, 0, 0)));
    sum += std::abs(value - start(direction * x * h - 1));
    ++count;
  }
  return sum / count;
}

TEST(FrontMotion, HasItsOrderInSpace) {
  for (const int direction : {1, -1})
    for (const int order : kUpwindOrders) {
      // The fifth order reaches the rounding of float sooner.
      const double h = order == 5 ? 0.8 : 0.2;
      const double errors[] = {errorInSpace(order, direction, h),
                               errorInSpace(order, direction, h / 2),
                               errorInSpace(order, direction, h / 4)};
      for (int i = 0; i < 2; ++i) {
        const double found = std::log2(errors[i] / errors[i + 1]);
        if (order == 5)
          EXPECT_GE(found, support::measuredOrder(i == 0 ? 4.51 : 4.63)) << direction;
        else
          EXPECT_NEAR(found, order, 0.2) << order << " " << direction << " " << errors[i];
      }
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
