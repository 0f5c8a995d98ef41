#include "levelset/evolve/evolve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"
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
  std::vector<double> errors;
  for (const double h : {0.2, 0.1, 0.05}) {
    const NarrowBand ball = levelset::makeSphere(1, kOff, h);
    for (const double time : {kPi / 6, kPi / 2, 2.0}) {
      const NarrowBand moved = evolve(ball, speed, time).band;
      const DistanceError error = errorOf(moved, ballDistance(kOff, 1 + 0.2 * std::sin(3 * time)));
      if (time == 2) errors.push_back(error.mean);
      printf("ball h %g t %g mean %g largest %g\n", h, time, error.mean, error.largest);
      EXPECT_TRUE(levelset::check(moved).passed());
      EXPECT_EQ(moved.halfWidth(), ball.halfWidth());
      EXPECT_EQ(moved.indexToWorld(), ball.indexToWorld());
    }
  }
  for (int i = 0; i < 2; ++i) printf("ball order %g\n", std::log2(errors[i] / errors[i + 1]));
}

TEST(Evolve, ArrivesAtTheTimesOfFastMarching) {
  const std::string text = "1 + 0.5*x + 0.3*sin(3*y)";
  for (const double h : {0.1, 0.05}) {
    const NarrowBand ball = levelset::makeSphere(1, kOff, h);
    for (const double sign : {1.0, -1.0}) {
      const double time = 0.25;
      const levelset::FieldGrid times =
          levelset::arrivalTimes(ball, 0.5, {.speed = levelset::scalarExpression(text)}).times;
      const levelset::ScalarField arrival = levelset::asScalarField(times);
      const levelset::ScalarField speed = levelset::scalarExpression(text);
      const NarrowBand moved =
          evolve(ball, speedExpression((sign > 0 ? "" : "-(") + text + (sign > 0 ? "" : ")")), time)
              .band;
      double largest = 0;
      for (const V3d& p : levelset::bandToMesh(moved).positions)
        largest = std::max(largest, std::abs(arrival(p) - sign * time) * speed(p) / h);
      printf("march h %g sign %g largest %g\n", h, sign, largest);
    }
  }
}

TEST(Evolve, GrowsWulffShapes) {
  // The speed is the support function of a convex solid W, so the ball becomes the Minkowski sum of
  // the ball and W scaled by the time.
  std::vector<double> errors;
  for (const double h : {0.1, 0.05}) {
    const NarrowBand ball = levelset::makeSphere(0.6, kOff, h);
    // W is a cube.
    const NarrowBand cube = evolve(ball, speedExpression("abs(nx) + abs(ny) + abs(nz)"), 0.4).band;
    const DistanceError error =
        errorOf(cube, [&](const V3d& p) { return boxDistance(V3d(0.4))(p - kOff) - 0.6; });
    printf("cube h %g mean %g largest %g\n", h, error.mean, error.largest);
    // W is an ellipsoid.
    const V3d axes(1, 0.5, 0.25);
    const NarrowBand ellipsoid =
        evolve(ball, speedExpression("sqrt(nx^2 + (0.5*ny)^2 + (0.25*nz)^2)"), 0.4).band;
    const levelset::TriMesh mesh = levelset::bandToMesh(ellipsoid);
    double largest = 0;
    for (int i = 0; i < 40; ++i) {
      const double z = -1 + (i + 0.5) / 20, angle = 2.4 * i, s = std::sqrt(1 - z * z);
      const V3d n(s * std::cos(angle), s * std::sin(angle), z);
      double support = -HUGE_VAL;
      for (const V3d& p : mesh.positions) support = std::max(support, n.dot(p - kOff));
      largest = std::max(largest, std::abs(support - 0.6 - 0.4 * (axes * n).length()) / h);
    }
    printf("ellipsoid h %g largest %g\n", h, largest);
  }
}

TEST(Evolve, ShrinksABallWithItsCurvature) {
  std::vector<double> errors;
  for (const double h : {0.2, 0.1, 0.05}) {
    const NarrowBand ball = levelset::makeSphere(1, kOff, h);
    const NarrowBand moved = evolve(ball, speedExpression("-k"), 0.12).band;
    const DistanceError error = errorOf(moved, ballDistance(kOff, std::sqrt(1 - 4 * 0.12)));
    printf("curvature h %g mean %g largest %g\n", h, error.mean, error.largest);
    errors.push_back(error.largest);
    // In equilibrium: the speed vanishes at radius 1.
    const NarrowBand rest = evolve(ball, speedExpression("0.1*(2 - k)"), 0.3).band;
    const DistanceError still = errorOf(rest, ballDistance(kOff, 1));
    printf("rest h %g mean %g largest %g\n", h, still.mean, still.largest);
  }
}

TEST(Evolve, EqualsCurvatureFlow) {
  const double h = 0.1, time = 0.06;
  for (const NarrowBand& solid : {levelset::makeTorus(1, 0.55, kOff, V3d(1, 2, 3), h),
                                  levelset::makeBox(V3d(1.5, 1.2, 1.8), kOff, h)}) {
    const NarrowBand moved = evolve(solid, speedExpression("-k"), time).band;
    const NarrowBand flowed = levelset::curvatureFlow(solid, time).band;
    const auto accessor = levelset::vdb(flowed).getConstAccessor();
    double largest = 0, mean = 0, count = 0;
    for (auto it = levelset::vdb(moved).cbeginValueOn(); it; ++it) {
      if (std::abs(*it) > 1.5 * h) continue;
      const double off = std::abs(*it - accessor.getValue(it.getCoord())) / h;
      largest = std::max(largest, off);
      mean += off;
      ++count;
    }
    printf("flow mean %g largest %g\n", mean / count, largest);
  }
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

TEST(Evolve, StepsAreLimitedBySpeed) {
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  const struct {
    const char *slow, *fast;
    double radius;
  } cases[] = {{"0.5", "500", 1.5},
               {"0.5*sqrt(nx^2 + ny^2 + nz^2)", "500*sqrt(nx^2 + ny^2 + nz^2)", 1.5},
               {"-0.1*k", "-100*k", std::sqrt(1 - 0.4)}};
  for (const auto& c : cases) {
    const levelset::EvolveResult slow = evolve(ball, speedExpression(c.slow), 1),
                                 fast = evolve(ball, speedExpression(c.fast), 1e-3);
    EXPECT_EQ(slow.steps, fast.steps);
    printf("%s steps %zu redistances %zu: %g %g\n", c.slow, slow.steps, slow.redistances,
           errorOf(slow.band, ballDistance(kOff, c.radius)).largest,
           errorOf(fast.band, ballDistance(kOff, c.radius)).largest);
  }
  // A smaller Courant number takes more steps.
  const levelset::EvolveResult fine = evolve(ball, speedExpression("0.5"), 1, {.cfl = 0.25}),
                               coarse = evolve(ball, speedExpression("0.5"), 1, {.cfl = 1});
  printf("cfl %zu %zu: %g %g\n", fine.steps, coarse.steps,
         errorOf(fine.band, ballDistance(kOff, 1.5)).largest,
         errorOf(coarse.band, ballDistance(kOff, 1.5)).largest);
}

TEST(Evolve, MovesOnlyNearPointsAndWhereTheMaskAllows) {
  const double h = 0.05;
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), h);
  const V3d tip(0, 0, 1);
  EvolveOptions options;
  options.near = {{tip, V3d(5, 0, 0)}, 0.5};
  const NarrowBand raised = evolve(ball, speedExpression("1"), 0.2, options).band;
  printf("tip %g bottom %g\n", raised.zeroSetBounds().max.z, raised.zeroSetBounds().min.z);
  const auto accessor = levelset::vdb(ball).getConstAccessor();
  double moved = 0;
  support::forEachActive(raised, [&](const V3d& p, double phi) {
    const openvdb::Coord c = openvdb::Coord::round(levelset::toVdb(p / h));
    const double off = std::abs(phi - accessor.getValue(c));
    if ((p - tip).length() > 0.5 + 4 * h) moved = std::max(moved, off / h);
  });
  printf("moved beyond %g\n", moved);
  EvolveOptions masked;
  masked.mask = {.field = [](const V3d& p) { return p.x; }, .min = 0.2, .max = 0.6};
  const NarrowBand grown = evolve(ball, speedExpression("0.3 - 0.01*k"), 0.5, masked).band;
  printf("mask max %g min %g\n", grown.zeroSetBounds().max.x, grown.zeroSetBounds().min.x);
  // Both factors are multiplied: they exclude each other here.
  masked.near = {{V3d(-1, 0, 0)}, 0.5};
  EXPECT_EQ(evolve(ball, speedExpression("1"), 0.5, masked).band.contentHash(), ball.contentHash());
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
  printf("turned mean %g largest %g\n", error.mean, error.largest);
}

TEST(Evolve, SplitsAndMerges) {
  // Two balls merge while they grow, and the bridge breaks again on the way back.
  const double h = 0.1;
  const auto two = [](const V3d& p) {
    return std::min((p - V3d(-0.8, 0, 0)).length(), (p - V3d(0.8, 0, 0)).length()) - 0.7;
  };
  const NarrowBand balls =
      support::sampleBand(two, Imath::Box3d(V3d(-1.6, -0.8, -0.8), V3d(1.6, 0.8, 0.8)), h);
  const NarrowBand grown = evolve(balls, speedExpression("1"), 0.3).band;
  const DistanceError error = errorOf(grown, [&](const V3d& p) { return two(p) - 0.3; });
  printf("merge mean %g largest %g\n", error.mean, error.largest);
}

TEST(Evolve, ReportsTheTimeAtWhichTheSolidVanishes) {
  const NarrowBand ball = levelset::makeSphere(0.5, kOff, 0.1);
  for (const char* text : {"-1", "-0.25*k", "-1 + 0*nx"}) {
    const std::string message =
        refusal<levelset::InvalidInput>([&] { (void)evolve(ball, speedExpression(text), 2); });
    printf("%s\n", message.c_str());
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
  const NarrowBand ball = levelset::makeSphere(1, kOff, 0.1);
  std::uint64_t hash[2];
  for (std::size_t i = 0; i < 2; ++i)
    hash[i] = support::onThreads(i ? 4 : 1, [&] {
      return evolve(ball, speedExpression("0.3 + 0.2*abs(nx)*y - 0.05*k*cos(t)"), 0.3)
          .band.contentHash();
    });
  EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace evolve_test
