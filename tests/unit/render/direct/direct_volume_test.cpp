// Direct volume rendering against closed forms and against the judge.

#include "render/direct/direct_volume.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "levelset/volumes/synthetic.h"
#include "render/direct/judged_light.h"
#include "render/direct/light_kernel.h"
#include "render/direct/light_tables.h"
#include "render/hit.h"
#include "tests/support/measured.h"
#include "tests/support/volume_scenes.h"

namespace direct_volume_test {

using Imath::C3f;
using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::UsageError;
using levelset::Volume;
using support::measured;
using support::sampled;
using namespace render;

/// Opacity of a layer of one voxel that has an extinction per voxel.
double opacityOf(double extinction) {
  return -std::expm1(-extinction);
}

DirectVolume directVolume(const Volume& volume, const std::vector<TransferPoint>& points,
                          double tolerance = DirectVolume::kTolerance) {
  return {VolumeSurface(volume, 0), points, tolerance};
}

double differenceOf(const VolumeLight& a, const VolumeLight& b) {
  const V3d d = a.colour - b.colour;
  return std::max(
      {std::abs(d.x), std::abs(d.y), std::abs(d.z), std::abs(a.transmittance - b.transmittance)});
}

/// A transfer function with colours, a gap and two peaks.
const std::vector<TransferPoint> kBusy = {
    {-0.6, 0, C3f(1, 0.2f, 0.1f)},     {-0.3, 0.2, C3f(0.9f, 0.4f, 0.1f)},
    {-0.1, 0, C3f(0.2f, 0.5f, 0.9f)},  {0.1, 0, C3f(0.2f, 0.5f, 0.9f)},
    {0.3, 0.1, C3f(0.3f, 0.9f, 0.4f)}, {0.5, 0.02, C3f(1)}};

/// Rays towards random points of the box of a volume, some along its axes and through its points.
std::vector<std::array<V3d, 2>> raysThrough(const Volume& volume, std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  const M44d& map = volume.grid().indexToWorld;
  const V3d last = V3d(volume.size() - V3i(1));
  std::vector<std::array<V3d, 2>> rays;
  for (std::size_t n = 0; n < count; ++n) {
    V3d target(unit(random), unit(random), unit(random));
    target = target * last;
    V3d away(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    // Through grid points inside: on the border, rounding decides if a ray meets the volume.
    for (int axis = 0; n % 4 == 1 && axis < 3; ++axis)
      if (last[axis] > 1) target[axis] = std::clamp(std::round(target[axis]), 1.0, last[axis] - 1);
    if (n % 8 == 1) away = V3d(0, n % 16 == 1 ? 1 : 0, n % 16 == 1 ? 0 : -1);
    V3d direction;
    map.multDirMatrix(away, direction);
    direction.normalize();
    const double distance = n % 5 == 0 ? 0 : 40 * volume.grid().spacing().x;  // inside, outside
    rays.push_back({target * map - direction * distance, direction});
  }
  return rays;
}

/// Calls visit(part) for the parts of a run of linear values, as the kernel finds them.
template <typename Visit>
void alongRun(const TransferFunction& transfer, double from, double to, const Visit& visit) {
  const std::vector<double> pieces = transfer.pieceNumbers();
  TransferKernel kernel(pieces, transfer.pieceCount());
  int steps = 0, n = kernel.firstPiece(from, to, steps);
  double at = from;
  for (bool isLast = false; !isLast;) {
    const TransferKernel::Part part = kernel.nextPart(from, to, n, at);
    isLast = part.isLast;
    visit(part);
  }
}

TEST(TransferKernel, RoundsSquareRootsCorrectly) {
  TransferKernel kernel({}, 0);
  std::vector<double> numbers;
  // Next to powers of four, the middle between two neighbours is a tie in double precision.
  for (const int exponent : {-800, -52, -2, 0, 2, 4, 700})
    for (const double ulps : {-2.0, -1.0, 0.0, 1.0, 2.0})
      numbers.push_back(std::ldexp(1 + ulps * std::numeric_limits<double>::epsilon(), exponent));
  for (const int exponent : {-2, 0, 2}) numbers.push_back(std::ldexp(1 - 0x1p-53, exponent));
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> mantissa(1, 2);
  std::uniform_int_distribution<int> exponents(-800, 800);
  for (int n = 0; n < 100000; ++n)
    numbers.push_back(std::ldexp(mantissa(random), exponents(random)));
  for (const double a : numbers) {
    const double root = std::sqrt(a);
    for (const double near : {std::nextafter(root, 0.0), root, std::nextafter(root, HUGE_VAL)})
      ASSERT_EQ(kernel.roundedRoot(a, near), root) << a;
  }
}

TEST(TransferFunction, IntegratesInClosedForm) {
  const TransferFunction transfer(kBusy, 0.1);
  for (const double from : {-1.0, -0.45, 0.0, 0.2})
    for (const double to : {-0.25, 0.35, 0.7}) {
      // Simpson's rule on 4000 intervals.
      constexpr int kSteps = 8000;
      double sum = 0;
      V3d light(0);
      const double h = (to - from) / kSteps;
      for (int n = 0; n <= kSteps; ++n) {
        const double weight = (n == 0 || n == kSteps ? 1 : n % 2 == 1 ? 4 : 2) * h / 3;
        sum += weight * transfer.extinction(from + n * h);
        light += transfer.emission(from + n * h) * weight;
      }
      for (const bool isRising : {true, false}) {
        double share = 0, extinction = 0;
        V3d emission(0);
        alongRun(transfer, isRising ? from : to, isRising ? to : from,
                 [&](const TransferKernel::Part& part) {
                   share += part.share;
                   extinction += part.share * part.extinction;
                   emission += V3d(part.red, part.green, part.blue) * part.share;
                 });
        EXPECT_NEAR(share, 1, 1e-12);
        EXPECT_NEAR(extinction * (to - from), sum, 1e-6);
        EXPECT_NEAR((emission * (to - from) - light).length(), 0, 1e-6);
      }
    }
  // A run of one value, also at a point.
  for (const double value : {-0.3, 0.05, 0.2, 9.0})
    alongRun(transfer, value, value, [&](const TransferKernel::Part& part) {
      EXPECT_EQ(part.share, 1);
      EXPECT_NEAR(part.extinction, transfer.extinction(value), 1e-12);
    });
  // Noise near zero, far from the first point of the function.
  const TransferFunction wide({{-1000, 0.1}, {1000, 0.5}}, 1);
  alongRun(wide, -1e-13, 3e-13, [&](const TransferKernel::Part& part) {
    EXPECT_NEAR(part.extinction, wide.extinction(0), 1e-12);
  });
  EXPECT_TRUE(transfer.isEmptyBetween(-0.1, 0.1));
  EXPECT_TRUE(transfer.isEmptyBetween(-5, -0.6));
  EXPECT_FALSE(transfer.isEmptyBetween(-0.1, 0.11));
  EXPECT_FALSE(transfer.isEmptyBetween(-5, 5));
  EXPECT_FALSE(transfer.isEmptyBetween(0.5, 0.6));
  EXPECT_NEAR(transfer.extinction(-0.3), -std::log(0.8) / 0.1, 1e-12);
}

TEST(TransferFunction, ReadsWhatItWrites) {
  const auto points = parseTransfer("40:0 60:0.1/1,0.8,0.7  -1.5e2:.25");
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[1], (TransferPoint{60, 0.1, C3f(1, 0.8f, 0.7f)}));
  EXPECT_EQ(parseTransfer(transferText(points)), points);
  const std::vector<TransferPoint> near = {{60000.001, 0.99999}, {60000.0017, 1e-9, C3f(0.1f)}};
  EXPECT_EQ(parseTransfer(transferText(near)), near);
  for (const char* text : {"", "40", "40:", "40:x", "40:0.1/1", "40:0.1/1,2", "40:0.1/1,2,3,4",
                           "40:0.1,50:0.2", "40:0.1/", "a:0.1"})
    EXPECT_THROW((void)parseTransfer(text), UsageError) << text;
  const auto refused = [](std::vector<TransferPoint> all, double voxel = 1) {
    EXPECT_THROW(TransferFunction(std::move(all), voxel), UsageError);
  };
  refused({});
  refused({{1, 1}});
  refused({{1, -0.1}});
  refused({{NAN, 0.1}});
  refused({{1, NAN}});
  refused({{1, 0.1}, {1, 0.2}});
  refused({{1, 0.1, C3f(-1, 0, 0)}});
  refused({{1, 0.1}}, 0);
}

TEST(TransferFunction, SuggestsOneForAnyHistogram) {
  for (const auto& [low, high] :
       {std::pair(0.0, 254.0), {10000.0, 10010.0}, {-1e-6, 2e-6}, {5.0, 5.0}}) {
    const Volume volume =
        sampled({V3i(12), M44d()}, [first = low, size = high - low](const V3d& p) {
          return first + size * std::clamp((p.x - 3) / 6, 0.0, 1.0);
        });
    const auto points = suggestedTransfer(levelset::histogram(volume));
    const TransferFunction transfer(points, 1);
    for (std::size_t n = 1; n < points.size(); ++n) EXPECT_LT(points[n - 1].value, points[n].value);
    EXPECT_EQ(parseTransfer(transferText(points)), points);
    EXPECT_GT(transfer.extinction(high), 0);
    if (high > low) {
      EXPECT_EQ(transfer.extinction(low), 0);
    }
  }
}

TEST(DirectVolume, AbsorbsByTheExponentialFunction) {
  const Volume volume = sampled({V3i(2), M44d()}, [](const V3d&) { return 1; });
  const DirectVolume direct = directVolume(volume, {{1, 0.5}});
  LightKernel<float> kernel(*direct.tables(), nullptr);
  double largest = 0;
  for (double depth = 1e-12; depth < 200; depth *= 1.01) {
    const double truth = -std::expm1(-depth);
    largest = std::max(largest, std::abs(kernel.absorbedBy(depth) - truth) / truth);
  }
  EXPECT_LT(largest, 3 * std::numeric_limits<double>::epsilon());
  EXPECT_EQ(kernel.absorbedBy(0), 0);
}

TEST(DirectVolume, HasEnoughPieces) {
  const Volume volume = sampled({V3i(2), M44d()}, [](const V3d&) { return 1; });
  const DirectVolume direct = directVolume(volume, {{1, 0.5}});
  LightKernel<float> kernel(*direct.tables(), nullptr);
  const auto count = [&](double square, double least) {
    int steps = 0;
    return kernel.pieceCountOf(square, least, steps);
  };
  for (double square = 1e-3; square < 1e9; square *= 1.37)
    EXPECT_EQ(count(square, 0.5),
              static_cast<int>(std::clamp(std::ceil(std::sqrt(square)), 1.0, 4096.0)));
  for (int n = 1; n <= 4096; n += 5) {
    EXPECT_EQ(count(static_cast<double>(n) * n, 0), n);
    EXPECT_EQ(count(std::nextafter(static_cast<double>(n) * n, HUGE_VAL), 0),
              std::min(n + 1, 4096));
    EXPECT_EQ(count(0, n), n);
    EXPECT_EQ(count(0, n - 0.5), n);
  }
  for (const double much : {4096.5, 1e300, HUGE_VAL}) {
    EXPECT_EQ(count(much * much, 1), 4096);
    EXPECT_EQ(count(1, much), 4096);
  }
}

TEST(DirectVolume, FindsPeaksThatAreThinnerThanTheValuesOfACell) {
  // The values rise by one in each cell, and the peak is 1e-3 wide: its optical depth is exact.
  const Volume volume = sampled({V3i(9), M44d()}, [](const V3d& p) { return p.x; });
  const double depth = 0.5 * 1e-3 * std::log(1 / (1 - opacityOf(30)));
  const DirectVolume thin = directVolume(volume, {{4.4995, 0}, {4.5, opacityOf(30)}, {4.5005, 0}});
  EXPECT_NEAR(thin.light(V3d(-1, 4.2, 4.3), V3d(1, 0, 0), 0, HUGE_VAL).transmittance,
              std::exp(-depth), 1e-9);
  EXPECT_NEAR(judgedLight(thin, V3d(-1, 4.2, 4.3), V3d(1, 0, 0), 0, HUGE_VAL).transmittance,
              std::exp(-depth), measured(3e-5));
}

TEST(DirectVolume, BrightnessFollowsTheGradientInWorldSpace) {
  // A linear field on sheared, mirrored axes: its gradient is the same everywhere.
  const V3d gradient(1, -2, 0.5);
  const Volume volume =
      sampled({V3i(30), support::obliqueMap()}, [&](const V3d& p) { return p.dot(gradient); });
  const DirectVolume direct = directVolume(volume, kBusy);
  const double size = gradient.length(), voxel = [&] {
    const V3d s = volume.grid().spacing();
    return std::max({s.x, s.y, s.z});
  }();
  const double plain = 0.02 * (volume.highest() - volume.lowest()) / voxel;
  for (const V3d& to : {V3d(-1, 2, -0.5), V3d(1, -2, 0.5), V3d(0, 0, 1), V3d(-1, 0, 0)}) {
    VolumeShading shading;
    shading.toLight = to.normalized();
    const double facing = std::max(0.0, -gradient.dot(shading.toLight) / size);
    const double truth = 1 - size / (size + plain) * (1 - shading.ambient) * (1 - facing);
    for (const V3d& index : {V3d(4.3, 5.5, 6.7), V3d(0, 0, 0), V3d(29, 29, 29)})
      EXPECT_NEAR(direct.brightness(index, shading), truth, 1e-5);
  }
}

TEST(DirectVolume, AbsorbsExponentiallyInAConstantDensity) {
  const Volume volume = sampled({V3i(11, 11, 11), M44d()}, [](const V3d&) { return 5; });
  for (const double extinction : {1e-6, 0.01, 0.3, 0.6}) {
    const DirectVolume direct =
        directVolume(volume, {{5, opacityOf(extinction), C3f(1, 0.5f, 0.25f)}});
    const VolumeLight light = direct.light(V3d(-3, 4.3, 5.2), V3d(1, 0, 0), 0, HUGE_VAL);
    const double passed = std::exp(-10 * extinction);
    EXPECT_NEAR(light.transmittance, passed < kLeastTransmittance ? 0 : passed, 1e-12);
    EXPECT_NEAR(light.colour.x, passed < kLeastTransmittance ? 1 : 1 - passed, 1e-12);
    EXPECT_NEAR(light.colour.y, 0.5 * light.colour.x, 1e-12);
    // A part of the ray.
    EXPECT_NEAR(direct.light(V3d(-3, 4.3, 5.2), V3d(1, 0, 0), 5, 6.5).transmittance,
                std::exp(-1.5 * extinction), 1e-12);
  }
}

TEST(DirectVolume, IntegratesLinearValuesInClosedForm) {
  // The extinction equals the value x, from 0 to 2, so the optical depth is 2.
  const Volume volume =
      sampled({V3i(9, 5, 5), M44d().setScale(V3d(0.25))}, [](const V3d& p) { return p.x; });
  const DirectVolume direct =
      directVolume(volume, {{0, 0, C3f(0)}, {2, opacityOf(0.25 * 2), C3f(1)}});
  const VolumeLight light = direct.light(V3d(-1, 0.3, 0.4), V3d(1, 0, 0), 0, HUGE_VAL);
  EXPECT_NEAR(light.transmittance, std::exp(-2), 1e-12);
  // ∫ (x/2) x exp(−x²/2) dx over [0, 2] = (√(π/2) erf(√2) − 2 exp(−2)) / 2.
  const double truth = 0.5 * (std::sqrt(M_PI / 2) * std::erf(std::sqrt(2.0)) - 2 * std::exp(-2));
  EXPECT_NEAR(light.colour.x, truth, measured(2e-4));
}

TEST(DirectVolume, AgreesWithTheJudge) {
  const auto wave = [](const V3d& p) {
    return 0.8 * std::sin(2.3 * p.x + 0.4) * std::cos(1.7 * p.y) + 0.3 * std::sin(3 * p.z);
  };
  const V3d far(1e6, -2e6, 5e5);
  M44d farMap = support::obliqueMap();
  for (int axis = 0; axis < 3; ++axis) farMap[3][axis] += far[axis];
  const std::vector<Volume> volumes = {
      sampled({V3i(30), support::obliqueMap()}, wave),
      sampled({V3i(30), farMap}, [&](const V3d& p) { return wave(p - far); }),
      sampled({V3i(70, 9, 2), M44d().setScale(V3d(0.1, 0.4, 1))}, wave)};
  for (const Volume& volume : volumes) {
    const DirectVolume direct = directVolume(volume, kBusy);
    VolumeShading shading;
    shading.toLight = V3d(1, 2, 3).normalized();
    std::size_t lit = 0;
    double largest = 0;
    for (const auto& [origin, direction] : raysThrough(volume, 300))
      for (const VolumeShading* with : {static_cast<const VolumeShading*>(nullptr),
                                        static_cast<const VolumeShading*>(&shading)}) {
        const VolumeLight light = direct.light(origin, direction, 0, HUGE_VAL, with),
                          judged = judgedLight(direct, origin, direction, 0, HUGE_VAL, with, 64);
        lit += light.transmittance < 0.99;
        // Where the ray ends early, its last point counts as opaque.
        if (light.transmittance > 0)
          largest = std::max(largest, differenceOf(light, judged));
        else
          EXPECT_LT(differenceOf(light, judged), kLeastTransmittance);
      }
    EXPECT_GT(lit, 100u);
    EXPECT_LT(largest, measured(1.14e-3));
  }
}

TEST(DirectVolume, ConvergesWithItsTolerance) {
  const Volume volume = levelset::marschnerLobb(30);
  const std::vector<TransferPoint> points = {
      {0.35, 0, C3f(1, 0, 0)}, {0.5, 0.3, C3f(0, 1, 0)}, {0.65, 0, C3f(0, 0, 1)}};
  std::array<double, 3> errors{};
  const auto rays = raysThrough(volume, 200);
  for (std::size_t n = 0; n < 3; ++n) {
    const DirectVolume direct = directVolume(volume, points,
                                             std::pow(10.0, -1.0 - 2.0 * static_cast<double>(n))),
                       fine = directVolume(volume, points, 1e-9);
    for (const auto& [origin, direction] : rays) {
      const VolumeLight a = direct.light(origin, direction, 0, HUGE_VAL),
                        b = fine.light(origin, direction, 0, HUGE_VAL);
      if (a.transmittance > 0 && b.transmittance > 0)
        errors[n] = std::max(errors[n], differenceOf(a, b));
    }
  }
  EXPECT_LT(errors[2], measured(2e-4));
  EXPECT_LT(errors[2], errors[1]);
  EXPECT_LT(errors[1], errors[0]);
  // The judge's steps of second order come closer, too.
  const DirectVolume fine = directVolume(volume, points, 1e-9);
  std::array<double, 3> judged{};
  for (std::size_t n = 0; n < 3; ++n)
    for (const auto& [origin, direction] : rays) {
      const VolumeLight a = fine.light(origin, direction, 0, HUGE_VAL);
      if (a.transmittance > 0)
        judged[n] = std::max(judged[n], differenceOf(a, judgedLight(fine, origin, direction, 0,
                                                                    HUGE_VAL, nullptr, 8 << n)));
    }
  EXPECT_GT(judged[0] / judged[1], 2.5);
  EXPECT_LT(judged[2], measured(2.2e-4));
}

TEST(DirectVolume, InTheOpaqueLimitIsTheIsosurface) {
  const Volume volume = levelset::sphereVolume(41, 0.7);
  const DirectVolume direct =
      directVolume(volume, {{-1e-6, 0, C3f(0.5f)}, {1e-6, 1 - 1e-15, C3f(0.5f)}});
  const double voxel = volume.grid().spacing().x;
  for (const V3d& to : {V3d(0), V3d(0.2, 0.3, -0.1), V3d(-0.4, 0.1, 0.3)}) {
    const V3d eye(3, 2, 1), direction = (to - eye).normalized();
    const double middle = -eye.dot(direction);
    const double hit = middle - std::sqrt(0.49 - (eye + direction * middle).length2());
    EXPECT_EQ(direct.light(eye, direction, 0, hit - 0.1 * voxel).transmittance, 1);
    EXPECT_EQ(direct.light(eye, direction, 0, hit + 0.5 * voxel).transmittance, 0);
    EXPECT_NEAR(direct.light(eye, direction, 0, HUGE_VAL).colour.x, 0.5, 1e-6);
  }
}

TEST(DirectVolume, KeepsItsFormInExtremes) {
  const Volume volume = levelset::sphereVolume(20, 0.6);
  const V3d eye(3, 0.1, 0.2), ahead(-1, 0, 0);
  // No opacity anywhere.
  const DirectVolume nothing = directVolume(volume, {{0, 0}});
  EXPECT_EQ(nothing.skippedShare(), 1);
  EXPECT_EQ(nothing.light(eye, ahead, 0, HUGE_VAL).transmittance, 1);
  // A thousand times the usual extinction, and colours far above one.
  const DirectVolume dense = directVolume(volume, {{-1, 1 - 1e-12, C3f(1e6f)}});
  const VolumeLight light = dense.light(eye, ahead, 0, HUGE_VAL);
  EXPECT_EQ(light.transmittance, 0);
  EXPECT_NEAR(light.colour.x, 1e6, 1);
  // Rays beside the volume, behind it, and an empty part.
  for (const auto& [origin, direction] :
       {std::pair(V3d(3, 1.2, 0), ahead), {eye, V3d(1, 0, 0)}, {V3d(3, 1, 1), V3d(0, 0, 1)}})
    EXPECT_EQ(dense.light(origin, direction, 0, HUGE_VAL).transmittance, 1);
  EXPECT_EQ(dense.light(eye, ahead, 2, 2).transmittance, 1);
  // A ray on a face of the box, and on an edge.
  EXPECT_EQ(dense.light(V3d(3, 1, 0), ahead, 0, HUGE_VAL).transmittance, 0);
  EXPECT_EQ(dense.light(V3d(3, 1, -1), ahead, 0, HUGE_VAL).transmittance, 0);
  // A single layer has no cells.
  const Volume flat = sampled({V3i(5, 5, 1), M44d()}, [](const V3d&) { return 1; });
  EXPECT_EQ(directVolume(flat, {{1, 0.5}}).light(V3d(2, 2, 3), V3d(0, 0, -1), 0, 9).transmittance,
            1);
}

TEST(DirectVolume, TakesAllTypesOfNumbers) {
  // Bytes with a falling scale, beside the same values as floats.
  const Volume bytes = support::noisyBytes(20);
  std::vector<float> values;
  for (std::size_t n = 0; n < bytes.grid().pointCount(); ++n)
    values.push_back(static_cast<float>(bytes.scale()(bytes.stored(n))));
  const Volume floats(bytes.grid(), std::move(values));
  const std::vector<TransferPoint> points = {{90, 0}, {110, 0.2, C3f(1, 0, 0)}, {130, 0}};
  const DirectVolume a = directVolume(bytes, points), b = directVolume(floats, points);
  EXPECT_EQ(a.skippedShare(), b.skippedShare());
  for (const auto& [origin, direction] : raysThrough(bytes, 100))
    EXPECT_EQ(differenceOf(a.light(origin, direction, 0, HUGE_VAL),
                           b.light(origin, direction, 0, HUGE_VAL)),
              0);
}

TEST(DirectVolume, HasTheSameBitsWithoutSkippedBlocks) {
  const auto wave = [](const V3d& p) {
    return 0.8 * std::sin(2.3 * p.x + 0.4) * std::cos(1.7 * p.y) + 0.3 * std::sin(3 * p.z);
  };
  std::vector<float> ball;  // far from all borders of blocks, so that whole groups are empty
  constexpr int kSize = 150;
  for (int n = 0; n < kSize * kSize * kSize; ++n) {
    const V3d p(V3i(n % kSize, n / kSize % kSize, n / kSize / kSize));
    ball.push_back(static_cast<float>(std::max(0.0, 20 - (p - V3d(110, 30, 100)).length())));
  }
  const std::vector<std::pair<Volume, std::vector<TransferPoint>>> cases = {
      {Volume({V3i(kSize), M44d().setScale(V3d(0.1, 0.2, 0.15))}, std::move(ball)),
       {{0, 0}, {20, 0.1, C3f(1, 0, 0)}}},
      {sampled({V3i(60), support::obliqueMap()}, [&](const V3d& p) { return wave(p * 0.35); }),
       {{0.6, 0, C3f(1, 0, 0)}, {0.7, 0.2, C3f(0, 1, 0)}, {0.8, 0}}},
      {levelset::sphereVolume(65, 0.8), {{0.5, 0}, {0.6, 0.05, C3f(1, 0, 0)}}}};
  VolumeShading shading;
  shading.toLight = V3d(1, 2, 3).normalized();
  for (const auto& [volume, points] : cases) {
    const DirectVolume direct = directVolume(volume, points);
    EXPECT_GT(direct.skippedShare(), 0.3) << volume.size().x;
    LightTables full = *direct.tables();
    full.hasExtinction.assign(full.hasExtinction.size(), 1);
    full.groupHasExtinction.assign(full.groupHasExtinction.size(), 1);
    LightKernel<float> kernel(full, &shading);
    std::size_t lit = 0;
    auto rays = raysThrough(volume, 400);
    // Along axes, planes and diagonals of the grid, where planes of two axes are crossed at once.
    for (int n = 0; n < 27; ++n) {
      const V3d step(V3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
      if (step == V3d(0)) continue;
      for (const V3d& target : {V3d(12, 12, 12), V3d(110, 30, 100), V3d(30.5, 30, 29.5)}) {
        const M44d& map = volume.grid().indexToWorld;
        V3d direction;
        map.multDirMatrix(step, direction);
        direction.normalize();
        rays.push_back({target * map - direction * 60, direction});
      }
    }
    // Through edges of cells on the faces of blocks, where rounding decides which cell comes next.
    std::mt19937 random(5);
    for (int n = 0; n < 3000; ++n) {
      V3d target, away;
      for (int axis = 0; axis < 3; ++axis) {
        const int cells = volume.size()[axis] - 1;
        target[axis] = static_cast<double>(random() % static_cast<unsigned>(cells));
        if (axis == n % 3) target[axis] = std::floor(target[axis] / 8) * 8;
        away[axis] = static_cast<double>(random() % 9) - 4;
      }
      if (away == V3d(0)) continue;
      V3d direction;
      volume.grid().indexToWorld.multDirMatrix(away, direction);
      direction.normalize();
      rays.push_back({target * volume.grid().indexToWorld - direction * 60, direction});
    }
    for (const auto& [origin, direction] : rays) {
      const VolumeLight light = direct.light(origin, direction, 0, HUGE_VAL, &shading);
      const LightStart start = direct.start({origin, direction, 0, HUGE_VAL});
      if (!start.isInside) continue;
      auto ray = LightKernel<float>::rayOf(start);
      kernel.follow(ray, std::numeric_limits<int>::max());
      EXPECT_EQ(ray.passed, light.transmittance);
      EXPECT_EQ(V3d(ray.red, ray.green, ray.blue), light.colour);
      lit += light.transmittance < 1;
    }
    EXPECT_GT(lit, 40u);
  }
}

TEST(DirectVolume, ErrsByLessThanAShareOf512WhereARayEndsEarly) {
  // A ray through layers of colours of up to 2, the last of them the brightest.
  const Volume volume = sampled({V3i(40, 3, 3), M44d()}, [](const V3d& p) { return p.x; });
  double largest = 0, largestOfWhole = 0;
  std::size_t ended = 0;
  for (double extinction = 0.1; extinction < 2; extinction *= 1.1) {
    const DirectVolume direct = directVolume(
        volume, {{0, opacityOf(extinction), C3f(0)}, {39, opacityOf(extinction), C3f(2)}});
    const VolumeLight light = direct.light(V3d(-1, 1, 1), V3d(1, 0, 0), 0, HUGE_VAL);
    // ∫ (2x/39) k exp(−kx) dx over [0, 39].
    const double k = extinction, left = std::exp(-39 * k);
    const double truth = 2.0 / 39 * ((1 - left) / k - 39 * left);
    EXPECT_EQ(light.transmittance == 0, left < kLeastTransmittance);
    ended += light.transmittance == 0;
    const double error = std::abs(light.colour.x - truth);
    double& most = light.transmittance == 0 ? largest : largestOfWhole;
    most = std::max(most, error);
  }
  EXPECT_GT(ended, 20u);
  EXPECT_LT(largest, measured(2.21e-3, 2 * kLeastTransmittance));
  EXPECT_LT(largestOfWhole, measured(4.19e-4));
}

}  // namespace direct_volume_test
