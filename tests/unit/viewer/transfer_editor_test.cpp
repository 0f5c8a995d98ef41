// Editing of a transfer function with the mouse.

#include "apps/viewer/volume/transfer_editor.h"

#include <gtest/gtest.h>

namespace transfer_editor_test {

using Imath::C3f;
using render::TransferPoint;
using viewer::TransferEditor;

constexpr double kReach = 0.05;

TransferEditor editor() {
  return {{{20, 0.25, C3f(1, 0, 0)}, {10, 0, C3f(0, 0, 1)}, {40, 0.04, C3f(0, 1, 0)}}, 0, 50};
}

TEST(TransferEditor, DragsAPointBetweenItsNeighbours) {
  TransferEditor edit = editor();
  EXPECT_EQ(edit.points()[1].value, 20);  // ordered
  EXPECT_DOUBLE_EQ(edit.xOf(edit.points()[1]), 0.4);
  EXPECT_DOUBLE_EQ(TransferEditor::yOf(edit.points()[1]), 0.5);
  edit.press(0.41, 0.49, kReach, kReach);
  EXPECT_EQ(edit.selected(), 1u);
  EXPECT_EQ(edit.points().size(), 3u);
  EXPECT_EQ(edit.points()[1].value, 20);  // a press alone moves nothing
  edit.moveTo(0.6, 0.8);
  EXPECT_DOUBLE_EQ(edit.points()[1].value, 30);
  EXPECT_DOUBLE_EQ(edit.points()[1].opacity, 0.64);
  edit.moveTo(3, 7);
  EXPECT_NEAR(edit.points()[1].value, 40, 0.01);
  EXPECT_LT(edit.points()[1].value, 40);
  EXPECT_EQ(edit.points()[1].opacity, TransferEditor::kMostOpaque);
  edit.moveTo(-3, -7);
  EXPECT_NEAR(edit.points()[1].value, 10, 0.01);
  EXPECT_GT(edit.points()[1].value, 10);
  EXPECT_EQ(edit.points()[1].opacity, 0);
  edit.release();
  edit.moveTo(0.5, 0.5);
  EXPECT_NEAR(edit.points()[1].value, 10, 0.01);
  EXPECT_NO_THROW(render::TransferFunction(edit.points(), 1));
}

TEST(TransferEditor, AddsAPointWithTheColourThere) {
  TransferEditor edit = editor();
  edit.press(0.3, 0.6, kReach, kReach);
  ASSERT_EQ(edit.points().size(), 4u);
  EXPECT_EQ(edit.selected(), 1u);
  EXPECT_DOUBLE_EQ(edit.points()[1].value, 15);
  EXPECT_DOUBLE_EQ(edit.points()[1].opacity, 0.36);
  EXPECT_EQ(edit.points()[1].colour, C3f(0.5f, 0, 0.5f));
  edit.setColour(C3f(1, 1, 0));
  EXPECT_EQ(edit.points()[1].colour, C3f(1, 1, 0));
  edit.release();
  edit.press(0.05, 0.5, kReach, kReach);
  edit.release();
  edit.press(0.95, 0.5, kReach, kReach);
  EXPECT_EQ(edit.points().front().colour, C3f(0, 0, 1));
  EXPECT_EQ(edit.points().back().colour, C3f(0, 1, 0));
}

TEST(TransferEditor, RemovesAllPointsButTheLast) {
  TransferEditor edit = editor();
  edit.removeAt(0.3, 0.6, kReach, kReach);
  EXPECT_EQ(edit.points().size(), 3u);
  edit.removeAt(0.4, 0.5, kReach, kReach);
  edit.removeAt(0.2, 0, kReach, kReach);
  edit.removeAt(0.8, 0.2, kReach, kReach);
  ASSERT_EQ(edit.points().size(), 1u);
  EXPECT_EQ(edit.points()[0].value, 40);
}

}  // namespace transfer_editor_test
