// Terrains in the viewer: reading, pictures by OpenGL, picks and refusals.

#include "apps/viewer/terrain/shown_terrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <thread>

#include "apps/viewer/editing/sculpt_editor.h"
#include "apps/viewer/interaction/pick.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "levelset/error.h"
#include "levelset/terrain/tiles/write_tiled_ground.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace shown_terrain_test {

using namespace viewer;
using Imath::V3d;

/// A plane of slope 1/2 along x over 120 × 80, with a hole about (100, 60).
std::filesystem::path planeIn(const support::TemporaryFolder& folder) {
  std::ofstream out(folder / "plane.asc");
  out << "ncols 61\nnrows 41\nxllcenter 0\nyllcenter 0\ncellsize 2\nNODATA_value -9999\n";
  for (int row = 40; row >= 0; --row)
    for (int column = 0; column <= 60; ++column)
      out << (std::abs(column - 50) < 4 && std::abs(row - 30) < 4 ? -9999 : column) << ' ';
  return folder / "plane.asc";
}

View viewOf(const std::shared_ptr<const Model>& model) {
  View view{model, {}, std::nullopt};
  view.camera.from = {60, -80, 120};
  view.camera.to = {60, 40, 30};
  view.camera.up = {0, 0, 1};
  view.camera.verticalFov = 0.9;
  view.camera.width = 120;
  view.camera.height = 90;
  return view;
}

std::shared_ptr<const Frame> drawn(const View& view, const Display& display) {
  ProgressivePicture picture;
  picture.request(view, display);
  while (picture.isBusy()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  if (picture.failure()) std::rethrow_exception(picture.failure());
  return picture.frame();
}

TEST(ShownTerrain, IsReadDrawnAndPicked) {
  const support::TemporaryFolder folder;
  const auto model = std::make_shared<const Model>(openModel({planeIn(folder)}));
  ASSERT_TRUE(model->terrain);
  EXPECT_EQ(model->description, "terrain of 61 x 41 samples, 2 x 2 apart");
  EXPECT_EQ(model->bounds.min, V3d(0, 0, 0));
  EXPECT_EQ(model->bounds.max, V3d(120, 80, 60));
  EXPECT_FALSE(model->canCut());
  const auto frame = drawn(viewOf(model), {});
  EXPECT_TRUE(frame->isComplete);
  EXPECT_EQ(frame->canvas.width, 120);
  int hits = 0;
  for (int y = 5; y < 90; y += 10)
    for (int x = 5; x < 120; x += 10) {
      const auto picked = pick(*frame, x, y);
      if (!picked) continue;
      ++hits;
      EXPECT_EQ(frame->image->channels.at("A")[static_cast<std::size_t>(120 * y + x)], 1);
      EXPECT_NEAR(picked->position.z, 0.5 * picked->position.x, 0.1);
      EXPECT_LT((picked->normal - V3d(-0.5, 0, 1).normalized()).length(), support::rounding(8));
    }
  EXPECT_GT(hits, 20);
  const auto normals = drawn(viewOf(model), {.layer = Layer::Normal});
  EXPECT_NE(normals->canvas.colours, frame->canvas.colours);
}

TEST(ShownTerrain, LeavesHolesOpen) {
  const support::TemporaryFolder folder;
  const auto model = std::make_shared<const Model>(openModel({planeIn(folder)}));
  View view = viewOf(model);
  view.camera.from = {100, 60, 200};
  view.camera.to = {100, 60, 0};
  view.camera.up = {0, 1, 0};
  view.camera.orthoHeight = 60;
  const auto frame = drawn(view, {});
  EXPECT_FALSE(pick(*frame, 60, 45));
  EXPECT_TRUE(pick(*frame, 60, 65));
}

/// A tiled file has the picture of the same terrain in memory.
TEST(ShownTerrain, DrawsFromATiledFile) {
  const support::TemporaryFolder folder;
  const auto model = std::make_shared<const Model>(openModel({planeIn(folder)}));
  levelset::writeTiledGround(folder / "plane.lst", *model->terrain->field, {.cells = kShownCells});
  const auto tiled = std::make_shared<const Model>(openModel({folder / "plane.lst"}));
  EXPECT_EQ(tiled->description, "terrain of 61 x 41 samples, 2 x 2 apart, tiled");
  EXPECT_FALSE(tiled->terrain->field);
  EXPECT_EQ(tiled->bounds.min, model->bounds.min);
  EXPECT_EQ(tiled->bounds.max, model->bounds.max);
  EXPECT_EQ(drawn(viewOf(tiled), {})->canvas.colours, drawn(viewOf(model), {})->canvas.colours);
  EXPECT_NE(whyNoSculpting(*tiled).find("tiled"), std::string::npos);

  levelset::HeightField field = *model->terrain->field;
  field.isGeographic = true;
  levelset::writeTiledGround(folder / "degrees.lst", field);
  EXPECT_THROW((void)openModel({folder / "degrees.lst"}), levelset::InvalidInput);
  field.isGeographic = false;
  std::fill(field.heights.begin(), field.heights.end(), levelset::kMissingHeight);
  levelset::writeTiledGround(folder / "none.lst", field);
  EXPECT_THROW((void)openModel({folder / "none.lst"}), levelset::InvalidInput);
  std::ofstream(folder / "bad.lst") << "not tiled";
  EXPECT_THROW((void)openModel({folder / "bad.lst"}), levelset::InvalidInput);
}

TEST(ShownTerrain, RefusesWhatATerrainHasNot) {
  const support::TemporaryFolder folder;
  const auto model = std::make_shared<const Model>(openModel({planeIn(folder)}));
  EXPECT_THROW((void)drawn(viewOf(model), {.layer = Layer::GaussCurvature}), levelset::UsageError);
  View thick = viewOf(model);
  thick.hasThickness = true;
  EXPECT_THROW((void)drawn(thick, {.layer = Layer::Thickness}), levelset::UsageError);
  std::ofstream(folder / "none.asc") << "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 1\n"
                                        "NODATA_value -1\n-1 -1\n-1 -1\n";
  EXPECT_THROW((void)openModel({folder / "none.asc"}), levelset::InvalidInput);
}

}  // namespace shown_terrain_test
