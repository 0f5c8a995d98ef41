#include "mapping/animation/animation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <type_traits>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/animation/patch_path.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "tests/support/animation_scenes.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace animation_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::AnimationKey;
using mapping::AnimationOptions;
using mapping::CarryRule;
using mapping::Footprint;
using mapping::makePatch;
using mapping::Patch;
using mapping::PatchFrame;
using mapping::PatchPath;
using support::ballAt;
using support::keyOf;
using support::patchAt;
using support::play;
using support::Played;

constexpr double kPi = std::numbers::pi;
constexpr double kVoxel = support::kStageVoxel;

Footprint footprint(const NarrowBand& base, const V3d& at, double size = 0.6, double rotation = 0) {
  return mapping::withReach(
      base, mapping::footprintOf(base, mapping::outlineOf(patchAt(base, at, size, rotation))));
}

V3d centreOf(const Patch& patch) {
  return (patch.corners[0] + patch.corners[1] + patch.corners[2] + patch.corners[3]) / 4.0;
}

// === Footprints that follow the base

TEST(CarryFootprint, FollowsATranslationAlongItsNormal) {
  const V3d at = V3d(2, 3, 6) / 7.0;
  const NarrowBand ball = ballAt(V3d(0));
  const Footprint first = footprint(ball, at);
  Footprint rigid = first, free = first;
  const V3d step = at * 0.4 * kVoxel;
  for (int i = 1; i <= 5; ++i) {
    const NarrowBand moved = ballAt(step * i);
    rigid = mapping::carryFootprint(moved, rigid, CarryRule::Rigid);
    free = mapping::carryFootprint(moved, free, CarryRule::Corners);
  }
  double drifted = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((rigid.corners[i] - first.corners[i] - step * 5).length(),
              support::measured(4.94e-4) * kVoxel);
    drifted = std::max(drifted, (free.corners[i] - first.corners[i] - step * 5).length());
  }
  // Corners without coupling move along their own normals, and therefore apart.
  EXPECT_GT(drifted, 0.2 * kVoxel);
  EXPECT_LT(mapping::driftBetween(first, rigid).factor(), support::measured(1, 1.002));
}

TEST(CarryFootprint, FollowsTheRadiiOfAGrowingBall) {
  const Footprint first = footprint(ballAt(V3d(0)), V3d(0.3, -0.5, 0.8), 0.8);
  for (const CarryRule rule : {CarryRule::Corners, CarryRule::Rigid}) {
    Footprint now = first;
    for (int i = 1; i <= 10; ++i)
      now = mapping::carryFootprint(ballAt(V3d(0), 1 + 0.1 * i), now, rule);
    const V3d centre = first.centre.normalized() * 2;
    EXPECT_LT((now.centre - centre).length(), support::measured(7.36e-4) * kVoxel);
    if (rule == CarryRule::Corners) {
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_LT((now.corners[i] - first.corners[i].normalized() * 2).length(),
                  support::measured(0.00125) * kVoxel);
      EXPECT_NEAR(mapping::driftBetween(first, now).most, 2, support::measured(1.61e-4));
    } else {  // the shape is kept: distances from the centre are unchanged
      for (std::size_t i = 0; i < 4; ++i) {
        const double way = 2 * std::acos(now.corners[i].normalized().dot(now.centre.normalized()));
        EXPECT_NEAR(way, std::acos(first.corners[i].normalized().dot(first.centre.normalized())),
                    support::measured(5.38e-5) * kVoxel);
      }
    }
  }
}

/// Plane with a hump across it at x = `place`, close to a distance.
NarrowBand wave(double place) {
  const double height = 0.8, width = 0.5;
  const auto phi = [=](const V3d& p) {
    const double x = (p.x - place) / width, hump = height * std::exp(-x * x);
    return (p.z - hump) / std::hypot(1.0, 2 * x / width * hump);
  };
  return support::sampleBand(phi, {V3d(-2.5, -1, -0.4), V3d(2.5, 1, 1.2)}, kVoxel, 4);
}

TEST(CarryFootprint, KeepsPatchesTogetherUnderAWave) {
  // The wave drags corners along its flanks, as in the thesis. The complete patch keeps its size.
  const Footprint first = footprint(wave(-2.5), V3d(0), 0.8);
  Footprint free = first, rigid = first;
  double drifted = 0, held = 0;
  for (int i = 0; i <= 50; ++i) {
    const NarrowBand base = wave(-2.5 + 0.1 * i);
    free = mapping::carryFootprint(base, free, CarryRule::Corners);
    rigid = mapping::carryFootprint(base, rigid, CarryRule::Rigid);
    const mapping::SurfaceField field(base);
    const auto change = [&](const Footprint& f) {
      const double side =
          mapping::pathLength(mapping::geodesic(field, 0, f.corners[0], f.corners[1]));
      return std::abs(std::log(side / 0.8));
    };
    drifted = std::max(drifted, change(free));
    held = std::max(held, change(rigid));
  }
  EXPECT_GT(drifted, 0.35);
  EXPECT_LT(held, support::measured(0.00189));
}

TEST(CarryFootprint, StaysWhereTheSurfaceMovesTangentially) {
  // A rotating ball, and the same ball on another grid. The zero set does not show the rotation.
  const NarrowBand ball = ballAt(V3d(0));
  const Footprint first = footprint(ball, V3d(0, 0, 1));
  for (const CarryRule rule : {CarryRule::Corners, CarryRule::Rigid}) {
    const Footprint now = mapping::carryFootprint(ballAt(V3d(0), 1, 0.09), first, rule);
    EXPECT_LT(mapping::farthestMove(first, now), support::measured(3.3e-4) * kVoxel);
  }
}

TEST(CarryFootprint, ReportsAMissingSurface) {
  const Footprint first = footprint(ballAt(V3d(0)), V3d(0, 0, 1));
  const NarrowBand far = ballAt(V3d(0, 0, 50));
  EXPECT_THROW((void)mapping::carryFootprint(far, first, CarryRule::Corners),
               levelset::InvalidInput);
  EXPECT_THROW((void)mapping::carryFootprint(NarrowBand(), first, CarryRule::Corners),
               levelset::InvalidInput);
}

TEST(Footprint, ComputesItsCornersFromItsCentre) {
  const NarrowBand ball = ballAt(V3d(0));
  const Footprint f = footprint(ball, V3d(0.6, 0, 0.8), 0.8);
  ASSERT_TRUE(f.reach);
  const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR((*f.reach)[i].x, 0.4 * signs[i][0], support::measured(2.45e-4) * kVoxel);
    EXPECT_NEAR((*f.reach)[i].y, 0.4 * signs[i][1], support::measured(3.16e-5) * kVoxel);
  }
}

// === Key frames

TEST(PatchPath, FollowsGreatCircles) {
  const NarrowBand ball = ballAt(V3d(0), 1, 0.05);
  const Footprint a = footprint(ball, V3d(0, 0, 1)),
                  b = footprint(ball, V3d(1, 0.2, 0.1), 0.5, 0.4);
  const PatchPath path(ball, a, b, CarryRule::Corners);
  EXPECT_TRUE(path.isAlike());
  EXPECT_EQ(path.at(0), a);
  EXPECT_EQ(path.at(1), b);
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d p = a.corners[i], q = b.corners[i];
    const double angle = std::acos(p.normalized().dot(q.normalized()));
    const V3d across = p.cross(q).normalized();
    for (int n = 1; n < 6; ++n) {
      const V3d at = path.at(n / 6.0).corners[i];
      EXPECT_NEAR(at.length(), 1, support::measured(1.02e-4) * 0.05);
      EXPECT_LT(std::abs(at.dot(across)), support::measured(5.73e-4));
      EXPECT_NEAR(std::acos(at.normalized().dot(p.normalized())), angle * n / 6,
                  support::measured(1.01e-6) * angle);
    }
  }
}

TEST(PatchPath, RotatesRigidPatchesUniformly) {
  // On a plane: a quarter turn during the motion, and twice the size at its end.
  const NarrowBand slab = support::sampleBand([](const V3d& p) { return p.z; },
                                              {V3d(-3, -3, -0.4), V3d(3, 3, 0.4)}, 0.1, 6);
  const Footprint a = footprint(slab, V3d(-1.5, 0, 0), 1),
                  b = footprint(slab, V3d(1.5, 0, 0), 2, kPi / 2);
  const PatchPath path(slab, a, b, CarryRule::Rigid);
  for (const double t : {0.25, 0.5, 0.75}) {
    const Footprint f = path.at(t);
    const double half = 0.5 * (1 + t), angle = kPi / 2 * t;
    const V3d u(std::cos(angle), std::sin(angle), 0), v(-u.y, u.x, 0);
    const V3d centre(-1.5 + 3 * t, 0, 0);
    EXPECT_LT((f.corners[0] - (centre - u * half - v * half)).length(),
              support::measured(2.45e-14) * kVoxel);
    EXPECT_LT((f.corners[1] - (centre + u * half - v * half)).length(),
              support::doubleRounding(100) * kVoxel);
    EXPECT_LT((f.corners[2] - (centre + u * half + v * half)).length(),
              support::doubleRounding(80) * kVoxel);
  }
}

NarrowBand pipe() {
  return levelset::makeCylinder(1, 6, V3d(0), V3d(0, 0, 1), kVoxel);
}

TEST(PatchPath, TakesOneSideAroundAPipe) {
  // Keys on opposite sides. Of the corners' shortest paths two go left and two go right.
  const NarrowBand base = pipe();
  const Footprint a = footprint(base, V3d(1, 0, 0)),
                  b = footprint(base, V3d(-1, 0.001, 0), 0.8, kPi);
  const mapping::SurfaceField field(base);
  double sides = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<V3d> alone = mapping::geodesic(field, 0, a.corners[i], b.corners[i]);
    ASSERT_FALSE(alone.empty());
    sides += alone[alone.size() / 2].y > 0 ? 1 : -1;
  }
  EXPECT_LT(std::abs(sides), support::rounding(1)) << "all corners take the same side on their own";
  for (const CarryRule rule : {CarryRule::Corners, CarryRule::Rigid}) {
    const PatchPath path(base, a, b, rule);
    EXPECT_TRUE(path.isAlike());
    const double side = path.at(0.5).centre.y > 0 ? 1 : -1;
    for (int n = 0; n <= 10; ++n) {
      const Footprint f = path.at(n / 10.0);
      if (n == 5) {
        for (const V3d& corner : f.corners) EXPECT_GT(corner.y * side, 0.5);
      }
      // Width interpolated over the path, around the pipe and along it.
      const double width = 0.6 + 0.2 * n / 10;
      const V3d &p = f.corners[0], &q = f.corners[1], &r = f.corners[2];
      EXPECT_NEAR(
          std::acos((p.x * q.x + p.y * q.y) / (std::hypot(p.x, p.y) * std::hypot(q.x, q.y))), width,
          support::measured(1.73e-4))
          << n;
      EXPECT_NEAR(std::abs(r.z - q.z), width, support::measured(1.32e-4)) << n;
    }
  }
}

TEST(PatchPath, StaysOnTheSideOfItsGuide) {
  const NarrowBand base = pipe();
  const Footprint a = footprint(base, V3d(1, 0, 0));
  const PatchPath left(base, a, footprint(base, V3d(-1, 0.05, 0)), CarryRule::Rigid);
  ASSERT_GT(left.at(0.5).centre.y, 0.9);
  const Footprint across = footprint(base, V3d(-1, -0.05, 0));
  EXPECT_LT(PatchPath(base, a, across, CarryRule::Rigid).at(0.5).centre.y, -0.9);
  const PatchPath guided(base, a, across, CarryRule::Rigid, left.centrePath());
  EXPECT_FALSE(guided.hasJumped());
  EXPECT_GT(guided.at(0.5).centre.y, 0.9);
}

TEST(PatchPath, RefusesAnotherSurfaceComponent) {
  const NarrowBand two = levelset::unite(ballAt(V3d(-2, 0, 0)), ballAt(V3d(2, 0, 0)));
  const Footprint a = footprint(two, V3d(-2, 0, 1)), b = footprint(two, V3d(2, 0, 1));
  EXPECT_NE(support::refusal<levelset::Error>([&] {
              PatchPath(two, a, b, CarryRule::Corners);
            }).find("the surface does not connect"),
            std::string::npos);
}

// === Frames

TEST(AnimatePatches, BeginsAndEndsOnItsKeysToTheBit) {
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(ball, V3d(1, 0, 0), 0.5, -kPi / 2),
              c = patchAt(ball, V3d(0, 1, 0), 0.4, kPi / 2);
  const Played played = play(ball, {keyOf(a), keyOf(b, 2), keyOf(c, 5)}, {.frames = 6});
  ASSERT_EQ(played.patches.size(), 6u);
  const std::pair<std::size_t, const Patch*> ends[] = {{0, &a}, {2, &b}, {5, &c}};
  for (const auto& [frame, patch] : ends)
    for (std::size_t layer = 0; layer < 2; ++layer)
      EXPECT_EQ(played.patches[frame].layers[layer].positions, patch->layers[layer].positions);
  EXPECT_EQ(played.report.patchesMade, 3u);
  EXPECT_TRUE(played.report.warnings.empty());
  // Half way from the first to the second key.
  EXPECT_LT((centreOf(played.patches[1]).normalized() - V3d(1, 0, 1).normalized()).length(),
            support::measured(0.00773, 0.01));
}

TEST(AnimatePatches, FollowsAGrowingBaseForwardsAndBackwards) {
  // The second patch is on the last, larger ball.
  const auto radius = [](std::size_t f) { return 1 + 0.05 * static_cast<double>(f); };
  const NarrowBand first = ballAt(V3d(0)), last = ballAt(V3d(0), radius(4));
  const Patch a = patchAt(first, V3d(0, 0, 1)), b = patchAt(last, V3d(1.2, 0, 0), 0.6, -kPi / 2);
  const Played played =
      play(first, {keyOf(a), keyOf(b, 4)},
           {.frames = 5, .bases = [&](std::size_t f) { return ballAt(V3d(0), radius(f)); }});
  for (std::size_t f = 0; f < 5; ++f) {
    const double angle = kPi / 2 * static_cast<double>(f) / 4;
    const V3d centre = V3d(std::sin(angle), 0, std::cos(angle)) * radius(f);
    for (const V3d& corner : played.patches[f].corners)
      EXPECT_NEAR(corner.length(), radius(f), support::measured(2.15e-4) * kVoxel) << f;
    // The great circles of the corners have a slightly different distance from each other than from
    // the middle.
    EXPECT_LT((centreOf(played.patches[f]).normalized() * radius(f) - centre).length(),
              support::measured(0.143) * kVoxel)
        << f;
  }
  EXPECT_EQ(played.patches[4].layers[0].positions, b.layers[0].positions);
}

TEST(AnimatePatches, ReusesUnchangedFrames) {
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  // Two of the bases equal their predecessors but are built anew.
  const auto bases = [](std::size_t f) { return ballAt(V3d(0), f < 2 ? 1 : 1.05); };
  const Played played = play(ball, {keyOf(a)}, {.frames = 4, .bases = bases});
  EXPECT_EQ(played.report.patchesMade, 1u);
  EXPECT_EQ(played.report.reused, 2u);
  EXPECT_FALSE(played.report.frames[1].isRemade);
  EXPECT_TRUE(played.report.frames[2].isRemade);
  EXPECT_EQ(played.patches[1].layers[1].positions, a.layers[1].positions);
  // At rest between two equal keys.
  const Played held = play(ball, {keyOf(a), keyOf(a, 3)}, {.frames = 4});
  EXPECT_EQ(held.report.patchesMade, 0u);
  EXPECT_EQ(held.report.reused, 3u);
  // A height whose rounded parts do not add up to it: 1.5 · 0.8 + 1.5 · 0.2 < 1.5.
  const Patch tall = patchAt(ball, V3d(0, 0, 1), 0.6, 0, 1.5);
  EXPECT_EQ(play(ball, {keyOf(tall), keyOf(tall, 5)}, {.frames = 6}).report.patchesMade, 0u);
}

TEST(AnimatePatches, NamesTheFrameOfAnError) {
  // A peanut that splits between the corners. In the third frame it is two balls.
  const auto base = [](double apart) {
    return levelset::unite(ballAt(V3d(-apart, 0, 0)), ballAt(V3d(apart, 0, 0)));
  };
  const NarrowBand first = base(0.7);
  const Patch a = makePatch(first,
                            {V3d(-0.7, -0.4, 0.9), V3d(0.7, -0.4, 0.9), V3d(0.7, 0.4, 0.9),
                             V3d(-0.7, 0.4, 0.9)},
                            0.2, support::thinPatch())
                      .patch;
  const auto bases = [&](std::size_t f) { return base(f < 2 ? 0.7 : 1.3); };
  const std::string torn = support::refusal<levelset::Error>(
      [&] { (void)play(first, {keyOf(a)}, {.frames = 4, .bases = bases}); });
  EXPECT_NE(torn.find("frame 2: "), std::string::npos) << torn;
  EXPECT_NE(torn.find("the same surface component"), std::string::npos) << torn;
  EXPECT_EQ(torn.find("frame"), torn.rfind("frame")) << torn;
  // No solid is left.
  const NarrowBand ball = ballAt(V3d(0));
  const std::string gone = support::refusal<levelset::Error>([&] {
    (void)play(ball, {keyOf(patchAt(ball, V3d(0, 0, 1)))},
               {.frames = 3, .bases = [&](std::size_t f) { return f < 2 ? ball : NarrowBand(); }});
  });
  EXPECT_NE(gone.find("frame 2: the base has no surface"), std::string::npos) << gone;
  // The keys are on different components.
  const NarrowBand two = base(1.3);
  std::size_t made = 0;
  const std::string apart = support::refusal<levelset::Error>([&] {
    (void)mapping::animatePatches(
        two, {keyOf(patchAt(two, V3d(-1.3, 0, 1))), keyOf(patchAt(two, V3d(1.3, 0, 1)), 3)},
        {.frames = 4, .make = support::remakePatches}, [&](const PatchFrame&) { ++made; });
  });
  EXPECT_EQ(made, 0u);
  EXPECT_NE(apart.find("frame 1: the surface does not connect"), std::string::npos) << apart;
}

TEST(AnimatePatches, WarnsOfDriftingPatches) {
  // Every corner moves along its radius, so that the patch grows with the ball.
  const auto bases = [](std::size_t f) {
    return ballAt(V3d(0), 1 + 0.24 * static_cast<double>(f));
  };
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  const Played free = play(ball, {keyOf(a)}, {.frames = 5, .bases = bases});
  ASSERT_EQ(free.report.warnings.size(), 1u);
  EXPECT_NE(free.report.warnings[0].find("frame 3"), std::string::npos) << free.report.warnings[0];
  EXPECT_NEAR(free.report.frames[4].drift.most, 1.96, support::measured(2.18e-4));
  EXPECT_NEAR(free.report.frames[4].farthestMove, 0.24, support::measured(7.46e-5) * kVoxel);
  const Played rigid =
      play(ball, {keyOf(a)}, {.frames = 5, .carry = CarryRule::Rigid, .bases = bases});
  EXPECT_TRUE(rigid.report.warnings.empty());
}

TEST(AnimatePatches, WarnsOfRotatedCorners) {
  // Half a turn during the motion. The corners' own paths cross in the middle.
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1), 0.8), b = patchAt(ball, V3d(0.3, 0, 1), 0.8, 2);
  const std::vector<AnimationKey> keys = {keyOf(a), keyOf(b, 2)};
  const Played free = play(ball, keys, {.frames = 3});
  ASSERT_EQ(free.report.warnings.size(), 1u);
  EXPECT_NE(free.report.warnings[0].find("turns by 1"), std::string::npos)
      << free.report.warnings[0];
  const Played rigid = play(ball, keys, {.frames = 3, .carry = CarryRule::Rigid});
  EXPECT_TRUE(rigid.report.warnings.empty());
  const auto size = [](const Patch& patch) {
    return (patch.corners[2] - patch.corners[0]).length();
  };
  EXPECT_NEAR(size(rigid.patches[1]), size(a), support::measured(5.61e-5));
  EXPECT_LT(size(free.patches[1]), 0.7 * size(a));
}

TEST(AnimatePatches, RefusesIncompatibleKeys) {
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  const auto refusal = [&](const std::vector<AnimationKey>& keys) {
    return support::refusal<levelset::Error>([&] { (void)play(ball, keys, {.frames = 4}); });
  };
  EXPECT_NE(refusal({keyOf(a), keyOf(a, 4)}).find("patch 2 is at frame 4"), std::string::npos);
  EXPECT_NE(refusal({keyOf(a), keyOf(a, 2), keyOf(a, 2)}).find("patch 3"), std::string::npos);
  EXPECT_NE(refusal({keyOf(a, 1)}).find("frame 0"), std::string::npos);
  AnimationKey two = keyOf(a, 3);
  two.outlines.push_back(two.outlines.front());
  EXPECT_NE(refusal({keyOf(a), two}).find("patch 2 has 2 outlines"), std::string::npos);
  AnimationKey mirrored = keyOf(a, 3);
  mirrored.patches[0].mirrored = true;
  EXPECT_NE(refusal({keyOf(a), mirrored}).find("either patch 2 or the first patch is mirrored"),
            std::string::npos);
  // Tiles share one outline, and each of them counts.
  AnimationKey tiles = keyOf(a), others = keyOf(a, 3);
  tiles.patches.push_back(a);
  EXPECT_NE(refusal({tiles, others}).find("a set of 1 tiles, the first patch a set of 2"),
            std::string::npos);
  others.patches.push_back(a);
  others.patches[1].mirrored = true;
  EXPECT_NE(refusal({tiles, others}).find("in member 2"), std::string::npos);
  // A different number of layers makes frames jump, so it is reported.
  mapping::PatchOptions finer = support::thinPatch();
  finer.layers = 3;
  const Patch b = makePatch(ball, a.corners, a.height, finer).patch;
  const Played played = play(ball, {keyOf(a), keyOf(b, 3)}, {.frames = 4});
  ASSERT_EQ(played.report.warnings.size(), 1u);
  EXPECT_NE(played.report.warnings[0].find("3 layers and the first patch 2"), std::string::npos);
}

TEST(AnimatePatches, RefusesKeysOfAnotherBaseBeforeTheFirstFrame) {
  const NarrowBand ball = ballAt(V3d(0)), other = ballAt(V3d(0), 1.4);
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(other, V3d(1.4, 0, 0));
  std::size_t made = 0;
  const auto refusal = [&](const std::vector<AnimationKey>& keys,
                           const mapping::BandFrames& bases) {
    return support::refusal<levelset::Error>([&] {
      (void)mapping::animatePatches(ball, keys,
                                    {.frames = 4, .bases = bases, .make = support::remakePatches},
                                    [&](const PatchFrame&) { ++made; });
    });
  };
  const auto bases = [](std::size_t f) {
    return ballAt(V3d(0), 1 + 0.02 * static_cast<double>(f));
  };
  const std::string moving = refusal({keyOf(a), keyOf(b, 3)}, bases);
  EXPECT_TRUE(moving.starts_with("frame 3: the patch does not lie on the base")) << moving;
  const std::string still = refusal({keyOf(a), keyOf(a, 1), keyOf(b, 3)}, {});
  EXPECT_TRUE(still.starts_with("frame 3: the patch does not lie on the base")) << still;
  EXPECT_EQ(made, 0u);
}

TEST(AnimatePatches, NamesTheFrameOnceForAnyError) {
  const NarrowBand ball = ballAt(V3d(0));
  const AnimationKey key = keyOf(patchAt(ball, V3d(0, 0, 1)));
  const auto throwing = [&](const auto& error) {
    return mapping::animatePatches(ball, {key}, {.frames = 3}, [&](const PatchFrame& frame) {
      if (frame.index == 1) throw error;
    });
  };
  const auto expect = [&](const auto& error, const std::string& sentence) {
    using Thrown = std::decay_t<decltype(error)>;
    EXPECT_THROW((void)throwing(error), Thrown);
    EXPECT_EQ(support::refusal<levelset::Error>([&] { (void)throwing(error); }), sentence);
  };
  expect(levelset::InvalidInput("a"), "frame 1: a");
  expect(levelset::ResourceLimit("map: b"), "frame 1: map: b");
  expect(levelset::IoError("c"), "frame 1: c");
  expect(levelset::NumericalError("d"), "frame 1: d");
  expect(levelset::InvalidInput("frame 2: e"), "frame 2: e");
  expect(levelset::UsageError("f"), "f");
  expect(levelset::Cancelled("g"), "g");
}

TEST(AnimatePatches, HoldsOneBaseBesideTheFirst) {
  const NarrowBand first = ballAt(V3d(0)), last = ballAt(V3d(0), 1.12);
  const Patch a = patchAt(first, V3d(0, 0, 1)), b = patchAt(last, V3d(1.12, 0, 0));
  std::weak_ptr<const void> before;
  std::size_t read = 0;
  const auto bases = [&](std::size_t f) {
    EXPECT_TRUE(before.expired()) << f;
    NarrowBand base = ballAt(V3d(0), 1 + 0.04 * static_cast<double>(f));
    before = base.shared();
    ++read;
    return base;
  };
  (void)play(first, {keyOf(a), keyOf(b, 3)}, {.frames = 4, .bases = bases});
  EXPECT_GE(read, 5u);
}

TEST(AnimatePatches, IncludesTheDriftOfTheGoal) {
  // The ball grows by a quarter per frame. The goal is 5/8 as large on the second ball.
  const NarrowBand first = ballAt(V3d(0)), last = ballAt(V3d(0), 2);
  const Patch a = patchAt(first, V3d(0, 0, 1)), b = patchAt(last, V3d(2, 0, 0), 1.2);
  const auto bases = [](std::size_t f) {
    return ballAt(V3d(0), 1 + 0.25 * static_cast<double>(f));
  };
  const Played played = play(first, {keyOf(a), keyOf(b, 4)}, {.frames = 5, .bases = bases});
  EXPECT_NEAR(played.report.frames[1].drift.least, 0.625, support::measured(9.07e-5));
  EXPECT_NEAR(played.report.frames[3].drift.most, 1.75, support::measured(3.93e-4));
  EXPECT_NEAR(played.report.frames[4].drift.factor(), 1, support::doubleRounding(4));
}

TEST(AnimatePatches, CanBeCancelledBetweenBasesOnItsWayBack) {
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(ball, V3d(1, 0, 0));
  std::size_t read = 0;
  AnimationOptions options{.frames = 10};
  options.bases = [&](std::size_t) {
    ++read;
    return ball;
  };
  options.progress = [&](double) { return read < 3; };
  EXPECT_THROW((void)play(ball, {keyOf(a), keyOf(b, 9)}, options), levelset::Cancelled);
  EXPECT_EQ(read, 3u);
}

TEST(AnimatePatches, WarnsOncePerKeyOfManyPatches) {
  const NarrowBand ball = ballAt(V3d(0));
  const auto pair = [&](double turn, std::size_t frame) {
    const Patch a = patchAt(ball, V3d(0.1 * turn, 0, 1), 0.6, turn),
                b = patchAt(ball, V3d(0.1 * turn, 0, -1), 0.6, turn);
    return AnimationKey{{a, b}, {mapping::outlineOf(a), mapping::outlineOf(b)}, frame};
  };
  const Played played = play(ball, {pair(0, 0), pair(2, 2), pair(0, 4)}, {.frames = 5});
  std::size_t turns = 0;
  for (const std::string& warning : played.report.warnings)
    turns += warning.find("the patch turns by") != std::string::npos;
  EXPECT_EQ(turns, 2u);
}

TEST(AnimatePatches, PlaysOneFrame) {
  const NarrowBand ball = ballAt(V3d(0));
  const Played played = play(ball, {keyOf(patchAt(ball, V3d(0, 0, 1)))}, {.frames = 1});
  EXPECT_EQ(played.patches.size(), 1u);
  EXPECT_EQ(played.report.frames.size(), 1u);
  EXPECT_EQ(played.report.patchesMade, 0u);
}

TEST(AnimatePatches, BuildsReadPatchesWithTheSameNumberOfParticles) {
  const NarrowBand ball = ballAt(V3d(0));
  const Patch a = patchAt(ball, V3d(0, 0, 1), 0.8);
  const mapping::PatchOptions like = mapping::optionsLike(a);
  const Patch again = makePatch(ball, a.corners, a.height, like).patch;
  EXPECT_EQ(again.layers.size(), a.layers.size());
  EXPECT_EQ(again.particleCount(), a.particleCount());
}

}  // namespace animation_test
