// Soft CSG and morphs along each ray: comparison with closed forms and with the solids alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "tests/support/field_scenes.h"
#include "tests/support/measured.h"

namespace field_truth_test {

using namespace support::fields;

/// Smooth union of balls of radius 8 and 6: value and gradient in closed form.
struct TwoBalls {
  V3d a{0.13, 0.27, 0.31}, b{11.2, 2.4, 1.7};
  double radiusA = 8, radiusB = 6, softness = 3;

  [[nodiscard]] double phi(const V3d& p, V3d& gradient) const {
    const V3d toA = p - a, toB = p - b;
    const double u = toA.length() - radiusA, v = toB.length() - radiusB;
    const double overlap = std::max(softness - std::abs(u - v), 0.0);
    const double later = overlap / (2 * softness);  // weight of the larger ball
    const double shareOfA = u < v ? 1 - later : later;
    gradient = toA.normalized() * shareOfA + toB.normalized() * (1 - shareOfA);
    return std::min(u, v) - overlap * overlap / (4 * softness);
  }
};

TEST(SoftCsg, OfBallsConvergesToTheClosedFormInSecondOrder) {
  // Derivatives read up to three voxels beyond the blended region.
  const TwoBalls exact;
  for (const bool isJudge : {false, true}) {
    std::vector<double> depths, normals;
    for (const double voxel : {1.0, 0.5, 0.25}) {
      const Scene scene = blended({exactBall(exact.a, exact.radiusA, voxel, 3 / voxel + 4),
                                   exactBall(exact.b, exact.radiusB, voxel, 3 / voxel + 4)},
                                  "a | b", exact.softness, 160, 120);
      const Image image = isJudge ? renderEmbree(scene, kDataOnly) : renderCpu(scene, kDataOnly);
      double deepest = 0, turned = 0;
      std::size_t hits = 0, joint = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const auto pixel = pixelOf(image, i);
        if (!pixel) continue;
        V3d gradient;
        deepest = std::max(deepest, std::abs(exact.phi(pixel->place, gradient)));
        turned = std::max(turned, (pixel->normal - gradient.normalized()).length());
        ++hits;
        joint += image.channels.at("curvature.k2")[i] < -0.02f;  // the saddle between the balls
      }
      EXPECT_GT(hits, 3000u);
      EXPECT_GT(joint, 100u);
      EXPECT_FALSE(image.attributes.contains("ls:warning"));
      depths.push_back(deepest);
      normals.push_back(turned);
    }
    for (const auto& errors : {depths, normals})
      for (std::size_t n = 1; n < errors.size(); ++n)
        EXPECT_GT(std::log2(errors[n - 1] / errors[n]), 1.7)
            << errors[n - 1] << " to " << errors[n] << (isJudge ? ", judge" : "");
    EXPECT_LT(depths.back(), support::measured(0.00259));
  }
}

TEST(SoftCsg, BridgesAGapBetweenSolids) {
  // Distance 1 apart: the smooth minimum in the middle is 0.5 − K/4.
  const NarrowBand a = levelset::makeSphere(10, V3d(-10.5, 0, 0), 0.5, {.halfWidth = 8}),
                   b = levelset::makeSphere(10, V3d(10.5, 0, 0), 0.31, {.halfWidth = 13});
  for (const double softness : {1.6, 3.6}) {
    Scene scene = blended({a, b}, "a | b", softness, 161, 121);
    scene.camera.from = V3d(0, 0, 60);
    scene.camera.to = V3d(0);
    const Image cpu = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
    const std::size_t middle = 60 * 161 + 80;
    for (const Image* image : {&cpu, &judge}) {
      const auto pixel = pixelOf(*image, middle);
      ASSERT_EQ(pixel.has_value(), softness > 2);
      if (!pixel) continue;
      // √(10.5² + z²) − 10 = K/4
      EXPECT_NEAR(pixel->place.z, std::sqrt(std::pow(10 + 0.25 * softness, 2) - 10.5 * 10.5),
                  support::measured(0.00452));
      EXPECT_NEAR(pixel->normal.z, 1, support::rounding(2));
      EXPECT_LT(image->channels.at("curvature.k2")[middle], -0.1f);
      // Both colours have equal weight.
      EXPECT_NEAR(image->channels.at("R")[middle] / image->channels.at("G")[middle], 1,
                  support::measured(0.113));
    }
    EXPECT_TRUE(compareImages(cpu, judge).agrees()) << compareImages(cpu, judge).reason();
  }
}

TEST(SoftCsg, ConvergesToHardCsgAsTheSoftnessVanishes) {
  const NarrowBand ball = levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1),
                   box = levelset::makeBox(V3d(24), V3d(8.1, 6.3, 9.2), 0.61);
  for (const char* csg : {"a | b", "a & b", "a - b", "b - a"}) {
    const Scene hard = blended({ball, box}, csg, 0, 160, 120);
    const Image sharp = renderCpu(hard, kDataOnly);
    double before = HUGE_VAL;
    for (const double softness : {1.8, 0.2, 1e-6}) {
      Scene scene = hard;
      scene.softness = softness;
      const Image soft = renderCpu(scene, kDataOnly);
      std::size_t both = 0, unlike = 0;
      double sum = 0;
      for (std::size_t i = 0; i < soft.pixelCount(); ++i) {
        const auto p = pixelOf(soft, i), q = pixelOf(sharp, i);
        unlike += p.has_value() != q.has_value();
        if (!p || !q) continue;
        ++both;
        sum += std::min(1.0, (p->place - q->place).length());
        if (softness < 1e-3) unlike += (p->place - q->place).length() > 2e-4;
      }
      ASSERT_GT(both, 1000u) << csg;
      EXPECT_TRUE(softness > 1e-3 || unlike <= both / 1000) << csg << ": " << unlike;
      EXPECT_LT(sum, before) << csg << " at " << softness;
      before = sum;
    }
  }
}

TEST(Morph, BeginsAndEndsAtTheSolids) {
  const NarrowBand ball = levelset::makeSphere(12, V3d(0.1, 0.2, 0.3), 0.7),
                   rings = support::rings();
  for (const bool isEnd : {false, true}) {
    const Scene scene = morphed(ball, rings, isEnd ? 1 : 0);
    Scene alone = scene;
    alone.morph.reset();
    alone.solids.erase(alone.solids.begin() + (isEnd ? 0 : 1));
    const ImageComparison found =
        compareImages(renderCpu(scene, kDataOnly), renderCpu(alone, kDataOnly));
    EXPECT_TRUE(found.agrees()) << found.reason();
    EXPECT_GT(found.bothHit, 500u);
    const ImageComparison judged =
        compareImages(renderEmbree(scene, kDataOnly), renderEmbree(alone, kDataOnly));
    EXPECT_TRUE(judged.agrees()) << judged.reason();
  }
}

TEST(Morph, OfConcentricBallsIsABall) {
  const double voxel = 0.25;
  for (const double share : {0.25, 0.5, 0.8}) {
    const double radius = 8 + share;
    const Scene scene = morphed(exactBall(V3d(0.1, 0.2, 0.3), 8, voxel, 8),
                                exactBall(V3d(0.1, 0.2, 0.3), 9, 0.8 * voxel, 8), share);
    for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
      std::size_t hits = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const auto pixel = pixelOf(image, i);
        if (!pixel) continue;
        ++hits;
        const V3d away = pixel->place - V3d(0.1, 0.2, 0.3);
        ASSERT_NEAR(away.length(), radius, 0.26 * voxel * voxel / radius + 1e-4);
        ASSERT_NEAR(pixel->normal.dot(away.normalized()), 1, support::rounding(0.8));
        ASSERT_NEAR(image.channels.at("curvature.mean")[i], 1 / radius, support::measured(2.95e-5));
      }
      EXPECT_GT(hits, 3000u);
      EXPECT_FALSE(image.attributes.contains("ls:warning"));
    }
  }
}

TEST(Morph, ReportsWhereTheBandsEnd) {
  // Solids 10 apart in bands of 3. Between them neither distance is known.
  const Scene scene =
      morphed(levelset::makeSphere(10, V3d(0), 1), levelset::makeSphere(20, V3d(0), 1), 0.3);
  for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
    ASSERT_TRUE(image.attributes.contains("ls:warning"));
    EXPECT_NE(image.attributes.at("ls:warning").find("widen the bands"), std::string::npos);
  }
}

}  // namespace field_truth_test
