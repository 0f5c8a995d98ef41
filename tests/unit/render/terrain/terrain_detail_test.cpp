// Level of detail of terrains: no cracks, pixel error, memory, and patches that are late or fail.

#include "render/terrain/terrain_detail.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <random>
#include <set>
#include <thread>

#include "levelset/error.h"
#include "levelset/terrain/ground_mesh.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/terrain/tiles/write_tiled_ground.h"
#include "render/terrain/resident_patches.h"
#include "tests/support/drawn_terrain.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrain_stores.h"
#include "tests/support/threads.h"

namespace terrain_detail_test {

using namespace render;
using levelset::HeightField;
using levelset::TriMesh;
using support::CrackCount;
using support::HookedStore;
using support::storeOf;
using Reading = TerrainDetail::Reading;

constexpr std::size_t kMuch = 1u << 26;

HeightField land(int columns, int rows) {
  HeightField field = support::cutTerrain(support::fractalTerrain(8, 0.5, 11), columns, rows);
  field.origin = {-columns / 2.0, -rows / 2.0};
  return field;
}

/// Makes a round hole and single missing samples, also at borders of patches.
void pierce(HeightField& field) {
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column)
      if (std::hypot(column - 70, row - 60) < 9 || (column == 32 && row == 40) ||
          (column == 97 && row == 32) || (column * row) % 997 == 996)
        field.heights[field.index(column, row)] = levelset::kMissingHeight;
}

std::unique_ptr<TerrainDetail> detailOf(const HeightField& field, int cells) {
  return std::make_unique<TerrainDetail>(storeOf(field, cells),
                                         TerrainDetailOptions{.maxBytes = kMuch});
}

/// Every edge of the drawn triangles has two triangles in opposite directions, except where the
/// field, its data or the drawn part ends. In random views of complete, cut and pierced grounds.
TEST(TerrainDetail, HasNoCracksInAThousandViews) {
  HeightField pierced = land(150, 131);
  pierce(pierced);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t triangles = 0, coarserBorders = 0;
  for (const HeightField& field : {land(129, 129), land(150, 131), land(201, 70), pierced})
    for (const int cells : {4, 8}) {
      const auto detail = detailOf(field, cells);
      for (int n = 0; n < 125; ++n) {
        const Camera camera = support::randomCamera(field.bounds(), random);
        const TerrainSelection selection = detail->select(camera, 1 + 12 * unit(random));
        EXPECT_TRUE(selection.isComplete);
        const TriMesh mesh = terrainTriangles(detail->layout(), selection);
        EXPECT_EQ(CrackCount(field, detail->layout(), selection)(mesh), 0u);
        triangles += mesh.triangles.size();
        for (const auto& part : selection.parts) coarserBorders += part.coarserSides != 0;
      }
    }
  EXPECT_GT(triangles, 1000000u);
  EXPECT_GT(coarserBorders, 10000u);
}

/// The count of cracks itself finds a patch that is drawn with a wrong border.
TEST(TerrainDetail, WouldHaveCracksWithoutBorders) {
  const HeightField field = land(129, 129);
  const auto detail = detailOf(field, 8);
  Camera camera;
  camera.from = {-60, -60, 30};
  camera.to = {0, 0, 0};
  camera.up = {0, 0, 1};
  TerrainSelection selection = detail->select(camera, 20);
  for (auto& part : selection.parts)
    if (part.coarserSides != 0) {
      part.coarserSides = 0;
      break;
    }
  const TriMesh mesh = terrainTriangles(detail->layout(), selection);
  EXPECT_GE(CrackCount(field, detail->layout(), selection)(mesh), 4u);
}

/// In random views, the drawn surface is within the pixel error of the full data at all samples,
/// and the bound is not idle.
TEST(TerrainDetail, KeepsThePixelError) {
  HeightField pierced = land(150, 131);
  pierce(pierced);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  double most = 0;
  for (const HeightField& field : {land(129, 129), land(150, 131), pierced})
    for (const int cells : {4, 16}) {
      const auto detail = detailOf(field, cells);
      for (int n = 0; n < 40; ++n) {
        const Camera camera = support::randomCamera(field.bounds(), random);
        const double allowed = 0.5 + 8 * unit(random);
        const TriMesh mesh = terrainTriangles(detail->layout(), detail->select(camera, allowed));
        const double error = support::largestPixelError(field, mesh, camera);
        EXPECT_LE(error, allowed * (1 + 1e-6));
        most = std::max(most, error / allowed);
      }
    }
  EXPECT_GT(most, 0.9);  // measured: 0.997
}

/// Without errors allowed, the triangles are those of the ground.
TEST(TerrainDetail, DrawsAllDataWhereItMust) {
  HeightField field = land(60, 45);
  pierce(field);
  const auto detail = detailOf(field, 8);
  Camera camera;
  camera.from = {0, -300, 200};
  camera.to = {0, 0, 0};
  camera.up = {0, 0, 1};
  const TriMesh mesh = terrainTriangles(detail->layout(), detail->select(camera, 1e-9));
  const TriMesh all = levelset::groundMesh(field, {.allowMissing = true});
  EXPECT_EQ(mesh.triangles.size(), all.triangles.size());
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) {
      const auto [column, row] = support::sampleAt(field, mesh.positions[corner]);
      EXPECT_EQ(mesh.positions[corner], field.point(column, row));
    }
}

/// A plane is drawn as one patch at any pixel error.
TEST(TerrainDetail, DrawsAPlaneAsOnePatch) {
  HeightField plane{.columns = 129, .rows = 129};
  for (int n = 0; n < 129 * 129; ++n) plane.heights.push_back(static_cast<float>(n % 129));
  const auto detail = detailOf(plane, 8);
  Camera camera;
  camera.from = {20, 20, 90};
  camera.to = {60, 64, 0};
  camera.up = {0, 0, 1};
  EXPECT_EQ(detail->select(camera, 1e-6).parts.size(), 1u);
  camera.from = {20, 20, 190};
  camera.to = {20, 20, 300};
  camera.up = {0, 1, 0};
  EXPECT_EQ(detail->select(camera, 1e-6).parts.size(), 0u);  // nothing is in the sky
}

TEST(TerrainDetail, IsTheSameForAnyNumberOfThreads) {
  const HeightField field = land(150, 131);
  std::mt19937 random(3);
  const Camera camera = support::randomCamera(field.bounds(), random);
  const auto picture = [&] {
    const auto detail = detailOf(field, 8);
    return terrainTriangles(detail->layout(), detail->select(camera, 2));
  };
  const TriMesh one = support::onThreads(1, picture), two = support::onThreads(2, picture);
  EXPECT_EQ(one.positions, two.positions);
  EXPECT_EQ(one.triangles, two.triangles);
}

/// A flight over data ten times as large as the memory stays within it. Pictures depend on the
/// view alone, not on the flight so far.
TEST(TerrainDetail, StaysWithinItsMemory) {
  const HeightField field = land(257, 257);
  const int cells = 8;
  const std::size_t whole = 4 * field.memoryUse() / 3;
  const std::size_t limit = std::max(whole / 10, 100 * ResidentPatches::patchBytes(cells));
  TerrainDetail detail(storeOf(field, cells), {.maxBytes = limit});
  const auto allBytes = 1365 * ResidentPatches::patchBytes(cells);
  ASSERT_GT(allBytes, 10 * limit);
  std::size_t most = 0;
  Camera camera;
  camera.up = {0, 0, 1};
  camera.width = camera.height = 256;
  for (int n = 0; n < 60; ++n) {
    camera.from = {-110.0 + 3.5 * n, -60 + 2.0 * n, 40};
    camera.to = camera.from + Imath::V3d(20, 12, -9);
    const TerrainSelection flown = detail.select(camera, 4);
    EXPECT_LE(detail.memoryUse(), limit);
    EXPECT_EQ(CrackCount(field, detail.layout(), flown)(terrainTriangles(detail.layout(), flown)),
              0u);
    if (n % 20 == 0) {
      TerrainDetail fresh(storeOf(field, cells), {.maxBytes = limit});
      const TerrainSelection direct = fresh.select(camera, 4);
      EXPECT_EQ(direct.isComplete, flown.isComplete);
      EXPECT_EQ(terrainTriangles(fresh.layout(), direct).triangles,
                terrainTriangles(detail.layout(), flown).triangles);
    }
    most = std::max(most, flown.parts.size());
  }
  EXPECT_GT(most, 20u);
  EXPECT_LE(detail.mostMemoryUse(), limit);
  EXPECT_GT(detail.mostMemoryUse(), limit / 2);
  // A demand above the memory is drawn coarser.
  camera.from = {-120, -120, 60};
  camera.to = {0, 0, 0};
  const TerrainSelection fine = detail.select(camera, 0.01);
  EXPECT_FALSE(fine.isComplete);
  EXPECT_EQ(CrackCount(field, detail.layout(), fine)(terrainTriangles(detail.layout(), fine)), 0u);
  EXPECT_LE(detail.mostMemoryUse(), limit);
}

/// A flight over a tiled file whose heights take ten times the memory. Patches are read by a thread
/// while coarser ones are drawn. There is no crack and no hole, and at the end of each stage the
/// triangles are those of a ground in memory.
TEST(TerrainDetail, FliesOverATiledFileTenTimesAsLargeAsItsMemory) {
  HeightField field = support::fractalTerrain(9, 0.5, 11);
  field.origin = {-256, -256};
  const int cells = 8;
  const support::TemporaryFolder folder;
  levelset::writeTiledGround(folder / "land.lst", field, {.cells = cells});
  const std::size_t limit = 500 * ResidentPatches::patchBytes(cells);
  TerrainDetail detail(levelset::openTiledGround(folder / "land.lst"), {.maxBytes = limit});
  TerrainDetail whole(storeOf(field, cells), {.maxBytes = kMuch});
  std::size_t patches = 0;
  for (const levelset::PyramidLevel& level : detail.layout().pyramid.levels)
    patches += static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows);
  ASSERT_GT(patches * ResidentPatches::patchBytes(cells), 10 * limit);
  Camera camera;
  camera.up = {0, 0, 1};
  camera.width = camera.height = 256;
  std::size_t late = 0;
  for (int n = 0; n < 80; ++n) {
    camera.from = {-220.0 + 5 * n, -150 + 3.5 * n, 50};
    camera.to = camera.from + Imath::V3d(20, 12, -12);
    TerrainSelection flown = detail.select(camera, 6, Reading::Background);
    late += !flown.isComplete;
    EXPECT_EQ(CrackCount(field, detail.layout(), flown)(terrainTriangles(detail.layout(), flown)),
              0u);
    EXPECT_LE(detail.memoryUse(), limit);
    if (n % 10 != 9) continue;
    flown = detail.select(camera, 6);
    EXPECT_TRUE(flown.isComplete);
    const TriMesh seen = terrainTriangles(detail.layout(), flown),
                  same = terrainTriangles(whole.layout(), whole.select(camera, 6));
    EXPECT_EQ(seen.triangles, same.triangles);
    EXPECT_EQ(seen.positions, same.positions);
    EXPECT_TRUE(std::isfinite(support::largestPixelError(field, seen, camera)));
  }
  EXPECT_GT(late, 0u);
  EXPECT_LE(detail.mostMemoryUse(), limit);
  EXPECT_GT(whole.mostMemoryUse(), limit);
}

/// Patches that cannot be read are drawn by coarser ones, without holes or cracks, and are
/// reported once.
TEST(TerrainDetail, DrawsFailingPatchesCoarser) {
  const HeightField field = land(129, 129);
  std::mt19937 random(4);
  std::set<std::array<int, 3>> failed;
  std::mutex mutex;
  TerrainDetail detail(
      std::make_unique<HookedStore>(storeOf(field, 8),
                                    [&](int level, int column, int row) {
                                      if ((7 * level + 5 * column + 3 * row) % 6 != 0 || level > 2)
                                        return;
                                      const std::scoped_lock lock(mutex);
                                      EXPECT_TRUE(failed.insert({level, column, row}).second);
                                      throw levelset::IoError("the disk is gone");
                                    }),
      {.maxBytes = kMuch});
  std::size_t warnings = 0;
  bool isEverIncomplete = false;
  for (int n = 0; n < 60; ++n) {
    const Camera camera = support::randomCamera(field.bounds(), random);
    const TerrainSelection selection = detail.select(camera, 2);
    isEverIncomplete = isEverIncomplete || !selection.isComplete;
    const TriMesh mesh = terrainTriangles(detail.layout(), selection);
    EXPECT_EQ(CrackCount(field, detail.layout(), selection)(mesh), 0u);
    EXPECT_TRUE(std::isfinite(support::largestPixelError(field, mesh, camera)));  // no hole
    for (const std::string& warning : detail.takeWarnings()) {
      ++warnings;
      EXPECT_NE(warning.find("the disk is gone"), std::string::npos) << warning;
    }
  }
  EXPECT_TRUE(isEverIncomplete);
  EXPECT_EQ(warnings, failed.size());
  EXPECT_GT(warnings, 10u);
}

/// In the background, each picture is free of cracks and holes, pictures become finer while patches
/// arrive, and the last one is that of a reading that waits.
TEST(TerrainDetail, DrawsLatePatchesCoarser) {
  const HeightField field = land(257, 257);
  std::atomic<int> arrivals{0};
  TerrainDetail detail(
      std::make_unique<HookedStore>(
          storeOf(field, 8),
          [](int, int, int) { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }),
      {.maxBytes = kMuch, .onArrival = [&] { ++arrivals; }});
  Camera camera;
  camera.from = {-90, -90, 40};
  camera.to = {0, 0, 0};
  camera.up = {0, 0, 1};
  camera.width = camera.height = 256;
  std::size_t before = 0;
  bool isComplete = false;
  for (int n = 0; n < 1000 && !isComplete; ++n) {
    const TerrainSelection selection = detail.select(camera, 4, Reading::Background);
    isComplete = selection.isComplete;
    const TriMesh mesh = terrainTriangles(detail.layout(), selection);
    EXPECT_EQ(CrackCount(field, detail.layout(), selection)(mesh), 0u);
    EXPECT_TRUE(std::isfinite(support::largestPixelError(field, mesh, camera)));
    EXPECT_GE(mesh.triangles.size(), before);
    before = mesh.triangles.size();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_TRUE(isComplete);
  EXPECT_TRUE(detail.isIdle());
  EXPECT_GT(arrivals, 20);
  const auto direct = detailOf(field, 8);
  EXPECT_EQ(terrainTriangles(detail.layout(), detail.select(camera, 4)).triangles,
            terrainTriangles(direct->layout(), direct->select(camera, 4)).triangles);
}

/// It ends while a patch is being read.
TEST(TerrainDetail, EndsWhileItReads) {
  const HeightField field = land(129, 129);
  for (int n = 0; n < 20; ++n) {
    TerrainDetail detail(
        std::make_unique<HookedStore>(storeOf(field, 8),
                                      [](int level, int, int) {
                                        if (level < 3)
                                          std::this_thread::sleep_for(std::chrono::milliseconds(3));
                                      }),
        {.maxBytes = kMuch});
    Camera camera;
    camera.from = {0, 0, 40};
    camera.to = {30, 30, 0};
    camera.up = {0, 0, 1};
    EXPECT_FALSE(detail.select(camera, 1, Reading::Background).parts.empty());
    std::this_thread::sleep_for(std::chrono::milliseconds(n % 5));
  }
}

TEST(TerrainDetail, TakesTinyGrounds) {
  for (const auto& [columns, rows] : {std::pair{2, 2}, {2, 50}, {37, 2}, {3, 3}}) {
    const HeightField field = land(columns, rows);
    const auto detail = detailOf(field, 4);
    Camera camera;
    camera.from = {0, -80, 60};
    camera.to = {0, 0, 0};
    camera.up = {0, 0, 1};
    const TerrainSelection selection = detail->select(camera, 1e-6);
    const TriMesh mesh = terrainTriangles(detail->layout(), selection);
    EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(2 * (columns - 1) * (rows - 1)));
    EXPECT_EQ(CrackCount(field, detail->layout(), selection)(mesh), 0u);
  }
  HeightField nothing = land(20, 20);
  nothing.heights.assign(400, levelset::kMissingHeight);
  const auto detail = detailOf(nothing, 4);
  EXPECT_TRUE(detail->select(Camera{}, 1).parts.empty());
}

TEST(TerrainDetail, RefusesWithSentences) {
  const HeightField field = land(20, 20);
  const auto detail = detailOf(field, 4);
  EXPECT_THROW((void)detail->select(Camera{}, 0), levelset::UsageError);
  EXPECT_THROW((void)detail->select(Camera{}, std::nan("")), levelset::UsageError);
  EXPECT_THROW(TerrainDetail(storeOf(field, 4), {.maxBytes = 1000}), levelset::UsageError);
  HeightField degrees = field;
  degrees.isGeographic = true;
  EXPECT_THROW(TerrainDetail(storeOf(degrees, 4), {}), levelset::InvalidInput);
  // Without its coarsest patch, nothing can be drawn.
  EXPECT_THROW(TerrainDetail(std::make_unique<HookedStore>(
                                 storeOf(field, 4),
                                 [](int, int, int) { throw levelset::IoError("no disk"); }),
                             {}),
               levelset::IoError);
}

}  // namespace terrain_detail_test
