// Bézier volumes as operands of the expression of a scene: closed forms, the judge, light,
// refusals.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/bezier/solid_crossings.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/views/scene_file.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/files.h"

namespace bezier_operands_test {

using Imath::V3d;
using namespace render;

const RenderOptions kPlain{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
constexpr double kNone = 1e9;

/// A ball as a Bézier volume.
BezierVolume ball(const V3d& centre, double radius) {
  BezierVolume volume = bezier_scenes::sphere(2);
  for (V3d& p : volume.patches[0].points) p = centre + p * radius;
  return volume;
}

/// The Bézier ball of radius 1 about the origin, a, and a ball of radius 0.8 about (0.9, 0.3, 0.4),
/// b.
Scene twoBalls(const std::string& expression, bool isBandSecond) {
  const V3d centre(0.9, 0.3, 0.4);
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(ball(V3d(0), 1)), .id = 5, .name = "a"});
  std::vector<std::string> names{"a"};
  if (isBandSecond) {
    scene.solids.push_back({.band = levelset::makeSphere(0.8, centre, 0.05), .id = 8, .name = "b"});
    names.insert(names.begin(), "b");
  } else {
    scene.beziers.push_back({.caster = BezierCaster(ball(centre, 0.8)), .id = 8, .name = "b"});
    names.emplace_back("b");
  }
  scene.csg = CsgExpression(expression, names);
  scene.camera = {.from = {0.6, 1.2, 5}, .to = {0.4, 0, 0}, .width = 48, .height = 36};
  return scene;
}

/// Interval of a line in a ball; empty: from kNone.
std::pair<double, double> intervalOf(const Camera::Ray& ray, const V3d& centre, double radius) {
  const V3d from = ray.origin - centre;
  const double b = from.dot(ray.direction), d = b * b - from.length2() + radius * radius;
  return d > 0 ? std::pair(-b - std::sqrt(d), -b + std::sqrt(d)) : std::pair(kNone, kNone);
}

/// First distance where the state of `holds` changes along a ray through the two balls.
template <typename Holds>
double firstChange(const Camera::Ray& ray, const Holds& holds) {
  const auto a = intervalOf(ray, V3d(0), 1), b = intervalOf(ray, V3d(0.9, 0.3, 0.4), 0.8);
  std::vector<double> all;
  for (const double t : {a.first, a.second, b.first, b.second})
    if (t > ray.near && t < kNone) all.push_back(t);
  std::sort(all.begin(), all.end());
  const auto at = [&](double t) {
    return holds(t > a.first && t<a.second, t> b.first && t < b.second);
  };
  for (const double t : all)
    if (at(t - 1e-7) != at(t + 1e-7)) return t;
  return kNone;
}

struct Case {
  const char* expression;
  bool (*holds)(bool, bool);
};
const Case kCases[] = {{"a | b", [](bool a, bool b) { return a || b; }},
                       {"a & b", [](bool a, bool b) { return a && b; }},
                       {"a - b", [](bool a, bool b) { return a && !b; }},
                       {"b - a", [](bool a, bool b) { return b && !a; }}};

TEST(BezierOperands, HaveTheClosedFormOfTwoBalls) {
  for (const bool isBandSecond : {false, true})
    for (const Case& one : kCases) {
      SCOPED_TRACE(std::string(one.expression) + (isBandSecond ? " with a level set" : ""));
      const Scene scene = twoBalls(one.expression, isBandSecond);
      const Image image = renderCpu(scene, kPlain);
      std::size_t pixel = 0, hits = 0;
      double worst = 0;
      for (int y = 0; y < scene.camera.height; ++y)
        for (int x = 0; x < scene.camera.width; ++x, ++pixel) {
          const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
          const double exact = firstChange(ray, one.holds);
          const bool isHit = image.ids.at("id")[pixel] != 0;
          // Level sets have their own outline: pixels within a thousandth of it may differ.
          if (isHit != (exact < kNone)) {
            EXPECT_TRUE(isBandSecond) << x << " " << y;
            continue;
          }
          if (!isHit) continue;
          ++hits;
          const double depth = exact * ray.direction.dot(scene.camera.axis());
          worst =
              std::max(worst, std::abs(static_cast<double>(image.channels.at("Z")[pixel]) - depth));
        }
      EXPECT_GT(hits, 100U);
      // Z is stored in single precision: 2.4e-7 of 5. The level set has voxels of 0.05: 0.0036.
      EXPECT_LT(worst, isBandSecond ? 0.01 : 5e-7);
    }
}

TEST(BezierOperands, HaveThePictureOfTheJudge) {
  for (const bool isBandSecond : {false, true})
    for (const Case& one : kCases) {
      SCOPED_TRACE(one.expression);
      Scene scene = twoBalls(one.expression, isBandSecond);
      const ImageComparison found =
          compareImages(renderCpu(scene, kPlain), renderEmbree(scene, kPlain));
      EXPECT_TRUE(found.agrees()) << found.reason();
      EXPECT_GT(found.bothHit, 100U);
    }
}

/// Two patches with a ball each, which overlap.
BezierVolume overlapping() {
  BezierVolume volume = ball(V3d(0), 1);
  volume.patches.push_back(ball(V3d(0.9, 0.3, 0.4), 0.8).patches[0]);
  return volume;
}

/// Overlapping patches, and a die, cut by a level set. The judge combines the roots by code of its
/// own.
TEST(BezierOperands, OverlappingLayersAndExpressionsOfAttributesAgreeWithTheJudge) {
  for (const BezierVolume& volume : {overlapping(), bezier_scenes::dice()})
    for (const char* expression : {"a - b", "b - a", "a & b"}) {
      SCOPED_TRACE(expression);
      Scene scene;
      scene.solids.push_back(
          {.band = levelset::makeSphere(0.7, V3d(0.3, 0.2, 0.9), 0.05), .id = 8, .name = "b"});
      scene.beziers.push_back({.caster = BezierCaster(volume), .id = 5, .name = "a"});
      scene.csg = CsgExpression(expression, {"b", "a"});
      scene.camera = {.from = {0.4, 1.5, 4.5}, .to = {0.2, 0, 0}, .width = 32, .height = 24};
      const Image image = renderCpu(scene, kPlain);
      const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
      EXPECT_TRUE(found.agrees()) << found.reason();
      EXPECT_GT(found.bothHit, 15U);
    }
}

/// The surfaces inside a volume of overlapping patches are hidden.
TEST(BezierOperands, OverlappingPatchesAreTheirUnion) {
  Scene scene = twoBalls("a | b", false);
  const Image both = renderCpu(scene, kPlain);
  scene.beziers = {{.caster = BezierCaster(overlapping()), .id = 5, .name = "a"}};
  scene.csg = CsgExpression("a", {"a"});
  EXPECT_EQ(renderCpu(scene, kPlain).channels.at("Z"), both.channels.at("Z"));
  const Camera::Ray ray = scene.camera.ray(24, 18);
  scene.beziers[0].opacity = 0.5;  // two surfaces of the union, and not four
  EXPECT_NEAR(KernelScene(scene, RenderOptions{})
                  .transmittances(CpuTracer(), {{ray.origin, ray.direction, 100, 1}})[0],
              0.25, 1e-15);
}

TEST(BezierOperands, AnExpressionOfOneNameHasTheBitsOfThePartAlone) {
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::dice()), .id = 5, .name = "a"});
  scene.camera = {.from = {0.4, 1.5, 4.5}, .to = {0.2, 0, 0}, .width = 32, .height = 24};
  const Image alone = renderCpu(scene, kPlain);
  scene.csg = CsgExpression("a", {"a"});
  const Image operand = renderCpu(scene, kPlain);
  EXPECT_EQ(alone.channels, operand.channels);
  EXPECT_EQ(alone.ids, operand.ids);
}

/// A ray that is inside an operand on its entire visible part has no crossing with it there.
TEST(BezierOperands, AnEyeInsideSeesTheOtherOperand) {
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(ball(V3d(0), 3)), .id = 5, .name = "a"});
  scene.beziers.push_back({.caster = BezierCaster(ball(V3d(0), 0.5)), .id = 6, .name = "b"});
  scene.csg = CsgExpression("a & b", {"a", "b"});
  scene.camera = {.from = {0, 0, 2}, .far = 2.2, .width = 9, .height = 9};
  const Image image = renderCpu(scene, kPlain);
  EXPECT_EQ(image.ids.at("id")[40], 6U);
  EXPECT_NEAR(image.channels.at("Z")[40], 1.5, 1e-6);
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(BezierOperands, BlockLightWhereTheExpressionHolds) {
  for (const Case& one : kCases) {
    SCOPED_TRACE(one.expression);
    const Scene scene = twoBalls(one.expression, false);
    const KernelScene surfaces(scene, RenderOptions{});
    const EmbreeScene judge(scene);
    bezier_scenes::Numbers numbers(5);
    std::vector<LightRay> rays;
    std::vector<double> exact;
    while (rays.size() < 200) {
      const Camera::Ray ray{V3d(2 * numbers(), 2 * numbers(), 2 * numbers()),
                            V3d(numbers(), numbers(), numbers()).normalized()};
      rays.push_back({ray.origin, ray.direction, 2 + numbers(), 1});
      exact.push_back(firstChange(ray, one.holds) <= rays.back().maxDistance ? 0 : 1);
    }
    EXPECT_EQ(surfaces.transmittances(CpuTracer(), rays), exact);
    for (std::size_t n = 0; n < rays.size(); ++n)
      EXPECT_EQ(judge.transmittance(rays[n].origin, rays[n].direction, rays[n].maxDistance),
                exact[n]);
    EXPECT_GT(std::count(exact.begin(), exact.end(), 0.0), 5);
  }
}

TEST(BezierOperands, TransparentOperandsMixInTheOrderOfTheirDepths) {
  Scene scene = twoBalls("a - b", true);
  scene.beziers[0].opacity = 0.4;
  scene.solids[0].opacity = 0.5;
  scene.beziers.push_back({.caster = BezierCaster(ball(V3d(-0.2, 0.1, 0), 0.3)),
                           .colour = {0.1f, 0.5f, 0.2f},
                           .id = 9,
                           .name = "c",
                           .opacity = 0.3});
  const Image image = renderCpu(scene, kPlain), judged = renderEmbree(scene, kPlain);
  for (const char* channel : {"R", "G", "B", "A"}) {
    const std::vector<float>&a = image.channels.at(channel), &b = judged.channels.at(channel);
    float most = 0;
    for (std::size_t n = 0; n < a.size(); ++n) most = std::max(most, std::abs(a[n] - b[n]));
    EXPECT_LT(most, 2e-5f) << channel;
  }
}

/// Mirrored rays start at any point, beside and inside the operands.
TEST(BezierOperands, AreSeenInMirrors) {
  for (const bool isBandSecond : {false, true}) {
    Scene scene = twoBalls("b - a", isBandSecond);
    scene.camera.from = {-4, 0.5, 1};
    RenderOptions options = kPlain;
    options.optics = {.reflect = 0.5, .bounces = 2};
    const Image image = renderCpu(scene, options), judged = renderEmbree(scene, options);
    const std::vector<float>&a = image.channels.at("R"), &b = judged.channels.at("R");
    std::size_t hits = 0, different = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
      if (image.ids.at("id")[n] == 0) continue;
      ++hits;
      if (!(std::abs(a[n] - b[n]) < 1e-3f)) ++different;
    }
    EXPECT_GT(hits, 30U);
    // Rays that graze an edge of the cut may see the other side of it.
    EXPECT_LE(different, hits / 50);
  }
}

TEST(BezierOperands, AreReadAndWritten) {
  const support::TemporaryFolder folder;
  const Scene scene = twoBalls("a - b", true);
  writeScene(folder.path() / "cut.json", {scene, true});
  const ViewedScene again = readScene(folder.path() / "cut.json");
  EXPECT_EQ(again.scene.csg.text(), "a - b");
  EXPECT_TRUE(again.scene.isOperand(0));
  EXPECT_EQ(renderCpu(scene, kPlain).ids, renderCpu(again.scene, kPlain).ids);
}

TEST(BezierOperands, BoundsAreThoseOfTheExpression) {
  const Scene scene = twoBalls("a & b", false);
  EXPECT_NEAR(scene.bounds().min.x, 0.1, 0.2);  // the box of the parts is somewhat larger
  EXPECT_LT(scene.bounds().max.x, 1.25);
  EXPECT_LT(scene.extents({V3d(1, 0, 0)})[0], 1.25);
}

TEST(BezierOperands, RefuseOpenSurfacesAndFolds) {
  const auto refusal = [](const BezierVolume& volume) -> std::string {
    Scene scene;
    scene.beziers.push_back({.caster = BezierCaster(volume), .name = "a"});
    scene.csg = CsgExpression("a", {"a"});
    scene.camera.width = scene.camera.height = 4;
    try {
      (void)renderCpu(scene, kPlain);
    } catch (const levelset::InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal(bezier_scenes::sphereSurfaces()).find("open at patch 1"), std::string::npos);
  EXPECT_NE(refusal(bezier_scenes::trimmedSurface()).find("open"), std::string::npos);
  EXPECT_NE(refusal(bezier_scenes::saddle()).find("'a' cannot be an operand"), std::string::npos);
  EXPECT_NE(refusal(bezier_scenes::bentCylinder()).find("open"), std::string::npos);
  EXPECT_NE(refusal(bezier_scenes::folded()).find("its map folds in patch 1"), std::string::npos);
  EXPECT_EQ(refusal(bezier_scenes::sphere(3)), "");
  EXPECT_EQ(refusal(bezier_scenes::dice()), "");
  Scene soft = twoBalls("a | b", false);
  soft.softness = 0.1;
  EXPECT_THROW(requireOperands(soft), levelset::UsageError);
}

/// The faces between patches of a B-spline volume, and a face that collapses to the axis, are no
/// openings.
TEST(BezierOperands, InnerAndCollapsedFacesAreClosed) {
  const V3d low(-1.25), high(1.25);
  BezierVolume halves;
  for (const double side : {0.0, 1.0}) {
    const V3d from(side == 0 ? low.x : 0, low.y, low.z), to(side == 0 ? 0 : high.x, high.y, high.z);
    halves.patches.push_back(bezier_scenes::boxPatch({2, 2, 2}, from, to));
    bezier_scenes::addAttribute(halves.patches.back(), bezier_scenes::ballTerms(V3d(0), 1), from,
                                to);
  }
  EXPECT_EQ(findOpenPatch(halves), 2U);
  halves.patches.pop_back();
  EXPECT_EQ(findOpenPatch(halves), 0U);
  // A quarter of a ball about the axis is open at its two flat faces.
  EXPECT_EQ(findOpenPatch(bezier_scenes::collapsedEdge()), 0U);
  // Mirrored maps do not fold, although their Jacobian is negative.
  BezierVolume mirrored = bezier_scenes::sphere(2);
  for (V3d& p : mirrored.patches[0].points) p.x = -p.x;
  EXPECT_EQ(findFoldedPatch(mirrored), 1U);
  EXPECT_EQ(findFoldedPatch(bezier_scenes::folded()), 0U);
  // Four quarters are closed, although all of them collapse to the axis.
  BezierVolume whole;
  for (int quarter = 0; quarter < 4; ++quarter) {
    BezierPatch patch = bezier_scenes::collapsedEdge().patches[0];
    for (V3d& p : patch.points)
      for (int turn = 0; turn < quarter; ++turn) p = V3d(-p.y, p.x, p.z);
    whole.patches.push_back(patch);
  }
  EXPECT_EQ(findOpenPatch(whole), 4U);
  // A copy lies on the same side of each face, so it closes nothing.
  BezierVolume twice;
  twice.patches = {whole.patches[0], whole.patches[0]};
  EXPECT_EQ(findOpenPatch(twice), 0U);
}

// === Crossings

BezierRoot rootAt(double distance, bool isEntry, bool isSingular = false) {
  BezierRoot root;
  root.distance = root.depth = distance;
  root.isEntry = isEntry;
  root.isSingular = isSingular;
  return root;
}

/// Distances of the crossings; exits are negative.
std::vector<double> crossingsOf(const std::vector<BezierRoot>& roots, bool startsOutside = true) {
  std::vector<double> all;
  for (const BezierRoot& root : solidCrossings(roots, startsOutside).roots)
    all.push_back(root.isEntry ? root.distance : -root.distance);
  return all;
}

TEST(SolidCrossings, JoinOverlappingLayers) {
  EXPECT_EQ(crossingsOf({}), std::vector<double>());
  EXPECT_EQ(crossingsOf({rootAt(1, true), rootAt(2, false)}), (std::vector<double>{1, -2}));
  EXPECT_EQ(crossingsOf({rootAt(1, true), rootAt(2, true), rootAt(3, false), rootAt(4, false),
                         rootAt(5, true), rootAt(6, false)}),
            (std::vector<double>{1, -4, 5, -6}));
  // The ray begins in two layers.
  EXPECT_EQ(crossingsOf({rootAt(1, false), rootAt(2, false)}, false), (std::vector<double>{-2}));
}

TEST(SolidCrossings, SingularRootsCountWhereTheyAreNeeded) {
  // A touching point outside, and one inside.
  EXPECT_EQ(crossingsOf({rootAt(1, true, true), rootAt(2, true), rootAt(3, false)}),
            (std::vector<double>{2, -3}));
  EXPECT_EQ(crossingsOf({rootAt(1, true), rootAt(2, true, true), rootAt(3, false)}),
            (std::vector<double>{1, -3}));
  // An exit and an entry at a collapsed edge, whatever its normal says.
  EXPECT_EQ(crossingsOf({rootAt(1, true), rootAt(2, true, true)}), (std::vector<double>{1, -2}));
  EXPECT_EQ(crossingsOf({rootAt(1, true, true), rootAt(2, false)}), (std::vector<double>{1, -2}));
  EXPECT_EQ(crossingsOf({rootAt(1, true, true), rootAt(2, false)}, false),
            (std::vector<double>{-2}));
}

TEST(SolidCrossings, DropSingularRootsBetweenOverlappingLayers) {
  // Two layers overlap, and the ray touches a surface between their ends.
  EXPECT_EQ(crossingsOf({rootAt(1, true), rootAt(2, true), rootAt(3, false),
                         rootAt(3.5, true, true), rootAt(4, false)}),
            (std::vector<double>{1, -4}));
}

TEST(SolidCrossings, TellOpenSurfaces) {
  EXPECT_FALSE(solidCrossings(std::vector{rootAt(1, true), rootAt(2, false)}, true).isOpen);
  EXPECT_TRUE(solidCrossings(std::vector{rootAt(1, true)}, true).isOpen);
  EXPECT_TRUE(solidCrossings(std::vector{rootAt(1, false)}, true).isOpen);
  EXPECT_FALSE(solidCrossings(std::vector{rootAt(1, false)}, false).isOpen);
}

}  // namespace bezier_operands_test
