#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "mapping/animation/animation.h"
#include "mapping/animation/frame_notes.h"
#include "tests/support/animation_scenes.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace animation_texture_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::AnimationKey;
using mapping::AnimationReport;
using mapping::CarryRule;
using mapping::Patch;
using mapping::PatchFrame;
using support::ballAt;
using support::keyOf;
using support::patchAt;

constexpr double kPi = std::numbers::pi;
constexpr double kVoxel = support::kStageVoxel;

struct Shown {
  AnimationReport report;
  std::vector<std::uint64_t> hashes;
  std::vector<bool> reused;
};
Shown show(const NarrowBand& base, const NarrowBand& texture, const std::vector<AnimationKey>& keys,
           mapping::TextureAnimationOptions options) {
  Shown shown;
  options.animation.make = support::remakePatches;
  shown.report = mapping::animateTexture(
      base, texture, keys, options,
      [&](std::size_t, const mapping::TextureResult& result, bool isReused) {
        shown.hashes.push_back(result.band.contentHash());
        shown.reused.push_back(isReused);
      });
  return shown;
}

mapping::TextureOptions coarse() {
  return {.map = mapping::TextureMap::Rbf, .voxelSize = kVoxel};
}

TEST(AnimateTexture, EqualsTheTextureOnItsKeysAtBothEnds) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(ball, V3d(1, 0, 0), 0.5, -kPi / 2);
  const Shown shown =
      show(ball, stud, {keyOf(a), keyOf(b, 2)}, {.animation = {.frames = 3}, .texture = coarse()});
  ASSERT_EQ(shown.hashes.size(), 3u);
  EXPECT_EQ(shown.hashes[0], mapping::mapTexture(ball, stud, a, coarse()).band.contentHash());
  EXPECT_EQ(shown.hashes[2], mapping::mapTexture(ball, stud, b, coarse()).band.contentHash());
  EXPECT_NE(shown.hashes[1], shown.hashes[0]);
  EXPECT_EQ(shown.report.reused, 0u);
}

TEST(AnimateTexture, ReusesUnchangedFrames) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  const auto textures = [](std::size_t f) { return ballAt(V3d(0), f < 2 ? 0.5 : 0.4); };
  const Shown shown = show(ball, stud, {keyOf(a)},
                           {.animation = {.frames = 4}, .texture = coarse(), .textures = textures});
  EXPECT_EQ(shown.reused, (std::vector<bool>{false, true, false, true}));
  EXPECT_EQ(shown.report.reused, 2u);
  EXPECT_EQ(shown.report.patchesMade, 0u);
  EXPECT_EQ(shown.hashes[0], shown.hashes[1]);
  EXPECT_EQ(shown.hashes[2], shown.hashes[3]);
  mapping::TextureOptions boxed = coarse();
  boxed.textureBox = stud.zeroSetBounds();
  EXPECT_EQ(shown.hashes[2], mapping::mapTexture(ball, textures(2), a, boxed).band.contentHash());
}

TEST(AnimateTexture, GivesTheSameBitsForAnyThreads) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(ball, V3d(1, 0, 0), 0.5, -kPi / 2);
  const Patch c = patchAt(ballAt(V3d(0), 1.1), V3d(1, 0, 0), 0.5, -kPi / 2);
  // Separate corners on a base at rest, entire patches on a growing base.
  std::vector<std::uint64_t> first, firstMoved;
  for (const std::size_t threads : {1, 2}) {
    support::onThreads(threads, [&] {
      mapping::TextureAnimationOptions options{.animation = {.frames = 3}, .texture = coarse()};
      const Shown stands = show(ball, stud, {keyOf(a), keyOf(b, 2)}, options);
      options.animation.carry = CarryRule::Rigid;
      options.animation.bases = [](std::size_t f) {
        return ballAt(V3d(0), 1 + 0.05 * static_cast<double>(f));
      };
      const Shown moves = show(ball, stud, {keyOf(a), keyOf(c, 2)}, options);
      if (threads == 1) {
        first = stands.hashes;
        firstMoved = moves.hashes;
      }
      EXPECT_EQ(stands.hashes, first);
      EXPECT_EQ(moves.hashes, firstMoved);
    });
  }
  EXPECT_NE(first, firstMoved);
}

TEST(AnimateTexture, ScalesTexturesThatGrowAndShrink) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  const auto textures = [](std::size_t f) { return ballAt(V3d(0), f == 1 ? 0.35 : 0.7); };
  for (const mapping::TextureMap map : {mapping::TextureMap::Rbf, mapping::TextureMap::Prism}) {
    mapping::TextureAnimationOptions options{.animation = {.frames = 3}, .texture = coarse()};
    options.animation.make = support::remakePatches;
    options.texture.map = map;
    options.texture.merge = mapping::TextureMerge::Alone;
    options.textures = textures;
    std::vector<double> tops;
    std::vector<std::uint64_t> hashes;
    const AnimationReport report =
        mapping::animateTexture(ball, stud, {keyOf(a)}, options,
                                [&](std::size_t, const mapping::TextureResult& result, bool) {
                                  tops.push_back(result.band.zeroSetBounds().max.z);
                                  hashes.push_back(result.band.contentHash());
                                });
    EXPECT_EQ(hashes[0], mapping::mapTexture(ball, stud, a, options.texture).band.contentHash());
    EXPECT_LT(tops[1], tops[0] - 0.3 * kVoxel);  // by 15 % of a height of 3 voxels
    if (map == mapping::TextureMap::Rbf) {
      EXPECT_GT(tops[2], tops[0] + 0.3 * kVoxel);
      EXPECT_TRUE(report.warnings.empty());
    } else {  // the prism map ends there
      EXPECT_NEAR(tops[2], tops[0], support::rounding(1.25) * kVoxel);
      ASSERT_EQ(report.warnings.size(), 1u);
      EXPECT_NE(report.warnings[0].find("frame 2: the texture extends beyond"), std::string::npos);
    }
    // A given box is kept.
    options.texture.textureBox = ballAt(V3d(0), 0.7).zeroSetBounds();
    const AnimationReport given = mapping::animateTexture(ball, stud, {keyOf(a)}, options,
                                                          [](std::size_t, const auto&, bool) {});
    EXPECT_TRUE(given.warnings.empty());
  }
}

TEST(AnimateTexture, ImprovesPatchesOnceWhileTheyAreAtRest) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  std::vector<std::size_t> improved;
  bool hasProgress = true;
  mapping::TextureAnimationOptions options{.animation = {.frames = 4}, .texture = coarse()};
  options.animation.bases = [](std::size_t f) { return ballAt(V3d(0), f < 3 ? 1 : 1.05); };
  options.animation.progress = [](double) { return true; };
  options.textures = [](std::size_t f) {
    return ballAt(V3d(0), 0.5 - 0.05 * static_cast<double>(f));
  };
  options.improve = [&](const PatchFrame& frame) {
    improved.push_back(frame.index);
    hasProgress = hasProgress && frame.progress;
    return frame.patches;
  };
  const Shown shown = show(ball, stud, {keyOf(a)}, options);
  EXPECT_EQ(shown.report.reused, 0u);
  EXPECT_EQ(improved, (std::vector<std::size_t>{0, 3}));
  EXPECT_TRUE(hasProgress);
  // The same result as without improvement, because it changed nothing.
  options.improve = {};
  EXPECT_EQ(show(ball, stud, {keyOf(a)}, options).hashes, shown.hashes);
}

TEST(AnimateTexture, ReportsNotesOfItsFrames) {
  // One of two patches folds in every frame.
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1));
  Patch folded = patchAt(ball, V3d(1, 0, 0));
  for (V3d& p : folded.layers.back().positions) p *= 0.5;
  AnimationKey key{{a, folded}, {mapping::outlineOf(a), mapping::outlineOf(folded)}, 0};
  mapping::TextureAnimationOptions options{.animation = {.frames = 3}, .texture = coarse()};
  options.texture.skipFolds = true;
  options.textures = [](std::size_t f) {
    return ballAt(V3d(0), 0.5 - 0.05 * static_cast<double>(f));
  };
  const AnimationReport report = show(ball, stud, {key}, options).report;
  std::size_t told = 0;
  for (const std::string& note : report.notes)
    told += note.find("1 of 2 patches fold and were left out") != std::string::npos;
  EXPECT_EQ(told, 1u);
  ASSERT_FALSE(report.notes.empty());
  EXPECT_TRUE(report.notes.front().starts_with("frame 0: ")) << report.notes.front();
  for (const mapping::FrameReport& frame : report.frames) EXPECT_EQ(frame.skipped, 1u);
}

TEST(FrameNotes, ReportsEachNoteForItsFirstFrame) {
  mapping::FrameNotes notes;
  std::vector<std::string> told;
  notes.add(2, "3 of 5 patches fold", told);
  notes.add(3, "1 of 5 patches fold", told);
  notes.add(4, "0.2 of the volume is 1e-05 wide, see 7", told);
  notes.add(5, "12 of the volume is 3.5 wide, see 9", told);
  EXPECT_EQ(told, (std::vector<std::string>{"frame 2: 3 of 5 patches fold",
                                            "frame 4: 0.2 of the volume is 1e-05 wide, see 7"}));
}

TEST(AnimateTexture, StopsWhenCancelled) {
  const NarrowBand ball = ballAt(V3d(0)), stud = ballAt(V3d(0), 0.5);
  const Patch a = patchAt(ball, V3d(0, 0, 1)), b = patchAt(ball, V3d(1, 0, 0), 0.5, -kPi / 2);
  double last = 0;
  mapping::TextureAnimationOptions options{.animation = {.frames = 3}, .texture = coarse()};
  options.animation.make = support::remakePatches;
  options.animation.progress = [&](double done) {
    EXPECT_GE(done, last - 1e-12);
    last = done;
    return done < 0.5;
  };
  std::size_t written = 0;
  EXPECT_THROW((void)mapping::animateTexture(ball, stud, {keyOf(a), keyOf(b, 2)}, options,
                                             [&](auto&&...) { ++written; }),
               levelset::Cancelled);
  EXPECT_EQ(written, 1u);
  options.animation.progress = [&](double) { return true; };
  (void)mapping::animateTexture(ball, stud, {keyOf(a), keyOf(b, 2)}, options,
                                [&](auto&&...) { ++written; });
  EXPECT_EQ(written, 4u);
}

}  // namespace animation_texture_test
