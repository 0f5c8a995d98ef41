#include "mapping/placement/decal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/surface_walk.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"
#include "tests/support/threads.h"

namespace decal_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::LayerScheme;
using mapping::makeDecal;
using mapping::ParticleLayer;
using mapping::PatchOptions;
using mapping::PatchResult;

constexpr double kPi = std::numbers::pi;
const PatchOptions kThin = {.layers = 2, .scheme = LayerScheme::Conforming};

/// Parameter from −1 to 1.
double shareOf(std::size_t i, std::size_t count) {
  return 2 * static_cast<double>(i) / static_cast<double>(count - 1) - 1;
}

/// Calls visit(u, v, position) for u and v from −radius to radius.
template <typename Visit>
void forEachParticle(const ParticleLayer& layer, double radius, const Visit& visit) {
  for (std::size_t j = 0; j < layer.rows; ++j)
    for (std::size_t i = 0; i < layer.columns; ++i)
      visit(radius * shareOf(i, layer.columns), radius * shareOf(j, layer.rows), layer.at(i, j));
}

NarrowBand slab(double voxel = 0.1) {
  return support::sampleBand([](const V3d& p) { return p.z; }, {V3d(-2, -2, -0.4), V3d(2, 2, 0.4)},
                             voxel, 6);
}

TEST(Decal, IsTheIdentityOnAPlane) {
  const PatchResult result = makeDecal(slab(), V3d(0.2, -0.1, 0.3), V3d(3, 4, 7), 0.7, 0.3,
                                       {.layers = 3, .scheme = LayerScheme::Conforming});
  for (const ParticleLayer& layer : result.patch.layers)
    forEachParticle(layer, 0.7, [&](double u, double v, const V3d& p) {
      const V3d exact = V3d(0.2, -0.1, layer.height) + V3d(0.6, 0.8, 0) * u + V3d(-0.8, 0.6, 0) * v;
      EXPECT_LT((p - exact).length(), support::measured(7.45e-9));
    });
  EXPECT_NEAR(result.report.uLength, 1.4, support::doubleRounding(6));
  EXPECT_FALSE(result.patch.mirrored);
}

TEST(Decal, KeepsDistancesAndAnglesOnASphere) {
  // Up to 115 degrees from the centre, at the corners.
  for (const double voxel : {0.1, 0.05}) {
    const NarrowBand ball = support::makeBall(1, voxel);
    const V3d at = V3d(1, 2, 2) / 3.0, direction(1, 0.5, -1);  // perpendicular
    const double radius = 1.42;
    const PatchResult result = makeDecal(ball, at, direction, radius, 0.2, kThin);
    const V3d u = direction.normalized(), v = at.cross(u);
    double distance = 0, angle = 0;
    forEachParticle(result.patch.layers.front(), radius, [&](double x, double y, const V3d& p) {
      const double length = std::hypot(x, y);
      if (length < 1e-9) return;
      distance = std::max(distance, std::abs(std::acos(p.dot(at)) / length - 1));
      const V3d exact = at * std::cos(length) + (u * x + v * y) * (std::sin(length) / length);
      angle = std::max(angle, std::acos(std::min(1.0, p.dot(exact) / p.length())) / length);
    });
    EXPECT_LT(distance, support::measured(0.00386, 0.005) * voxel * voxel / 0.01)
        << voxel;  // second order
    EXPECT_LT(angle, support::measured(2.79e-4) * voxel * voxel / 0.01) << voxel;
  }
}

TEST(Decal, UnrollsACylinder) {
  const NarrowBand pipe = support::sampleBand([](const V3d& p) { return std::hypot(p.x, p.y) - 1; },
                                              {V3d(-1, -1, -4), V3d(1, 1, 4)}, 0.1);
  const double c = std::cos(0.3), s = std::sin(0.3);
  const PatchResult result = makeDecal(pipe, V3d(1, 0, 0), V3d(0.4, c, s), 2.2, 0.2, kThin);
  forEachParticle(result.patch.layers.front(), 2.2, [&](double u, double v, const V3d& p) {
    const double around = u * c - v * s, along = u * s + v * c;
    EXPECT_LT((p - V3d(std::cos(around), std::sin(around), along)).length(),
              support::measured(8.22e-4));
  });
}

TEST(Decal, UnfoldsAnEdge) {
  // A roof with a right angle along y. Beyond the edge the plane continues as if it were flat.
  const NarrowBand roof = support::sampleBand(
      [](const V3d& p) { return std::max(p.x + p.z, p.z - p.x) * std::sqrt(0.5); },
      {V3d(-2), V3d(2)}, 0.05);
  const double h = std::sqrt(0.5), away = 0.4, radius = 0.8;
  const V3d at(-away * h, 0, -away * h), up(h, 0, h);
  const double c = std::cos(0.5), s = std::sin(0.5);
  const PatchResult result =
      makeDecal(roof, at, up * c + V3d(0, s, 0), radius, 0.2,
                {.layers = 2, .scheme = LayerScheme::Spline, .spacing = 0.1});
  double worst = 0;
  forEachParticle(result.patch.layers.front(), radius, [&](double u, double v, const V3d& p) {
    const double across = u * c - v * s, along = u * s + v * c;
    const double beyond = across - away;
    V3d exact = at + up * across + V3d(0, along, 0);
    if (beyond > 0) exact = at + up * away + V3d(h, 0, -h) * beyond + V3d(0, along, 0);
    worst = std::max(worst, (p - exact).length());
  });
  EXPECT_LT(worst, support::measured(0.12) * 0.05);
}

TEST(Decal, TransportsItsFrameByTheLeastRotation) {
  // Around a right-angled corner of a box the angles of the faces are kept.
  const V3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const double c = std::cos(0.4), s = std::sin(0.4);
  const V3d over = mapping::carried(x * c + y * s, z, x);
  EXPECT_LT((over - (-z * c + y * s)).length(), support::doubleRounding(4));
  EXPECT_LT((mapping::carried(x, z, z) - x).length(), support::doubleRounding(4));
}

TEST(Decal, LayersOfReducedDistortionGrowWithTheSurface) {
  const NarrowBand ball = support::makeBall(1, 0.05, 16);
  const PatchResult result = makeDecal(ball, V3d(0, 0, 1), V3d(1, 0, 0), 0.6, 0.5, {.layers = 3});
  ASSERT_EQ(result.patch.layers.size(), 3u);
  for (const ParticleLayer& layer : result.patch.layers) {
    EXPECT_NEAR(layer.height, 0.5 * layer.w, support::doubleRounding(4));
    const double r = 1 + layer.height;
    forEachParticle(layer, 0.6 * r, [&](double u, double v, const V3d& p) {
      const double length = std::hypot(u, v);
      EXPECT_NEAR(p.length(), r, support::measured(9.91e-5) * 0.05);
      EXPECT_NEAR(std::acos(std::min(1.0, p.z / p.length())) * r, length,
                  support::measured(7.84e-5) * r);
    });
  }
}

TEST(Decal, MirroredHasTheOppositeOrientation) {
  PatchOptions options = kThin;
  const PatchResult straight = makeDecal(slab(), V3d(0), V3d(1, 0, 0), 0.6, 0.3, options);
  options.mirror = true;
  const PatchResult mirrored = makeDecal(slab(), V3d(0), V3d(1, 0, 0), 0.6, 0.3, options);
  EXPECT_TRUE(mirrored.patch.mirrored);
  const ParticleLayer &a = straight.patch.layers[0], &b = mirrored.patch.layers[0];
  EXPECT_LT((a.at(0, 0) - b.at(0, b.rows - 1)).length(), support::doubleRounding(4));
}

TEST(Decal, SupportsMapsLikeAnyPatch) {
  const PatchResult result = makeDecal(support::makeBall(1, 0.05, 12), V3d(0, 0, 1), V3d(1, 0, 0),
                                       0.5, 0.3, {.layers = 4, .spacing = 0.1});
  const mapping::PrismMap map(result.patch, {});
  const ParticleLayer& layer = result.patch.layers[1];
  forEachParticle(layer, 1, [&](double u, double v, const V3d& p) {
    if (std::max(std::abs(u), std::abs(v)) > 0.99) return;  // the border belongs to two cells
    EXPECT_LT((map(p) - V3d((u + 1) / 2, (v + 1) / 2, layer.w)).length(),
              support::doubleRounding(2));
  });
}

TEST(Decal, GivesTheSameBitsForAnyNumberOfThreads) {
  const NarrowBand ball = support::makeBall(1, 0.1);
  const auto make = [&] { return makeDecal(ball, V3d(0, 0, 1), V3d(1, 1, 0), 0.8, 0.2, kThin); };
  const PatchResult many = support::onThreads(8, make);
  const PatchResult one = support::onThreads(1, make);
  EXPECT_EQ(many.patch.layers[1].positions, one.patch.layers[1].positions);
  EXPECT_EQ(many.patch.layers[1].rim, one.patch.layers[1].rim);
}

TEST(Decal, HasTheSameShapeFarFromTheOrigin) {
  const V3d away(1e6, -1e6, 1e6);
  const NarrowBand near = levelset::makeSphere(10, V3d(0), 1),
                   far = levelset::makeSphere(10, away, 1);
  const ParticleLayer a = makeDecal(near, V3d(0, 0, 10), V3d(1, 0, 0), 9, 2, kThin).patch.layers[0];
  const ParticleLayer b =
      makeDecal(far, away + V3d(0, 0, 10), V3d(1, 0, 0), 9, 2, kThin).patch.layers[0];
  ASSERT_EQ(a.positions.size(), b.positions.size());
  for (std::size_t n = 0; n < a.positions.size(); ++n)
    EXPECT_LT((b.positions[n] - away - a.positions[n]).length(), support::measured(5.63e-10));
}

TEST(Decal, RefusesADirectionAlongTheNormal) {
  const NarrowBand band = slab();
  EXPECT_THROW((void)makeDecal(band, V3d(0), V3d(0, 0, 1), 0.5, 0.2), levelset::UsageError);
  EXPECT_THROW((void)makeDecal(band, V3d(0), V3d(0.01, 0, -1), 0.5, 0.2), levelset::UsageError);
  EXPECT_THROW((void)makeDecal(band, V3d(0), V3d(0), 0.5, 0.2), levelset::UsageError);
  EXPECT_THROW((void)makeDecal(band, V3d(0), V3d(NAN, 1, 0), 0.5, 0.2), levelset::UsageError);
  EXPECT_THROW((void)makeDecal(band, V3d(NAN), V3d(1, 0, 0), 0.5, 0.2), levelset::UsageError);
}

TEST(Decal, RefusesInvalidLengths) {
  const NarrowBand band = slab();
  const V3d x(1, 0, 0);
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW((void)makeDecal(band, V3d(0), x, bad, 0.2), levelset::UsageError);
    EXPECT_THROW((void)makeDecal(band, V3d(0), x, 0.5, bad), levelset::UsageError);
  }
  EXPECT_THROW((void)makeDecal(band, V3d(0), x, 0.15, 0.2), levelset::InvalidInput);
  EXPECT_THROW((void)makeDecal(band, V3d(0), x, 1e3, 0.2), levelset::InvalidInput);
  EXPECT_THROW((void)makeDecal(NarrowBand(), V3d(0), x, 0.5, 0.2), levelset::InvalidInput);
  EXPECT_THROW((void)makeDecal(band, V3d(0), x, 0.5, 0.2, {.spacing = 1e-5}),
               levelset::ResourceLimit);
}

/// The radius at the end of an error message.
double advisedRadius(const std::string& message) {
  const std::string words = "use a radius below ";
  const std::size_t at = message.rfind(words);
  return at == std::string::npos ? 0 : std::stod(message.substr(at + words.size()));
}

TEST(Decal, RefusesRadiiBeyondTheCutLocus) {
  // On a ball the geodesics from a pole meet at the other pole, half a circle away.
  PatchOptions options = kThin;
  options.spacing = 0.2;
  const NarrowBand ball = support::makeBall(1, 0.1);
  const V3d z(0, 0, 1), x(1, 0, 0);
  EXPECT_NO_THROW((void)makeDecal(ball, z, x, 2.0, 0.1, options));
  const std::string fold =
      support::refusal<levelset::Error>([&] { (void)makeDecal(ball, z, x, 2.6, 0.1, options); });
  EXPECT_GT(advisedRadius(fold), 1.5) << fold;
  EXPECT_NO_THROW((void)makeDecal(ball, z, x, 0.99 * advisedRadius(fold), 0.1, options)) << fold;

  // On a pipe they do not cross, but go around it.
  const NarrowBand pipe = support::sampleBand([](const V3d& p) { return std::hypot(p.x, p.y) - 1; },
                                              {V3d(-1, -1, -5), V3d(1, 1, 5)}, 0.1);
  EXPECT_NO_THROW((void)makeDecal(pipe, x, V3d(0, 1, 0), 0.93 * kPi, 0.1, options));
  const std::string round = support::refusal<levelset::Error>(
      [&] { (void)makeDecal(pipe, x, V3d(0, 1, 0), 1.15 * kPi, 0.1, options); });
  EXPECT_NE(round.find("overlaps itself"), std::string::npos) << round;
  EXPECT_GT(advisedRadius(round), 0.75 * kPi) << round;
  EXPECT_NO_THROW((void)makeDecal(pipe, x, V3d(0, 1, 0), 0.99 * advisedRadius(round), 0.1, options))
      << round;
}

TEST(Decal, RefusesToLeaveTheSurface) {
  const NarrowBand band = slab();  // ends some voxels beyond x, y = ±2
  const std::string message = support::refusal<levelset::Error>(
      [&] { (void)makeDecal(band, V3d(0), V3d(1, 0, 0), 3, 0.2, kThin); });
  EXPECT_NE(message.find("breaks off"), std::string::npos) << message;
  const double advised = advisedRadius(message);
  EXPECT_GT(advised, 1.5) << message;
  EXPECT_LT(advised, 2.9) << message;
  EXPECT_NO_THROW((void)makeDecal(band, V3d(0), V3d(1, 0, 0), 0.95 * advised, 0.2, kThin));
}

TEST(Decal, GoesAroundAnEarThatItsParticlesResolve) {
  // A plate of thickness 6 voxels with a round edge. The centre is 0.4 from the beginning of the
  // edge.
  const double voxel = 0.05, half = 0.15;
  const NarrowBand plate = support::sampleBand(
      [=](const V3d& p) {
        const V3d q(std::max(0.0, p.x - 1), 0, p.z);
        return q.length() - half;
      },
      {V3d(-2, -1.5, -half), V3d(1.2, 1.5, half)}, voxel);
  const V3d at(0.6, 0, half), x(1, 0, 0);
  const PatchResult fine = makeDecal(
      plate, at, x, 1.2, 0.05, {.layers = 2, .scheme = LayerScheme::Conforming, .spacing = 0.06});
  const ParticleLayer& layer = fine.patch.layers.front();
  const V3d end = layer.at(layer.columns - 1, layer.rows / 2);
  // 0.4 to the edge, half a circle around it, and the rest back below.
  EXPECT_NEAR(end.z, -half, support::rounding(0.8));
  EXPECT_NEAR(end.x, 1 - (1.2 - 0.4 - kPi * half), support::measured(7.57e-5));
  const std::string coarse = support::refusal<levelset::Error>([&] {
    (void)makeDecal(plate, at, x, 1, 0.05,
                    {.layers = 2, .scheme = LayerScheme::Conforming, .spacing = 0.5});
  });
  EXPECT_NE(coarse.find("thinner than its particle spacing"), std::string::npos) << coarse;
}

}  // namespace decal_test
