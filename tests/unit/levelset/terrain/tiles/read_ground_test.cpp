#include "levelset/terrain/tiles/read_ground.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/terrain/tiles/write_tiled_ground.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace read_ground_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::HeightField;
using levelset::PatchStore;
using levelset::readGround;
using support::refusal;

HeightField ground(int columns, int rows) {
  HeightField field = support::randomTerrain(columns, rows, 0.01, 6);
  field.origin = {100, -50};
  field.spacing = {10, 5};
  field.coordinateSystem = "here";
  return field;
}

std::unique_ptr<PatchStore> storeOf(const HeightField& field, int cells) {
  return levelset::patchStoreOf(std::make_shared<HeightField>(field),
                                heightPyramid(field, {.cells = cells}));
}

TEST(ReadGround, ReadsTheCompleteGround) {
  for (const auto& [columns, rows] : {std::pair(65, 33), std::pair(70, 41), std::pair(2, 2),
                                      std::pair(129, 17), std::pair(9, 8)}) {
    const HeightField field = ground(columns, rows);
    EXPECT_EQ(readGround(*storeOf(field, 8)).contentHash(), field.contentHash());
  }
}

TEST(ReadGround, ReadsABoxLikeCroppedHeights) {
  const HeightField field = ground(70, 41);
  const auto store = storeOf(field, 8);
  const Box3d boxes[] = {{V3d(180, -20, 0), V3d(580, 110, 0)},
                         {V3d(181, -19, 0), V3d(182.5, 300, 0)},
                         {V3d(180, 0, 0), V3d(260, 40, 0)},
                         {V3d(-1e9, -1e9, 0), V3d(1e9, 1e9, 0)},
                         {V3d(790, 150, 0), V3d(790, 150, 0)}};
  for (const Box3d& box : boxes) {
    if (box.min.x == 181) continue;  // between two samples
    EXPECT_EQ(readGround(*store, {.box = box}).contentHash(),
              croppedHeights(field, box).contentHash());
  }
  EXPECT_SAYS(refusal<levelset::InvalidInput>(
                  [&] { static_cast<void>(readGround(*store, {.box = boxes[1]})); }),
              "has no sample of level 0");
}

/// Level n has every 2^n-th sample, as far as these are regular.
TEST(ReadGround, ReadsLevels) {
  const HeightField field = ground(70, 41);
  const auto store = storeOf(field, 8);
  for (int level = 0; level < 4; ++level) {
    const HeightField coarse = readGround(*store, {.level = level});
    const int stride = 1 << level;
    EXPECT_EQ(coarse.columns, 69 / stride + 1);
    EXPECT_EQ(coarse.rows, 40 / stride + 1);
    EXPECT_EQ(coarse.spacing, field.spacing * static_cast<double>(stride));
    EXPECT_EQ(coarse.origin, field.origin);
    EXPECT_EQ(coarse.coordinateSystem, "here");
    for (int row = 0; row < coarse.rows; ++row)
      for (int column = 0; column < coarse.columns; ++column) {
        const float expected = field.at(column * stride, row * stride);
        if (std::isnan(expected))
          EXPECT_TRUE(coarse.isMissing(column, row));
        else
          EXPECT_EQ(coarse.at(column, row), expected);
      }
    const Box3d box(V3d(180, 0, 0), V3d(600, 120, 0));
    EXPECT_EQ(readGround(*store, {.box = box, .level = level}).contentHash(),
              croppedHeights(coarse, box).contentHash());
  }
  EXPECT_SAYS(
      refusal<levelset::UsageError>([&] { static_cast<void>(readGround(*store, {.level = 5})); }),
      "has no level 5; give 0 to 4");
  EXPECT_SAYS(
      refusal<levelset::UsageError>([&] { static_cast<void>(readGround(*store, {.level = -1})); }),
      "no level -1");
}

TEST(ReadGround, ReadsFilesOnAnyNumberOfThreads) {
  const support::TemporaryFolder folder;
  const HeightField field = ground(500, 300);
  writeTiledGround(folder / "a.lst", field, {.cells = 16});
  const auto tiles = levelset::openTiledGround(folder / "a.lst");
  const Box3d box(V3d(300, 0, 0), V3d(4000, 1000, 0));
  const auto run = [&] { return readGround(*tiles, {.box = box, .level = 1}).contentHash(); };
  EXPECT_EQ(support::onThreads(1, run), support::onThreads(4, run));
  EXPECT_EQ(support::onThreads(4, run),
            readGround(*storeOf(field, 32), {.box = box, .level = 1}).contentHash());
}

TEST(ReadGround, RefusesMoreThanTheMemory) {
  const auto store = storeOf(ground(500, 500), 16);
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { static_cast<void>(readGround(*store, {.maxMemory = 900'000})); }),
              "500x500 samples, 0.001 GB, but 0.0009 GB are left; give --box");
  EXPECT_NO_THROW(static_cast<void>(readGround(*store, {.level = 1, .maxMemory = 900'000})));
  EXPECT_SAYS(refusal<levelset::Cancelled>([&] {
                static_cast<void>(readGround(*store, {.progress = [](double) { return false; }}));
              }),
              "");
}

}  // namespace read_ground_test
