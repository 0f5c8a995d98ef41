#include "mapping/patches/travel_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "mapping/layers/layer_schemes.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace travel_guard_test {

using Imath::V3d;
using mapping::LayerScheme;
using mapping::ParticleLayer;
using mapping::Patch;
using mapping::PatchResult;
using mapping::TravelGuard;

constexpr double kDiameter = 0.1;

double closest(const std::vector<V3d>& places) {
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (places[i] - places[j]).length());
  return least;
}

TEST(TravelGuard, LetsTouchingParticlesMoveOnTogether) {
  // At a distance of 1, each particle would pass the other in one step, by far.
  const std::vector<V3d> places = {V3d(0), V3d(1, 0, 0)};
  std::vector<V3d> moves = {V3d(6, 0, 0), V3d(-3, 0, 0)};
  TravelGuard guard(kDiameter, 2);
  guard.limit(places, moves);
  // They touch after a tenth of the step. Then both move on with the mean of the two speeds.
  EXPECT_NEAR(moves[0].x, 0.6 + 0.9 * 1.5, support::doubleRounding(1.5));
  EXPECT_NEAR(moves[1].x, -0.3 + 0.9 * 1.5, support::doubleRounding(5));
  EXPECT_EQ(guard.slowed(), (std::vector<char>{1, 1}));
  // Motion along the contact is kept.
  moves = {V3d(0.9, 0, 2), V3d(0, 0, 2)};
  guard.limit(places, moves);
  EXPECT_EQ(moves[1], V3d(0, 0, 2));
  moves = {V3d(1, 0, 2), V3d(-1, 0, 2)};
  guard.limit(places, moves);
  EXPECT_NEAR(moves[0].x, 0.45, support::doubleRounding(1));
  EXPECT_NEAR(moves[1].x, -0.45, support::doubleRounding(1));
  EXPECT_EQ(moves[0].z, 2);
  // They pass each other at more than the diameter, or one follows the other: no contact.
  moves = {V3d(1, 0, 0), V3d(-1, 0.2, 0)};
  TravelGuard beside(kDiameter, 2);
  beside.limit(std::vector<V3d>{V3d(0), V3d(1, 0.05, 0)}, moves);
  EXPECT_EQ(moves[0], V3d(1, 0, 0));
  moves = {V3d(5, 0, 0), V3d(5, 0, 0)};
  beside.limit(places, moves);
  EXPECT_EQ(moves[0], V3d(5, 0, 0));
  EXPECT_EQ(beside.slowed(), (std::vector<char>{0, 0}));
}

TEST(TravelGuard, IgnoresADuplicateParticle) {
  std::vector<V3d> moves = {V3d(1, 1e-12, 0), V3d(1, 0, 0)};
  TravelGuard guard(kDiameter, 2);
  guard.limit(std::vector<V3d>{V3d(0), V3d(1e-9, 1e-9, 0)}, moves);
  EXPECT_EQ(moves[1], V3d(1, 0, 0));
}

TEST(TravelGuard, KeepsACrowdApartAndLeavesNoParticleBehind) {
  // A lattice that contracts towards its middle, with noise, while it moves upwards. The leading
  // particles delay the others, and all of them arrive.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-0.05, 0.05);
  std::vector<V3d> places;
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y)
      for (int z = -3; z <= 3; ++z)
        places.push_back(V3d(x, y, z) * 0.4 + V3d(noise(random), noise(random), noise(random)));
  TravelGuard guard(kDiameter, places.size());
  ASSERT_GT(closest(places), kDiameter);
  const V3d rise(0, 0, 0.3);
  V3d middle(0);
  for (int step = 0; step < 40; ++step) {
    std::vector<V3d> moves;
    for (const V3d& p : places) moves.push_back((p - middle) * -0.15 + rise);
    guard.limit(places, moves);
    for (std::size_t i = 0; i < places.size(); ++i) places[i] += moves[i];
    middle += rise;
    ASSERT_GE(closest(places), kDiameter * (1 - 1e-9)) << step;
  }
  EXPECT_GT(std::count(guard.slowed().begin(), guard.slowed().end(), 1), 300);
  for (const V3d& p : places) EXPECT_LT((p - middle).length(), support::measured(0.677));
}

TEST(TravelGuard, KeepsSplineParticlesApartWhereTheCurveTurns) {
  // The curve turns within a tenth of the patch's width. The inner particles would collide.
  const levelset::NarrowBand ground = support::sampleBand([](const V3d& p) { return p.z; },
                                                          {V3d(-3, -3, -0.5), V3d(3, 3, 0.5)}, 0.1);
  const PatchResult made = mapping::makePatch(
      ground, support::square(1), 2,
      {.layers = 6,
       .scheme = LayerScheme::Spline,
       .spline = {V3d(0, 0, 1), V3d(0.14, 0, 1.1), V3d(0.2, 0, 1), V3d(0.2, 0, 0.05)}});
  EXPECT_GT(made.report.slowed, 0u);
  const double apart = closest(made.patch.layers.front().positions);
  for (const ParticleLayer& layer : made.patch.layers)
    EXPECT_GE(closest(layer.positions), 0.05 * apart * (1 - 1e-9)) << layer.w;
}

}  // namespace travel_guard_test
