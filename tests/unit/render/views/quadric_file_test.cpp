// Files of quadrics: kinds, defaults, refusals.

#include "render/views/quadric_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/quadric_scenes.h"

namespace quadric_file_test {

using Imath::V3d;
using namespace render;

std::string documentWith(const std::string& entries) {
  return R"({"format": "levelsmith quadrics", "version": 1, "quadrics": [)" + entries + "]}";
}

TEST(QuadricFile, ReadsAllKinds) {
  const QuadricModel model = parseQuadrics(
      documentWith(
          R"({"kind": "sphere", "centre": [1, 2, 3], "radius": 0.5, "colour": [1, 0, 0]},
             {"kind": "cylinder", "ends": [[0, 0, 0], [0, 0, 2]], "radius": 0.25},
             {"kind": "cone", "position": [0, 0, 0], "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 3]]},
             {"kind": "two-sheet hyperboloid", "position": [4, 0, 0],
              "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "range": [-3, 1.5], "capped": false})"),
      "text");
  ASSERT_EQ(model.balls.size(), 1U);
  EXPECT_EQ(model.balls[0].centre, V3d(1, 2, 3));
  EXPECT_EQ(model.balls[0].colour, 0x0000ffU);
  ASSERT_EQ(model.sticks.size(), 1U);
  EXPECT_EQ(model.sticks[0].b, V3d(0, 0, 2));
  ASSERT_EQ(model.quadrics.size(), 2U);
  EXPECT_EQ(model.quadrics[0].range.high, 1);
  EXPECT_TRUE(model.quadrics[0].isCapped);
  EXPECT_EQ(model.quadrics[1].kind, QuadricKind::TwoSheet);
  EXPECT_EQ(model.quadrics[1].range.low, -3);
  EXPECT_FALSE(model.quadrics[1].isCapped);
}

TEST(QuadricFile, IsReadAsItWasWritten) {
  const support::TemporaryFolder folder;
  quadric_scenes::Numbers numbers(3);
  QuadricModel model{
      quadric_scenes::ballsInCube(20, numbers), quadric_scenes::sticksInCube(20, numbers), {}};
  for (int n = 0; n < kQuadricKinds; ++n)
    model.quadrics.push_back(
        quadric_scenes::randomQuadric(static_cast<QuadricKind>(n), numbers.inBox(2), 5, numbers));
  const auto file = folder.path() / "some.json";
  writeQuadrics(file, model);
  EXPECT_TRUE(isQuadricFile(file));
  const QuadricModel again = readQuadrics(file);
  ASSERT_EQ(again.balls.size(), model.balls.size());
  ASSERT_EQ(again.sticks.size(), model.sticks.size());
  ASSERT_EQ(again.quadrics.size(), model.quadrics.size());
  for (std::size_t n = 0; n < 20; ++n) {
    EXPECT_EQ(again.balls[n].centre, model.balls[n].centre);
    EXPECT_EQ(again.balls[n].radius, model.balls[n].radius);
    EXPECT_EQ(again.balls[n].colour, model.balls[n].colour);
    EXPECT_EQ(again.sticks[n].b, model.sticks[n].b);
  }
  for (std::size_t n = 0; n < model.quadrics.size(); ++n) {
    EXPECT_EQ(again.quadrics[n].kind, model.quadrics[n].kind);
    EXPECT_EQ(again.quadrics[n].axes, model.quadrics[n].axes);
    EXPECT_EQ(again.quadrics[n].isCapped, model.quadrics[n].isCapped);
    EXPECT_EQ(again.quadrics[n].colour, model.quadrics[n].colour);
  }
  std::ofstream(folder.path() / "other.json") << R"({"format": "levelsmith scene"})";
  EXPECT_FALSE(isQuadricFile(folder.path() / "other.json"));
}

TEST(QuadricFile, NamesTheEntryThatIsWrong) {
  const auto reasonOf = [](const std::string& text) -> std::string {
    try {
      static_cast<void>(parseQuadrics(text, "some.json"));
    } catch (const levelset::InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const std::string good = R"({"kind": "sphere", "centre": [0, 0, 0], "radius": 1})";
  const auto expect = [&](const std::string& text, const std::string& part) {
    const std::string reason = reasonOf(text);
    EXPECT_NE(reason.find(part), std::string::npos) << reason;
    EXPECT_EQ(reason.find("some.json"), 0U) << reason;
  };
  EXPECT_EQ(reasonOf(documentWith(good)), "");
  expect("{", "is not a JSON document");
  expect(R"({"format": "levelsmith scene", "version": 1})", "is not a file of quadrics");
  expect(R"({"format": "levelsmith quadrics", "version": 2, "quadrics": []})",
         "does not have version 1");
  expect(documentWith(""), "has no quadric");
  expect(documentWith(good + R"(, {"kind": "ball"})"),
         "entry 2 of \"quadrics\": the file has the unknown kind \"ball\"; the kinds are sphere, "
         "ellipsoid, cylinder, cone");
  expect(documentWith(R"({"kind": "sphere", "centre": [0, 0], "radius": 1})"),
         "has 2 numbers in \"centre\", not 3");
  expect(documentWith(R"({"kind": "sphere", "centre": [0, 0, 0]})"), "has no \"radius\"");
  expect(documentWith(R"({"kind": "sphere", "centre": [0, 0, 0], "radius": -1})"),
         "entry 1 of \"quadrics\": a sphere has the radius -1");
  expect(documentWith(R"({"kind": "sphere", "centre": [0, 0, 0], "radius": 1, "id": 4})"),
         "has an unknown \"id\"");
  expect(documentWith(R"({"kind": "cylinder", "ends": [[0, 0, 0]], "radius": 1})"),
         "has \"ends\" that are not 2 lists");
  expect(
      documentWith(R"({"kind": "sphere", "centre": [0, 0, 0], "radius": 1, "colour": [0, 2, 0]})"),
      "has a \"colour\" with a number outside 0 … 1");
  expect(
      documentWith(
          R"({"kind": "cone", "position": [0, 0, 0], "axes": [[1, 0, 0], [0, 1, 0], [1, 1, 0]]})"),
      "a quadric has axes in one plane");
}

}  // namespace quadric_file_test
