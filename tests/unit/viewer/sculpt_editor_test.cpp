// Sculpting a terrain in the viewer: points of the ground, strokes, undo and commands.

#include "apps/viewer/editing/sculpt_editor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"

namespace sculpt_editor_test {

using namespace viewer;
using Imath::V2d;
using Imath::V3d;
using levelset::HeightField;

bool haveSameBits(const HeightField& a, const HeightField& b) {
  return a.heights.size() == b.heights.size() &&
         std::memcmp(a.heights.data(), b.heights.data(), a.heights.size() * sizeof(float)) == 0;
}

/// A level ground of 64 x 64 at the height 2, in a file.
std::shared_ptr<const Model> levelGround(const support::TemporaryFolder& folder) {
  std::ofstream out(folder / "level.asc");
  out << "ncols 65\nnrows 65\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
  for (int n = 0; n < 65 * 65; ++n) out << "2 ";
  out.close();
  return std::make_shared<const Model>(openModel({folder / "level.asc"}));
}

render::Camera fromAbove() {
  return {.from = {32, 32, 102},
          .to = {32, 32, 2},
          .up = {0, 1, 0},
          .orthoHeight = 64.0,
          .width = 64,
          .height = 64};
}

TEST(GroundUnder, IsTheFirstPointOfTheTriangles) {
  const HeightField slope =
      support::terrainOf(21, 17, {2, 3}, [](double x, double y) { return 0.5 * x - 0.25 * y; });
  const V3d box = slope.bounds().center();
  for (const V3d& from : {V3d(3, -4, 40), V3d(-60, 5, 30), V3d(0, 0, -50)}) {
    const std::optional<V3d> hit = groundUnder(slope, {from, (box - from).normalized()});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->z, 0.5 * hit->x - 0.25 * hit->y, 1e-6);
  }
  // A hill hides the ground behind it.
  const HeightField hill = support::terrainOf(
      41, 41, {1, 1}, [](double x, double y) { return 8 * std::exp(-(x * x + y * y) / 20); });
  const std::optional<V3d> hit = groundUnder(hill, {V3d(-30, 0, 4), V3d(1, 0, 0)});
  ASSERT_TRUE(hit);
  EXPECT_LT(hit->x, 0);
  EXPECT_NEAR(hit->z, 4, 1e-9);
  EXPECT_FALSE(groundUnder(hill, {V3d(-30, 0, 9), V3d(1, 0, 0)}));
  EXPECT_FALSE(groundUnder(hill, {V3d(-30, 0, 4), V3d(-1, 0, 0)}));
  // Level grounds have a box without height. There is no ground in a hole.
  HeightField level = support::terrainOf(9, 9, {1, 1}, [](double, double) { return 3; });
  ASSERT_TRUE(groundUnder(level, {V3d(0.2, 0.3, 9), V3d(0, 0, -1)}));
  level.heights[level.index(4, 4)] = levelset::kMissingHeight;
  EXPECT_FALSE(groundUnder(level, {V3d(0.2, 0.3, 9), V3d(0, 0, -1)}));
}

TEST(GroundUnder, MeetsALevelTopAbovePits) {
  HeightField field = support::terrainOf(21, 17, {1, 1}, [](double, double) { return 2; });
  field.heights[field.index(10, 8)] = 1;
  const V3d low(-6, -4, 2);
  const auto below = groundUnder(field, {low + V3d(0, 0, 10), V3d(0, 0, -1)});
  ASSERT_TRUE(below);
  EXPECT_NEAR(below->z, 2, 1e-5);
  EXPECT_NEAR(below->x, low.x, 1e-5);
}

TEST(SculptEditor, PlacesADabAtEachQuarterOfTheRadius) {
  const support::TemporaryFolder folder;
  const auto model = levelGround(folder);
  SculptEditor editor(model);
  editor.setChoice({.brush = Brush::Raise, .radius = 8, .height = 1});
  const render::Camera camera = fromAbove();
  EXPECT_FALSE(editor.moveTo({10, 32}, camera));
  ASSERT_TRUE(editor.press({16, 32}, camera));
  EXPECT_TRUE(editor.moveTo({24.5, 32}, camera));
  EXPECT_FALSE(editor.moveTo({25, 32}, camera));
  editor.release();
  HeightField expected = *model->terrain->field;
  for (const double x : {16, 18, 20, 22, 24})
    levelset::applyDab(expected, {.center = {x, 32}, .radius = 8, .strength = 1});
  for (int column = 0; column < 65; ++column)
    EXPECT_NEAR(editor.field().at(column, 32), expected.at(column, 32), 1e-5) << column;
  EXPECT_EQ(editor.actions().find("sculpt --brush raise --at=\"16"), 0u) << editor.actions();
  EXPECT_NE(editor.model()->terrain->field->heights, model->terrain->field->heights);
  EXPECT_FALSE(editor.strokes(camera).empty());
}

TEST(SculptEditor, UndoesAndRedoesStrokes) {
  const support::TemporaryFolder folder;
  const auto model = levelGround(folder);
  SculptEditor editor(model);
  const render::Camera camera = fromAbove();
  std::vector<HeightField> states = {editor.field()};
  for (const Brush brush : kBrushes) {
    editor.setChoice({.brush = brush, .radius = 6, .height = 2, .share = 1});
    ASSERT_TRUE(editor.press({30, 30}, camera));
    editor.moveTo({36, 33}, camera);
    EXPECT_FALSE(editor.undo());  // not during a stroke
    editor.release();
    states.push_back(editor.field());
  }
  const std::string all = editor.actions();
  for (std::size_t n = kBrushes.size(); n-- > 0;) {
    ASSERT_TRUE(editor.undo());
    EXPECT_TRUE(haveSameBits(editor.field(), states[n])) << n;
  }
  EXPECT_FALSE(editor.undo());
  EXPECT_TRUE(editor.actions().empty());
  while (editor.redo()) {
  }
  EXPECT_TRUE(haveSameBits(editor.field(), states.back()));
  EXPECT_EQ(editor.actions(), all);
  // A new stroke replaces what was undone.
  EXPECT_TRUE(editor.undo());
  ASSERT_TRUE(editor.press({10, 10}, camera));
  editor.release();
  EXPECT_FALSE(editor.canRedo());
  // The edits bring the heights back.
  EXPECT_TRUE(editor.hasUnsaved());
  const levelset::GroundEdits edits = editor.edits();
  editor.noteSaved();
  EXPECT_FALSE(editor.hasUnsaved());
  EXPECT_TRUE(haveSameBits(SculptEditor(model, &edits).field(), editor.field()));
}

TEST(SculptEditor, KeepsBrushesInRange) {
  const support::TemporaryFolder folder;
  SculptEditor editor(levelGround(folder));
  editor.setChoice({.radius = 0, .height = -1, .share = 4});
  EXPECT_EQ(editor.choice().radius, 1.5);
  EXPECT_EQ(editor.choice().height, 0);
  EXPECT_EQ(editor.choice().share, 1);
  EXPECT_FALSE(editor.press({-20, 5}, fromAbove()));
  Model none;
  EXPECT_FALSE(whyNoSculpting(none).empty());
  ShownTerrain degrees;
  degrees.wasGeographic = true;
  none.terrain = std::make_shared<const ShownTerrain>(degrees);
  EXPECT_NE(whyNoSculpting(none).find("degrees"), std::string::npos);
}

}  // namespace sculpt_editor_test
