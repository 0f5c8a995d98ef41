#include "render/views/bezier_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "levelset/error.h"
#include "render/bezier/shared_tree.h"
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
  for (const BezierVolume& volume : {bezier_scenes::teardrop(), bezier_scenes::collapsedEdge(),
                                     bezier_scenes::dice(), bezier_scenes::trimmedSurface()}) {
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
      ASSERT_EQ(again.patches[n].trim != nullptr, volume.patches[n].trim != nullptr);
      if (!volume.patches[n].trim) continue;
      EXPECT_EQ(again.patches[n].trim->region->loops(), volume.patches[n].trim->region->loops());
      EXPECT_EQ(again.patches[n].trim->box, volume.patches[n].trim->box);
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

TEST(BezierFile, ReadsTrimmingLoops) {
  const std::string square = R"({"degree": [1, 1], "points": [[0,0,0],[0,1,0],[1,0,0],[1,1,2]])";
  const auto withTrims = [&](const std::string& trims) {
    return document(square + R"(, "trims": )" + trims + "}");
  };
  const std::string triangle = R"({"polyline": [[0.1,0.1],[0.9,0.1],[0.1,0.9]]})",
                    drop = R"({"curves": [{"points": [[0.2,0.2],[0.3,0.2],[0.2,0.3],[0.2,0.2]]}]})";
  const BezierVolume cut =
      parseBezierVolume(withTrims("[" + triangle + "," + drop + "]"), "x.json");
  ASSERT_TRUE(cut.patches[0].trim);
  const render::TrimRegion& region = *cut.patches[0].trim->region;
  EXPECT_EQ(region.loops().size(), 2U);
  EXPECT_TRUE(region.contains({0.4, 0.4}));
  EXPECT_FALSE(region.contains({0.6, 0.6}));
  EXPECT_FALSE(region.contains({0.22, 0.22}));
  const auto expectRefusal = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(refusal(text).find(part), std::string::npos) << refusal(text);
  };
  expectRefusal(withTrims("[]"), "not a list of loops");
  expectRefusal(withTrims("[{}]"), "without one of \"polyline\" and \"curves\"");
  expectRefusal(withTrims(R"([{"polyline": [[0,0],[1,1]]}])"), "fewer than three points");
  expectRefusal(withTrims(R"([{"polyline": [[0,0],[1,1],[1]]}])"), "a point of 1 numbers");
  expectRefusal(withTrims(R"([{"curves": [{"points": [[0,0],[1,1]]}]}])"), "is not closed");
  expectRefusal(withTrims(R"([{"curves": []}])"), "has no curves");
  expectRefusal(withTrims(R"([{"spline": []}])"), "unknown \"spline\"");
  expectRefusal(document(kCube + R"(, "trims": [)" + triangle + "]}"), "\"trims\" of a volume");
  expectRefusal(document(square + R"(, "domain": [0,0,1,1]})"), "\"domain\" without \"trims\"");
  expectRefusal(document(square + R"(, "domain": [1,0,0,1], "trims": [)" + triangle + "]}"),
                "u0 < u1");
}

TEST(BezierFile, RefusesWithASentence) {
  EXPECT_EQ(refusal(document(kCube + "}")), "");
  EXPECT_EQ(refusal(document(kCube + R"(, "weights": [1,1,0,1,1,1,1,1]})")),
            "x.json: patch 0: weight 2 is 0; give positive weights from 1e-06 to 1000000");
  EXPECT_EQ(refusal(document(kCube + R"(, "weights": [1,1]})")),
            "x.json: entry 1 of \"patches\": the file has 2 weights for 8 control points; "
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
  const auto expectRefusal = [](const std::string& text, const std::string& part) {
    EXPECT_NE(refusal(text).find(part), std::string::npos) << refusal(text);
  };
  const auto withPoint = [](const std::string& point) {
    std::string text = kCube + "}";
    return document(text.replace(text.find("[1,0,0,0.5]"), 11, point));
  };
  EXPECT_EQ(refusal(withPoint("[1,0,0,0.5]")), "");
  for (const char* number : {"NaN", "Infinity", "1e999", "-1e999"})
    expectRefusal(withPoint(std::string("[1,0,0,") + number + "]"), "a number that is not finite");
  expectRefusal(withPoint("[1,0,0,1e31]"), "is 1e+31; give a finite number up to 1e+30");
  expectRefusal(withPoint("[1e31,0,0,1]"), "give finite coordinates up to 1e+30");
  expectRefusal(withPoint("[1,0,0]"), "a point of 3 numbers, not 4");
  expectRefusal(withPoint("[1,0,0,null]"), "\"points\" that is not finite");
  expectRefusal(withPoint("7"), "\"points\" that is not a list");
  expectRefusal(document(kCube + R"(, "count": [65536, 65536, 2]})"), "needs 8589934592");
  expectRefusal(document(kCube + R"(, "count": [1000000, 1000000, 1000000]})"), "needs 1e+18");
  expectRefusal(document(kCube + R"(, "count": [18446744073709551618, 2, 2]})"), "in \"count\"");
  expectRefusal(document(kCube + R"(, "count": [0, 2, 2]})"), "has 0 in \"count\"");
  expectRefusal(document(kCube + R"(, "degree": [1, 1, 1]})"), "lists \"degree\" twice");
  expectRefusal(document(kCube + "}", R"("version": 1, )"), "lists \"version\" twice");
  expectRefusal(document(kCube + "}", R"("attributes": 3, )"), "\"attributes\"");
  expectRefusal(document(kCube + R"(, "weights": {}})"), "\"weights\" that is not a list");
  expectRefusal(document(kCube + R"(, "knots": [[0,0,1,1],[0,0,1,1],[0,0,NaN,1]]})"), "not finite");
  expectRefusal(document(std::string(100'000, '[')), "too deeply nested");
}

/// Mutated files are refused with a sentence, or are volumes that are drawn. Half of the mutants
/// have other digits only.
TEST(BezierFile, TwoHundredMutatedFilesAreRefusedOrDrawn) {
  const support::TemporaryFolder folder;
  BezierVolume two = bezier_scenes::sphere(2);
  bezier_scenes::addAttribute(two.patches[0], {{{0.3, 1}, {1}, {1}}}, V3d(-1.25), V3d(1.25));
  two.expression = {0, 1, -3};
  std::mt19937 random(1);
  std::size_t refused = 0, drawn = 0, hits = 0;
  for (const BezierVolume& volume : {bezier_scenes::collapsedEdge(), two}) {
    writeBezierVolume(folder.path() / "volume.json", volume);
    const std::string text = support::readText(folder.path() / "volume.json");
    for (int mutant = 0; mutant < 100; ++mutant) {
      SCOPED_TRACE(mutant);
      std::string spoilt = mutant % 2 == 0 ? support::mutated(text, random) : text;
      for (int n = 0; mutant % 2 == 1 && n < 10; ++n)
        if (char& c = spoilt[random() % spoilt.size()]; c >= '0' && c <= '9')
          c = static_cast<char>('0' + random() % 10);
      BezierVolume read;
      try {
        read = parseBezierVolume(spoilt, "x.json");
      } catch (const levelset::Error& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).find("x.json: "), 0u) << error.what();
        EXPECT_GT(std::string(error.what()).size(), 40u) << error.what();
        continue;
      }
      render::Camera camera;
      camera.to = volume.bounds().center();
      camera.from = camera.to + V3d(1, -1.6, 0.9) * 2;
      camera.up = V3d(0, 0, 1);
      camera.width = camera.height = 8;
      const render::BezierPicture picture =
          castBezier(read, camera, {.maxBytes = std::size_t{200} << 20});
      ++drawn;
      hits += picture.roots.size();
      for (const render::BezierRoot& root : picture.roots) {
        EXPECT_TRUE(std::isfinite(root.depth));
        EXPECT_NEAR(root.normal.length(), 1, 1e-9);
      }
    }
  }
  EXPECT_EQ(refused + drawn, 200U);
  EXPECT_GT(refused, 80U);
  EXPECT_GT(drawn, 30U);
  EXPECT_GT(hits, 300U);
}

}  // namespace
