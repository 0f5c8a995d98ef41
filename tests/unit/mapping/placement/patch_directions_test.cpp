// Patches whose corners rise in given directions [Brodersen07 fig. 8.4].

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "levelset/error.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace patch_directions_test {

using Imath::V3d;
using levelset::UsageError;
using mapping::LayerScheme;
using mapping::makePatch;
using mapping::ParticleLayer;
using mapping::Patch;
using mapping::PatchOptions;

constexpr double kVoxel = 0.05, kHeight = 0.4;

levelset::NarrowBand ball() {
  return support::makeBall(1, kVoxel);
}

std::array<V3d, 4> corners() {
  const double side = 0.5, up = std::sqrt(1 - 2 * side * side);
  return support::square(side, up);
}

std::array<V3d, 4> cornersOf(const ParticleLayer& layer) {
  return {layer.at(0, 0), layer.at(layer.columns - 1, 0),
          layer.at(layer.columns - 1, layer.rows - 1), layer.at(0, layer.rows - 1)};
}

void expectCornersRise(const Patch& patch, const std::array<V3d, 4>& directions) {
  for (const ParticleLayer& layer : patch.layers) {
    const std::array<V3d, 4> at = cornersOf(layer);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(at[i].length(), 1 + layer.height, support::measured(1.33e-5) * kHeight) << i;
      const V3d way = at[i] - patch.corners[i], unit = directions[i].normalized();
      EXPECT_LE((way - unit * way.dot(unit)).length(), support::measured(1.09e-8))
          << i << " at " << layer.height;
    }
  }
}

TEST(PatchDirections, ParallelCornersRiseAlongTheNormalInTheMiddle) {
  const Patch patch = makePatch(ball(), corners(), kHeight, {.parallel = true}).patch;
  const V3d up(0, 0, 1);
  expectCornersRise(patch, {up, up, up, up});
  // The layers do not spread: their corners stay above each other. By default their distance would
  // be 1.4 times as large.
  const Patch spread = makePatch(ball(), corners(), kHeight).patch;
  const auto width = [](const Patch& p) {
    const std::array<V3d, 4> at = cornersOf(p.layers.back());
    return (at[1] - at[0]).length();
  };
  EXPECT_NEAR(width(patch), 1, support::measured(2.01e-6));
  EXPECT_NEAR(width(spread), 1 + kHeight, support::measured(1.6e-6));
}

TEST(PatchDirections, OneForAllOrOneForEachCorner) {
  const V3d leaning(0.3, -0.1, 1);
  expectCornersRise(makePatch(ball(), corners(), kHeight, {.directions = {leaning}}).patch,
                    {leaning, leaning, leaning, leaning});
  const std::array<V3d, 4> own = {V3d(-0.2, 0, 1), V3d(1, -1, 1), V3d(0.4, 0.6, 0.7),
                                  V3d(0, 0.2, 2)};
  expectCornersRise(
      makePatch(ball(), corners(), kHeight, {.directions = {own[0], own[1], own[2], own[3]}}).patch,
      own);
}

TEST(PatchDirections, ShearAPlane) {
  const levelset::NarrowBand plane = support::sampleBand([](const V3d& p) { return p.z; },
                                                         {V3d(-2, -2, -0.5), V3d(2, 2, 0.5)}, 0.1);
  const Patch patch =
      makePatch(plane, support::square(0.5), 0.8, {.directions = {V3d(0.5, 0, 1)}}).patch;
  const ParticleLayer& ground = patch.layers.front();
  for (const ParticleLayer& layer : patch.layers) {
    ASSERT_EQ(layer.columns, ground.columns);
    for (std::size_t n = 0; n < layer.positions.size(); ++n)
      EXPECT_LE((layer.positions[n] - ground.positions[n] - V3d(0.5, 0, 1) * layer.height).length(),
                support::rounding(0.2));
  }
}

TEST(PatchDirections, MovePointsOnTheSidesToo) {
  PatchOptions options{.parallel = true};
  options.sides[0] = {V3d(0, -0.75, std::sqrt(1 - 0.75 * 0.75))};
  const Patch patch = makePatch(ball(), corners(), kHeight, options).patch;
  const ParticleLayer& top = patch.layers.back();
  double nearest = HUGE_VAL;
  for (std::size_t i = 0; i < top.columns; ++i)
    nearest = std::min(nearest, std::hypot(top.at(i, 0).x, top.at(i, 0).y + 0.75));
  EXPECT_LE(nearest, support::rounding(25));
}

TEST(PatchDirections, RefuseInvalidDirections) {
  const auto refusal = [](const PatchOptions& options) {
    return support::refusal<UsageError>(
        [&] { (void)makePatch(ball(), corners(), kHeight, options); });
  };
  EXPECT_NE(refusal({.directions = {V3d(0)}}).find("nonzero length"), std::string::npos);
  EXPECT_NE(refusal({.directions = {V3d(0, NAN, 1)}}).find("nonzero length"), std::string::npos);
  EXPECT_NE(refusal({.directions = {V3d(1, 0, 0)}}).find("at corner 0"), std::string::npos);
  EXPECT_NE(refusal({.directions = {V3d(0, 0, 1), V3d(0, 0, 1)}}).find("four"), std::string::npos);
  EXPECT_NE(refusal({.directions = {V3d(0, 0, 1)}, .parallel = true}).find("exclude each other"),
            std::string::npos);
  EXPECT_NE(refusal({.scheme = LayerScheme::Conforming, .parallel = true}).find("reduced"),
            std::string::npos);
}

}  // namespace patch_directions_test
