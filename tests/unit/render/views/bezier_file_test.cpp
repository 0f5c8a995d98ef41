#include "render/views/bezier_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "levelset/error.h"
#include "render/views/scene_file.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/files.h"

namespace {

using bezier_scenes::V3d;
using render::BezierVolume;
using render::parseBezierVolume;

/// A linear patch whose attribute is x − 0.5, with replaceable members.
std::string document(const std::string& patch, const std::string& more = "") {
  return R"({"format": "levelsmith bezier volume", "version": 1, )" + more + R"("patches": [)" +
         patch + "]}";
}

const std::string kCube =
    R"({"degree": [1, 1, 1], "points": [[0,0,0,-0.5],[0,0,1,-0.5],[0,1,0,-0.5],[0,1,1,-0.5],)"
    R"([1,0,0,0.5],[1,0,1,0.5],[1,1,0,0.5],[1,1,1,0.5]])";

std::string refusal(const std::string& text) {
  try {
    (void)parseBezierVolume(text, "x.json");
  } catch (const levelset::Error& error) {
    return error.what();
  }
  return "";
}

TEST(BezierFile, ReadsWhatItWrote) {
  const support::TemporaryFolder folder;
  for (const BezierVolume& volume :
       {bezier_scenes::teardrop(), bezier_scenes::collapsedEdge(), bezier_scenes::dice()}) {
    const std::filesystem::path file = folder.path() / "volume.json";
    writeBezierVolume(file, volume);
    EXPECT_TRUE(render::isBezierFile(file));
    const BezierVolume again = render::readBezierVolume(file);
    EXPECT_EQ(again.isovalue, volume.isovalue);
    EXPECT_EQ(again.expression, volume.expression);
    ASSERT_EQ(again.patches.size(), volume.patches.size());
    for (std::size_t n = 0; n < volume.patches.size(); ++n) {
      EXPECT_EQ(again.patches[n].degree, volume.patches[n].degree);
      EXPECT_EQ(again.patches[n].points, volume.patches[n].points);
      EXPECT_EQ(again.patches[n].attributes, volume.patches[n].attributes);
      EXPECT_EQ(again.patches[n].weights, volume.patches[n].weights);
    }
    const render::ViewedScene scene = render::readScene(file);
    ASSERT_EQ(scene.scene.beziers.size(), 1U);
    EXPECT_FALSE(scene.scene.bounds().isEmpty());
  }
}

TEST(BezierFile, IsKnownByItsFormatWhereverThatStands) {
  const support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "x.json";
  const auto isBezier = [&](const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
    return render::isBezierFile(file);
  };
  EXPECT_TRUE(isBezier(R"({"patches": [)" + kCube +
                       R"(}], "version": 1, "format": "levelsmith bezier volume"})"));
  EXPECT_FALSE(isBezier(R"({"solids": [{"name": "levelsmith bezier volume"}]})"));
  EXPECT_FALSE(isBezier(R"({"solids": [{"format": "levelsmith bezier volume"}]})"));
  EXPECT_FALSE(isBezier("levelsmith bezier volume"));
  EXPECT_FALSE(render::isBezierFile(folder.path()));
  EXPECT_FALSE(render::isBezierFile(folder.path() / "missing.json"));
}

TEST(BezierFile, ReadsSplines) {
  // Four control points of degree 1 along x are three patches.
  std::string points;
  for (int i = 0; i < 4; ++i)
    for (int n = 0; n < 4; ++n)
      points += std::string(points.empty() ? "" : ",") + "[" + std::to_string(i) + "," +
                std::to_string(n / 2) + "," + std::to_string(n % 2) + "," + std::to_string(i) +
                ".25]";
  const std::string patch =
      R"({"degree": [1, 1, 1], "count": [4, 2, 2], "points": [)" + points + "]";
  const BezierVolume uniform = parseBezierVolume(document(patch + "}"), "x.json");
  ASSERT_EQ(uniform.patches.size(), 3U);
  EXPECT_EQ(positionAt(uniform.patches[1], V3d(0.5, 0, 0)), V3d(1.5, 0, 0));
  EXPECT_EQ(attributeAt(uniform.patches[2], 0, V3d(1, 0, 0)), 3.25);
  const BezierVolume knots = parseBezierVolume(
      document(patch + R"(, "knots": [[0,0,0.25,0.5,1,1],[0,0,1,1],[0,0,1,1]]})"), "x.json");
  EXPECT_EQ(knots.patches.size(), 3U);
}

TEST(BezierFile, ReadsSurfaces) {
  const std::string square = R"({"degree": [1, 1], "points": [[0,0,0],[0,1,0],[1,0,0],[1,1,2]])";
  const BezierVolume surface = parseBezierVolume(document(square + "}"), "x.json");
  ASSERT_EQ(surface.patches.size(), 1U);
  EXPECT_EQ(positionAt(surface.patches[0], V3d(1, 0.5, 1.0 / 3)), V3d(1, 0.5, 1));
  EXPECT_NEAR(attributeAt(surface.patches[0], 0, V3d(0, 0, 1.0 / 3)), 0, 1e-16);
  EXPECT_NE(refusal(document(square + "}", R"("attributes": ["a", "b"], "expression": "a", )")),
            "");
  // A spline surface of two patches.
  const BezierVolume spline =
      parseBezierVolume(document(R"({"degree": [1, 1], "count": [3, 2], )"
                                 R"("points": [[0,0,0],[0,1,0],[1,0,0],[1,1,0],[2,0,0],[2,1,0]]})"),
                        "x.json");
  ASSERT_EQ(spline.patches.size(), 2U);
  EXPECT_EQ(positionAt(spline.patches[1], V3d(0.5, 0.5, 0)), V3d(1.5, 0.5, 0));
}

TEST(BezierFile, RefusesWithASentence) {
  EXPECT_EQ(refusal(document(kCube + "}")), "");
  EXPECT_EQ(refusal(document(kCube + R"(, "weights": [1,1,0,1,1,1,1,1]})")),
            "x.json: patch 0: weight 2 is 0; give positive weights from 1e-06 to 1000000");
  EXPECT_EQ(refusal(document(kCube + R"(, "weights": [1,1]})")),
            "x.json: entry 0 of \"patches\": the file has 2 weights for 8 control points; "
            "docs/bezier.md describes the format of Bézier volumes");
  EXPECT_NE(refusal(document(kCube + R"(, "wieghts": [1]})")).find("unknown \"wieghts\""),
            std::string::npos);
  EXPECT_NE(refusal(document(R"({"degree": [0, 1, 1], "points": []})")).find("from 1 to 20"),
            std::string::npos);
  EXPECT_NE(refusal(document(R"({"degree": [21, 1, 1], "points": []})")).find("from 1 to 20"),
            std::string::npos);
  EXPECT_NE(refusal(document(R"({"degree": [20, 20, 20], "points": []})")).find("needs 9261"),
            std::string::npos);
  EXPECT_NE(refusal(document("")).find("no patch"), std::string::npos);
  EXPECT_NE(refusal(document(kCube + "}", R"("attributes": ["a", "b"], )")).find("5"),
            std::string::npos);
  EXPECT_NE(refusal(document(kCube + "}", R"("expression": "a - b", )")), "");
  EXPECT_NE(refusal(document(kCube + "}", R"("isovalue": 1e999, )")), "");
  EXPECT_NE(refusal("{}"), "");
  EXPECT_NE(refusal(""), "");
}

TEST(BezierFile, SurvivesMutations) {
  const support::TemporaryFolder folder;
  writeBezierVolume(folder.path() / "volume.json", bezier_scenes::collapsedEdge());
  const std::string text = support::readText(folder.path() / "volume.json");
  std::uint64_t state = 1;
  const auto next = [&](std::size_t limit) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>(state >> 33) % limit;
  };
  constexpr std::string_view kLetters = "0123456789.-eE[]{},:\"";
  std::size_t refused = 0;
  for (int mutant = 0; mutant < 200; ++mutant) {
    std::string spoilt = text;
    for (int n = 0; n < 3; ++n) spoilt[next(spoilt.size())] = kLetters[next(kLetters.size())];
    if (mutant % 4 == 0) spoilt.resize(next(spoilt.size()));
    try {
      (void)parseBezierVolume(spoilt, "x.json");
    } catch (const levelset::Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100U);
}

}  // namespace
