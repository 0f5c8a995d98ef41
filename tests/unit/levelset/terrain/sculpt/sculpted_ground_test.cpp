#include "levelset/terrain/sculpt/sculpted_ground.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"

namespace sculpted_ground_test {

using levelset::BrushDab;
using levelset::BrushEffect;
using levelset::GroundEdits;
using levelset::HeightField;
using levelset::HeightPyramid;
using levelset::InvalidInput;
using levelset::SculptedGround;
using support::randomTerrain;
using support::refusal;

bool haveSameBits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

bool haveSameBits(const HeightPyramid& a, const HeightPyramid& b) {
  if (a.cells != b.cells || a.levels.size() != b.levels.size()) return false;
  for (std::size_t n = 0; n < a.levels.size(); ++n)
    if (a.levels[n].columns != b.levels[n].columns || a.levels[n].rows != b.levels[n].rows ||
        std::memcmp(a.levels[n].patches.data(), b.levels[n].patches.data(),
                    a.levels[n].patches.size() * sizeof(levelset::PyramidPatch)) != 0)
      return false;
  return true;
}

BrushDab randomDab(std::mt19937& random, const HeightField& field, double mostRadius) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  const auto effect = static_cast<BrushEffect>(random() % 5);
  return {.effect = effect,
          .center = {field.origin.x + (1.2 * unit() - 0.1) * field.columns * field.spacing.x,
                     field.origin.y + (1.2 * unit() - 0.1) * field.rows * field.spacing.y},
          .radius = 0.5 + mostRadius * unit(),
          .strength = effect == BrushEffect::Raise ? unit() - 0.5 : unit(),
          .talusDegrees = 20,
          .passes = 2,
          .seed = static_cast<std::uint32_t>(random())};
}

TEST(SculptedGround, PyramidEqualsOneThatIsBuiltAgain) {
  std::mt19937 random(7);
  // Sizes that are no multiples of patches, with and without missing samples.
  for (const auto& [columns, rows, missing, cells] :
       {std::tuple(130, 97, 0.0, 8), std::tuple(129, 129, 0.001, 16), std::tuple(51, 200, 0.0, 2),
        std::tuple(2, 70, 0.0, 16), std::tuple(300, 40, 0.02, 64)}) {
    SculptedGround ground(randomTerrain(columns, rows, missing, 3), {.cells = cells});
    EXPECT_TRUE(
        haveSameBits(ground.pyramid(), levelset::heightPyramid(ground.field(), {.cells = cells})));
    for (int n = 0; n < 40; ++n) {
      ground.apply(randomDab(random, ground.field(), 12));
      if (n % 5 == 4) ground.undo();
      ASSERT_TRUE(
          haveSameBits(ground.pyramid(), levelset::heightPyramid(ground.field(), {.cells = cells})))
          << columns << "x" << rows << " after dab " << n;
    }
  }
}

TEST(SculptedGround, PyramidHasPositiveZeros) {
  HeightField field = randomTerrain(20, 20, 0, 3);
  for (std::size_t n = 0; n < field.heights.size(); ++n) field.heights[n] = n % 3 ? 0.0F : -0.0F;
  SculptedGround ground(field, {.cells = 2});
  EXPECT_TRUE(haveSameBits(ground.pyramid(), levelset::heightPyramid(field, {.cells = 2})));
}

TEST(SculptedGround, UndoAndRedoReturnTheBits) {
  std::mt19937 random(11);
  SculptedGround ground(randomTerrain(120, 90, 0.01, 4), {.cells = 16});
  std::vector<std::vector<float>> states = {ground.field().heights};
  for (int stroke = 0; stroke < 60; ++stroke) {
    ground.beginStroke();
    for (int dab = 0; dab < 4; ++dab) {
      BrushDab next = randomDab(random, ground.field(), 9);
      next.center = ground.field().position(static_cast<int>(random() % 120),
                                            static_cast<int>(random() % 90));
      ground.apply(next);
    }
    states.push_back(ground.field().heights);
  }
  for (std::size_t n = states.size() - 1; n-- > 0;) {
    ground.undo();
    ASSERT_TRUE(haveSameBits(ground.field().heights, states[n])) << n;
  }
  EXPECT_FALSE(ground.canUndo());
  EXPECT_TRUE(ground.undo().isEmpty());
  for (std::size_t n = 1; n < states.size(); ++n) {
    ground.redo();
    ASSERT_TRUE(haveSameBits(ground.field().heights, states[n])) << n;
  }
  EXPECT_FALSE(ground.canRedo());
  // A new stroke ends what could be redone.
  ground.undo();
  ground.apply({.radius = 5, .strength = 1});
  EXPECT_FALSE(ground.canRedo());
  ground.undo();
  EXPECT_TRUE(haveSameBits(ground.field().heights, states[states.size() - 2]));
}

TEST(SlowSculptedGround, TenThousandStrokesAreUndone) {
  std::mt19937 random(13);
  HeightField field = randomTerrain(513, 385, 0.001, 6);
  const std::vector<float> before = field.heights;
  SculptedGround ground(std::move(field), {.undoMemory = std::size_t{4} << 30});
  for (int n = 0; n < 10000; ++n) {
    ground.beginStroke();
    ground.apply(randomDab(random, ground.field(), 20));
  }
  const std::vector<float> after = ground.field().heights;
  EXPECT_FALSE(haveSameBits(after, before));
  while (ground.canUndo()) ground.undo();
  EXPECT_TRUE(haveSameBits(ground.field().heights, before));
  while (ground.canRedo()) ground.redo();
  EXPECT_TRUE(haveSameBits(ground.field().heights, after));
  EXPECT_TRUE(
      haveSameBits(ground.pyramid(), levelset::heightPyramid(ground.field(), {.cells = 64})));
}

TEST(SculptedGround, DropsTheOldestStrokesBeyondItsMemory) {
  // The dab lies in the first tile, which has 16 KiB, so that five of them fit.
  SculptedGround ground(randomTerrain(100, 100, 0, 1), {.undoMemory = 5 * 16500});
  for (int n = 0; n < 20; ++n) {
    ground.beginStroke();
    // A second dab at the same place takes no more memory.
    for (int dab = 0; dab < 2; ++dab)
      ground.apply({.center = {-20, -20}, .radius = 10, .strength = 1});
  }
  int count = 0;
  while (ground.canUndo()) {
    ground.undo();
    ++count;
  }
  EXPECT_EQ(count, 5);
}

TEST(SculptedGround, ADabThatFailsChangesNothing) {
  SculptedGround ground(randomTerrain(40, 40, 0, 1));
  const std::vector<float> before = ground.field().heights;
  ground.apply({.radius = 5, .strength = 3e38});
  EXPECT_THROW(ground.apply({.radius = 5, .strength = 3e38}), InvalidInput);
  EXPECT_THROW(ground.apply({.radius = -5, .strength = 1}), levelset::UsageError);
  ground.undo();
  EXPECT_TRUE(haveSameBits(ground.field().heights, before));
  EXPECT_FALSE(ground.canUndo());
}

class GroundEditsFile : public ::testing::Test {
 protected:
  GroundEditsFile() {
    SculptedGround ground(base_);
    ground.apply({.center = base_.position(70, 20), .radius = 9, .strength = 2});
    ground.apply({.center = base_.position(149, 119), .radius = 3, .strength = -1});
    sculpted_ = ground.field();
    edits_ = ground.edits();
  }
  support::TemporaryFolder folder_;
  HeightField base_ = randomTerrain(150, 120, 0.01, 8), sculpted_;
  GroundEdits edits_;
};

TEST_F(GroundEditsFile, BringsTheHeightsBack) {
  // The first dab meets tiles (0, 0) and (1, 0), the second one tile (2, 1).
  ASSERT_EQ(edits_.tiles.size(), 3u);
  EXPECT_EQ(edits_.tiles[2].heights.size(), (150u - 128) * (120 - 64));
  levelset::writeGroundEdits(folder_ / "a.edits", edits_);
  HeightField field = base_;
  levelset::applyEdits(field, levelset::readGroundEdits(folder_ / "a.edits"));
  EXPECT_TRUE(haveSameBits(field.heights, sculpted_.heights));
  // Sculpting goes on from the file, and stores the tiles of both.
  const GroundEdits earlier = levelset::readGroundEdits(folder_ / "a.edits");
  SculptedGround ground(base_, {.edits = &earlier});
  EXPECT_TRUE(haveSameBits(ground.field().heights, sculpted_.heights));
  ground.apply({.center = base_.position(5, 100), .radius = 4, .strength = 1});
  EXPECT_EQ(ground.edits().tiles.size(), 4u);
  HeightField again = base_;
  levelset::applyEdits(again, ground.edits());
  EXPECT_TRUE(haveSameBits(again.heights, ground.field().heights));
}

/// A child process writes edits to a file and is ended by a signal in the middle.
/// @param mostBytes  bytes of a file after which the system ends the process
void writeAndDie(const std::filesystem::path& path, const GroundEdits& edits,
                 std::size_t mostBytes) {
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit noCore = {0, 0}, size = {mostBytes, mostBytes};
    ::setrlimit(RLIMIT_CORE, &noCore);
    ::signal(SIGXFSZ, SIG_DFL);
    ::setrlimit(RLIMIT_FSIZE, &size);
    levelset::writeGroundEdits(path, edits);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ) << mostBytes;
}

/// A process that is ended while it writes leaves an old file as it was, and no new file.
TEST_F(GroundEditsFile, KeepsItsContentWhenTheWriterIsKilled) {
  GroundEdits later;
  {
    SculptedGround ground(base_, {.edits = &edits_});
    ground.apply({.center = base_.position(20, 90), .radius = 30, .strength = 7});
    later = ground.edits();
  }
  levelset::writeGroundEdits(folder_ / "whole.edits", later);
  const std::size_t bytes = support::readText(folder_ / "whole.edits").size();
  levelset::writeGroundEdits(folder_ / "old.edits", edits_);
  const std::string before = support::readText(folder_ / "old.edits");
  for (const std::size_t most : {std::size_t{0}, std::size_t{1}, bytes / 2, bytes - 1}) {
    writeAndDie(folder_ / "old.edits", later, most);
    EXPECT_EQ(support::readText(folder_ / "old.edits"), before) << most;
    writeAndDie(folder_ / "new.edits", later, most);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "new.edits")) << most;
  }
  HeightField field = base_;
  levelset::applyEdits(field, levelset::readGroundEdits(folder_ / "old.edits"));
  EXPECT_TRUE(haveSameBits(field.heights, sculpted_.heights));
  // The next save is not disturbed by what the killed ones have left.
  levelset::writeGroundEdits(folder_ / "old.edits", later);
  EXPECT_EQ(support::readText(folder_ / "old.edits"), support::readText(folder_ / "whole.edits"));
}

/// A process that saves without end is killed at any time: the file has the bytes of one save.
TEST_F(GroundEditsFile, HasTheBytesOfOneSaveWhenTheWriterIsKilledAtAnyTime) {
  GroundEdits other = edits_;
  other.tiles[1].heights[7] += 1;
  std::string whole[2];
  for (const int n : {0, 1}) {
    levelset::writeGroundEdits(folder_ / "a.edits", n == 0 ? edits_ : other);
    whole[n] = support::readText(folder_ / "a.edits");
  }
  std::mt19937 random(5);
  for (int trial = 0; trial < 40; ++trial) {
    const pid_t child = ::fork();
    if (child == 0)
      for (;;) {
        levelset::writeGroundEdits(folder_ / "a.edits", edits_);
        levelset::writeGroundEdits(folder_ / "a.edits", other);
      }
    ::usleep(static_cast<useconds_t>(random() % 5000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const std::string found = support::readText(folder_ / "a.edits");
    EXPECT_TRUE(found == whole[0] || found == whole[1]) << trial;
  }
}

TEST_F(GroundEditsFile, RefusesAnotherTerrain) {
  HeightField other = base_;
  other.heights[5] += 1;
  const HeightField before = other;
  EXPECT_NE(
      refusal<InvalidInput>([&] { levelset::applyEdits(other, edits_); }).find("other heights"),
      std::string::npos);
  EXPECT_TRUE(haveSameBits(other.heights, before.heights));
  HeightField narrow = randomTerrain(20, 20, 0, 1);
  EXPECT_NE(refusal<InvalidInput>([&] { levelset::applyEdits(narrow, edits_); }).find("150x120"),
            std::string::npos);
}

TEST_F(GroundEditsFile, RefusesDamagedFiles) {
  levelset::writeGroundEdits(folder_ / "a.edits", edits_);
  const std::string whole = support::readText(folder_ / "a.edits");
  EXPECT_THROW(static_cast<void>(levelset::readGroundEdits(folder_ / "none.edits")),
               levelset::IoError);
  std::mt19937 random(3);
  for (int n = 0; n < 300; ++n) {
    std::string bytes = whole;
    if (n % 3 == 0)
      bytes.resize(random() % whole.size());
    else
      bytes[n % 3 == 1 ? random() % 60 : random() % bytes.size()] ^=
          static_cast<char>(1 + random() % 255);
    support::writeText(folder_ / "b.edits", bytes);
    EXPECT_THROW(static_cast<void>(levelset::readGroundEdits(folder_ / "b.edits")), InvalidInput)
        << n;
  }
}

}  // namespace sculpted_ground_test
