#include "levelset/evolve/evolve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace evolve_test {

using Imath::V3d;
using levelset::evolve;
using levelset::EvolveOptions;
using levelset::NarrowBand;
using levelset::speedExpression;
using support::measured;
using support::refusal;
using Distance = std::function<double(const V3d&)>;

constexpr double kPi = 3.14159265358979323846;

struct DistanceError {
  double mean = 0, largest = 0;  ///< voxels
};

/// Compares values beside the surface, on both sides, with exact distances.
DistanceError errorOf(const NarrowBand& band, const Distance& exact) {
  DistanceError error;
  std::size_t count = 0;
  const double h = band.voxelSize();
  support::forEachActive(band, [&](const V3d& p, double phi) {
    if (std::abs(phi) > 1.5 * h) return;
    const double off = std::abs(phi - exact(p)) / h;
    error.mean += off;
    error.largest = std::max(error.largest, off);
    ++count;
  });
  EXPECT_GT(count, 0u);
  error.mean /= static_cast<double>(count);
  return error;
}

Distance ballDistance(const V3d& center, double radius) {
  return [=](const V3d& p) { return (p - center).length() - radius; };
}

Distance boxDistance(const V3d& half) {
  return [=](const V3d& p) {
    const V3d q(std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

const V3d kOff(0.013, -0.021, 0.034);

TEST(Evolve, ChangesTheRadiusOfABallByTheIntegralOfTheSpeed) {
  // Grows by 0.2 until t = π/6, shrinks by 0.4 until π/2, and grows again.
  const levelset::NormalSpeed speed = speedExpression("0.6*cos(3*t)");
  const auto errorAt = [&](double h, double time) {
    const NarrowBand ball = levelset::makeSphere(1, kOff, h);
    const NarrowBand moved = evolve(ball, speed, time).band;
    EXPECT_TRUE(levelset::check(moved).passed());
    EXPECT_EQ(moved.halfWidth(), ball.halfWidth());
    EXPECT_EQ(moved.indexToWorld(), ball.indexToWorld());
    return errorOf(moved, ballDistance(kOff, 1 + 0.2 * std::sin(3 * time)));
  };
  EXPECT_LT(errorAt(0.2, kPi / 6).mean, measured(4.27e-4));
  EXPECT_LT(errorAt(0.2, 2).largest, measured(0.00523));
  const DistanceError coarse = errorAt(0.2, kPi / 2), fine = errorAt(0.1, kPi / 2);
  EXPECT_LT(coarse.largest, measured(0.00658));
  EXPECT_LT(fine.largest, measured(8.76e-4));
  // One order more in world units.
  EXPECT_GT(std::log2(coarse.mean / fine.mean), support::measuredOrder(5.12));
}

TEST(Evolve, ArrivesAtTheTimesOfFastMarching) {
  const double h = 0.1, time = 0.25;
  const std::string text = "1 + 0.5*x + 0.3*sin(3*y)";
  const levelset::ScalarField speed = levelset::scalarExpression(text);
  const NarrowBand ball = levelset::makeSphere(1, kOff, h);
  const levelset::FieldGrid times = levelset::arrivalTimes(ball, 0.5, {.speed = speed}).times;
  const levelset::ScalarField arrival = levelset::asScalarField(times);
  for (const double sign : {1.0, -1.0}) {
    const std::string formula = sign > 0 ? text : "-(" + text + ")";
    const NarrowBand moved = evolve(ball, speedExpression(formula), time).band;
    double largest = 0;  // voxels
    for (const V3d& p : levelset::bandToMesh(moved).positions)
      largest = std::max(largest, std::abs(arrival(p) - sign * time) * speed(p) / h);
    EXPECT_LT(largest, sign > 0 ? measured(0.0541) : measured(0.0333));
  }
}

TEST(SlowEvolve, GrowsWulffShapes) {
  // The speed is the support function of a convex solid W, so the ball becomes the Minkowski sum of
  // the ball and W scaled by the time.
  const double h = 0.1;
  const NarrowBand ball = levelset::makeSphere(0.6, kOff, h);
  // W is a cube. The sum has the flat faces that the kinks of the speed give.
  const NarrowBand cube = evolve(ball, speedExpression("abs(nx) + abs(ny) + abs(nz)"), 0.4).band;
  const DistanceError error =
      errorOf(cube, [&](const V3d& p) { return boxDistance(V3d(0.4))(p - kOff) - 0.6; });
  EXPECT_LT(error.mean, measured(0.0247));
  EXPECT_LT(error.largest, measured(0.072));
  // W is an ellipsoid with these half axes.
  const V3d axes(1, 0.5, 0.25);
  const NarrowBand ellipsoid =
      evolve(ball, speedExpression("sqrt(nx^2 + (0.5*ny)^2 + (0.25*nz)^2)"), 0.4).band;
  const levelset::TriMesh mesh = levelset::bandToMesh(ellipsoid);
  double largest = 0;  // error of the support function, voxels
  for (int i = 0; i < 40; ++i) {
    const double z = -1 + (i + 0.5) / 20, angle = 2.4 * i, s = std::sqrt(1 - z * z);
    const V3d n(s * std::cos(angle), s * std::sin(angle), z);
    double reach = -HUGE_VAL;
    for (const V3d& p : mesh.positions) reach = std::max(reach, n.dot(p - kOff));
    largest = std::max(largest, std::abs(reach - 0.6 - 0.4 * (axes * n).length()) / h);
  }
  EXPECT_LT(largest, measured(0.0324));
}

TEST(Evolve, ShrinksABallWithItsCurvature) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.2);
  const NarrowBand moved = evolve(ball, speedExpression("-k"), 0.12).band;
  EXPECT_LT(errorOf(moved, ballDistance(kOff, std::sqrt(1 - 4 * 0.12))).largest, measured(0.00577));
  // At rest where the speed vanishes.
  const NarrowBand rest = evolve(ball, speedExpression("0.1*(2 - k)"), 0.3).band;
  EXPECT_LT(errorOf(rest, ballDistance(kOff, 1)).largest, measured(0.00263));
}

TEST(SlowEvolve, ShrinksAFineBallWithItsCurvature) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  const NarrowBand moved = evolve(ball, speedExpression("-k"), 0.12).band;
  EXPECT_LT(errorOf(moved, ballDistance(kOff, std::sqrt(1 - 4 * 0.12))).largest, measured(0.00128));
  const NarrowBand rest = evolve(ball, speedExpression("0.1*(2 - k)"), 0.3).band;
  EXPECT_LT(errorOf(rest, ballDistance(kOff, 1)).largest, measured(7.01e-4));
}

TEST(SlowEvolve, EqualsCurvatureFlow) {
  const double h = 0.1, time = 0.06;
  const auto difference = [&](const NarrowBand& solid) {
    const NarrowBand flowed = levelset::curvatureFlow(solid, time).band;
    const levelset::BandSampler exact(flowed);
    return errorOf(evolve(solid, speedExpression("-k"), time).band,
                   [&](const V3d& p) { return exact.value(p); });
  };
  const DistanceError torus = difference(levelset::makeTorus(1, 0.55, kOff, V3d(1, 2, 3), h));
  EXPECT_LT(torus.mean, measured(0.00126));
  EXPECT_LT(torus.largest, measured(0.00575));
  // The steps of the curvature flow differ most in their first moments, at edges and corners.
  const DistanceError box = difference(levelset::makeBox(V3d(1.5, 1.2, 1.8), kOff, h));
  EXPECT_LT(box.mean, measured(0.00799));
  EXPECT_LT(box.largest, measured(0.023));
}

TEST(Evolve, IsTheIdentityWithoutSpeed) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  for (const char* text : {"0", "0*t", "0*nx", "0*k"}) {
    const levelset::EvolveResult result = evolve(ball, speedExpression(text), 5);
    EXPECT_EQ(result.band.contentHash(), ball.contentHash()) << text;
    EXPECT_EQ(result.steps, 0u);
  }
  EXPECT_EQ(evolve(ball, speedExpression("1"), 0).band.contentHash(), ball.contentHash());
}

TEST(Evolve, StepsFollowTheSpeed) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  const levelset::EvolveResult slow = evolve(ball, speedExpression("0.5"), 1),
                               fast = evolve(ball, speedExpression("500"), 1e-3);
  EXPECT_EQ(slow.steps, fast.steps);
  EXPECT_LT(errorOf(slow.band, ballDistance(kOff, 1.5)).largest, measured(3.78e-4));
  EXPECT_LT(errorOf(fast.band, ballDistance(kOff, 1.5)).largest, measured(3.54e-4));
  // Twice the Courant number, half the steps.
  const levelset::EvolveResult coarse = evolve(ball, speedExpression("0.5"), 1, {.cfl = 1});
  EXPECT_EQ(slow.steps, 2 * coarse.steps);
  EXPECT_LT(errorOf(coarse.band, ballDistance(kOff, 1.5)).largest, measured(2.92e-4));
}

TEST(SlowEvolve, StepsFollowSpeedsOfNormalAndCurvature) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  const levelset::EvolveResult normal =
      evolve(ball, speedExpression("500*sqrt(nx^2 + ny^2 + nz^2)"), 1e-3);
  EXPECT_LT(errorOf(normal.band, ballDistance(kOff, 1.5)).largest, measured(5.09e-4));
  const levelset::EvolveResult slow = evolve(ball, speedExpression("-0.1*k"), 1),
                               fast = evolve(ball, speedExpression("-100*k"), 1e-3);
  EXPECT_EQ(slow.steps, fast.steps);
  EXPECT_LT(errorOf(fast.band, ballDistance(kOff, std::sqrt(0.6))).largest, measured(0.00103));
}

TEST(Evolve, MovesOnlyNearPoints) {
  const double h = 0.05;
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), h);
  const V3d tip(0, 0, 1);
  EvolveOptions options;
  options.near = {{tip, V3d(5, 0, 0)}, 0.5};
  const NarrowBand raised = evolve(ball, speedExpression("1"), 0.2, options).band;
  // The speed at the height s above the tip is the falloff there.
  double s = 0;
  for (int i = 0; i < 10000; ++i) s += 0.2 / 10000 * (1 - 12 * s * s + 16 * s * s * s);
  EXPECT_NEAR(raised.zeroSetBounds().max.z, 1 + s, measured(0.03) * h);
  const auto accessor = levelset::vdb(ball).getConstAccessor();
  double moved = 0;  // voxels
  support::forEachActive(raised, [&](const V3d& p, double phi) {
    const openvdb::Coord c = openvdb::Coord::round(levelset::toVdb(p / h));
    if ((p - tip).length() > 0.5 + 4 * h)
      moved = std::max(moved, std::abs(phi - static_cast<double>(accessor.getValue(c))) / h);
  });
  EXPECT_LT(moved, measured(4.89e-5));
}

TEST(Evolve, MovesOnlyWhereTheMaskAllows) {
  const double h = 0.05;
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), h);
  EvolveOptions options;
  options.mask = {.field = [](const V3d& p) { return p.x; }, .min = 0.2, .max = 0.6};
  const NarrowBand grown = evolve(ball, speedExpression("0.3 - 0.01*k"), 0.5, options).band;
  double radius = 1;
  for (int i = 0; i < 10000; ++i) radius += 0.5 / 10000 * (0.3 - 0.02 / radius);
  EXPECT_NEAR(grown.zeroSetBounds().max.x, radius, measured(0.01) * h);
  EXPECT_NEAR(grown.zeroSetBounds().min.x, -1, measured(1e-4) * h);
  // Mask and falloff are multiplied. Here one of the two is zero everywhere.
  options.near = {{V3d(-1, 0, 0)}, 0.5};
  EXPECT_EQ(evolve(ball, speedExpression("1"), 0.5, options).band.contentHash(),
            ball.contentHash());
}

TEST(Evolve, KnowsWorldNormalsOnTurnedGrids) {
  NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.1);
  Imath::M44d place;
  place.setAxisAngle(V3d(1, 1, 0).normalized(), 0.6);
  place[3][0] = 5;
  ball = levelset::transform(std::move(ball), place);
  // A speed n·u is the translation by u.
  const NarrowBand moved = evolve(ball, speedExpression("0.7*nz"), 1).band;
  const DistanceError error = errorOf(moved, ballDistance(V3d(5, 0, 0.7), 1));
  EXPECT_LT(error.largest, measured(8.29e-4));
}

TEST(Evolve, MergesBalls) {
  const double h = 0.1;
  const auto two = [](const V3d& p) {
    return std::min((p - V3d(-0.8, 0, 0)).length(), (p - V3d(0.8, 0, 0)).length()) - 0.7;
  };
  const NarrowBand balls =
      support::sampleBand(two, Imath::Box3d(V3d(-1.6, -0.8, -0.8), V3d(1.6, 0.8, 0.8)), h);
  const NarrowBand grown = evolve(balls, speedExpression("1"), 0.3).band;
  const DistanceError error = errorOf(grown, [&](const V3d& p) { return two(p) - 0.3; });
  // Inside, beside the crease, the formula is not the distance, so only the mean is small.
  EXPECT_LT(error.mean, measured(0.00678));
}

TEST(Evolve, ReportsTheTimeAtWhichTheSolidVanishes) {
  const NarrowBand ball = levelset::makeSphere(0.5, kOff, 0.1);
  for (const char* text : {"-1", "-0.25*k", "-1 + 0*nx"}) {
    const std::string message =
        refusal<levelset::InvalidInput>([&] { (void)evolve(ball, speedExpression(text), 2); });
    EXPECT_NE(message.find("the solid vanishes after a time of 0."), std::string::npos) << message;
  }
}

TEST(Evolve, RefusesWhatItCannotFollow) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  const auto run = [&](const std::string& text, double time = 0.1,
                       const EvolveOptions& options = {}) {
    return
        [&ball, text, time, options] { (void)evolve(ball, speedExpression(text), time, options); };
  };
  for (const char* text : {"sqrt(x)", "1/(0*x)", "1/k", "sqrt(0.05 - t)", "sqrt(nx)"})
    EXPECT_NE(refusal<levelset::InvalidInput>(run(text)).find("the speed is not finite at"),
              std::string::npos)
        << text;
  for (const char* text : {"k", "abs(k)", "x > 0 ? k : -k"})
    EXPECT_NE(refusal<levelset::InvalidInput>(run(text)).find("grows with the curvature"),
              std::string::npos)
        << text;
  EXPECT_NE(refusal<levelset::ResourceLimit>(run("1e9", 1)).find("smoother speed"),
            std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double time : {-1.0, nan, HUGE_VAL})
    EXPECT_THROW(run("1", time)(), levelset::UsageError);
  for (const EvolveOptions& options :
       {EvolveOptions{.start = nan}, EvolveOptions{.order = 4}, EvolveOptions{.timeOrder = 0},
        EvolveOptions{.cfl = 0}, EvolveOptions{.cfl = 1.01}, EvolveOptions{.cfl = nan},
        EvolveOptions{.mask = levelset::Mask{}}, EvolveOptions{.near = levelset::PointFalloff{}},
        EvolveOptions{.near = levelset::PointFalloff{{V3d(0)}, 0}},
        EvolveOptions{.near = levelset::PointFalloff{{V3d(nan)}, 1}}})
    EXPECT_THROW(run("1", 0.1, options)(), levelset::UsageError);
  EXPECT_THROW((void)evolve(ball, {}, 1), levelset::UsageError);
  EXPECT_THROW((void)evolve(NarrowBand(), speedExpression("1"), 1), levelset::InvalidInput);
  EXPECT_THROW(run("1", 1, {.maxMemory = 10000})(), levelset::ResourceLimit);
  EXPECT_THROW(run("1", 1, {.progress = [](double f) { return f < 0.3; }})(), levelset::Cancelled);
}

TEST(Evolve, GivesTheSameBitsForAnyNumberOfThreads) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.2);
  std::uint64_t hash[2];
  for (std::size_t i = 0; i < 2; ++i)
    hash[i] = support::onThreads(i ? 4 : 1, [&] {
      return evolve(ball, speedExpression("0.3 + 0.2*abs(nx)*y - 0.05*k*cos(t)"), 0.1)
          .band.contentHash();
    });
  EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace evolve_test
