// Streaks along lines of curvature: they follow the true directions, have no seams, and end at
// outlines.

#include "render/shading/curvature_lines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"
#include "tests/support/threads.h"

namespace curvature_lines_test {

using Imath::V2d;
using Imath::V3d;
using namespace render;
using support::measured;

RenderOptions optionsOf(Style style, int direction = 1) {
  RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0, .directions = true};
  options.style.style = style;
  options.style.direction = direction;
  return options;
}

V3d vectorAt(const Image& image, const std::string& name, std::size_t i) {
  return {image.channels.at(name + ".X")[i], image.channels.at(name + ".Y")[i],
          image.channels.at(name + ".Z")[i]};
}

Scene torusScene(bool isPerspective) {
  Scene scene = support::sceneOf(levelset::makeTorus(2, 0.8, V3d(0), V3d(0, 0, 1), 0.05), 240, 240);
  scene.camera.from = V3d(0.5, -2, 6);
  scene.camera.to = V3d(0);
  if (!isPerspective) scene.camera.orthoHeight = 6;
  return scene;
}

/// Position of a point in the picture, pixels.
V2d projected(const Camera& camera, const V3d& p) {
  V3d unit;
  camera.worldToNdc().multVecMatrix(p, unit);
  return {unit.x * camera.width, unit.y * camera.height};
}

/// Mean and covariance of pairs of numbers.
struct Correlation {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  void add(double x, double y) {
    n += 1;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  [[nodiscard]] double value() const {
    return (n * ab - a * b) / std::sqrt((n * aa - a * a) * (n * bb - b * b));
  }
};

/// The factors by which the streaks change the colours; 0 beside the surface.
std::vector<double> factorsOf(const Image& streaks, const Image& lit) {
  std::vector<double> factors(lit.pixelCount(), 0);
  for (std::size_t i = 0; i < factors.size(); ++i)
    if (lit.channels.at("R")[i] > 0)
      factors[i] = static_cast<double>(streaks.channels.at("R")[i]) / lit.channels.at("R")[i];
  return factors;
}

/// Correlations of the factors at pixels eight pixels apart: along the true line of curvature of
/// the torus, across it, and along it where the stored direction changes its sign nearby.
struct Streaks {
  Correlation along, across, seams, all;
};

Streaks streaksOf(const Scene& scene, int direction) {
  const Image lit = renderCpu(scene, optionsOf(Style::Lit)),
              image = renderCpu(scene, optionsOf(Style::CurvatureLines, direction));
  const std::vector<double> factors = factorsOf(image, lit);
  const std::string layer = "direction" + std::to_string(direction);
  const int width = image.width;
  Streaks result;
  for (int y = 20; y < image.height - 20; ++y)
    for (int x = 20; x < width - 20; ++x) {
      const auto at = [&](double u, double v) {
        return static_cast<std::size_t>(std::lround(v)) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(std::lround(u));
      };
      const std::size_t i = at(x, y);
      if (!(factors[i] > 0)) continue;
      const V3d p = vectorAt(image, "P", i), n = vectorAt(image, "N", i);
      const V3d ring(-p.y, p.x, 0), line = (direction == 2 ? ring : ring.cross(n)).normalized();
      const V2d d =
          (projected(scene.camera, p + line * 1e-4) - projected(scene.camera, p - line * 1e-4))
              .normalized();
      const double step = 8;
      const auto isNear = [&](std::size_t j) {
        return factors[j] > 0 && (vectorAt(image, "P", j) - p).length() < 0.5;
      };
      const std::size_t ahead = at(x + step * d.x, y + step * d.y),
                        aside = at(x - step * d.y, y + step * d.x);
      if (isNear(ahead)) {
        result.along.add(factors[i], factors[ahead]);
        if (vectorAt(image, layer, i).dot(vectorAt(image, layer, ahead)) < 0)
          result.seams.add(factors[i], factors[ahead]);
      }
      if (isNear(aside)) result.across.add(factors[i], factors[aside]);
      result.all.add(factors[i], factors[i]);
    }
  return result;
}

TEST(CurvatureLines, FollowTheTrueDirectionsWithoutSeams) {
  for (const bool isPerspective : {false, true})
    for (const int direction : {1, 2}) {
      const Streaks found = streaksOf(torusScene(isPerspective), direction);
      EXPECT_GT(found.along.n, 8000) << direction;
      EXPECT_LE(1 - found.along.value(), measured(0.188)) << direction;
      EXPECT_LE(std::abs(found.across.value()), measured(0.0522)) << direction;
      // The stored directions have signs, which change somewhere on every closed line.
      EXPECT_GT(found.seams.n, 300) << direction;
      EXPECT_LE(1 - found.seams.value(), measured(0.247)) << direction;
      // The mean brightness stays, and the contrast is that of the noise.
      const double mean = found.all.a / found.all.n,
                   deviation = std::sqrt(found.all.aa / found.all.n - mean * mean);
      EXPECT_NEAR(mean, 1, measured(0.0675)) << direction;
      EXPECT_NEAR(deviation, 0.3, measured(0.0227)) << direction;
    }
}

TEST(CurvatureLines, FadeToTheLitPictureAtUmbilics) {
  for (const auto& band : {levelset::makeSphere(1, V3d(0), 0.05)}) {
    const Scene scene = support::sceneOf(band, 80, 60);
    const Image lit = renderCpu(scene, optionsOf(Style::Lit)),
                streaks = renderCpu(scene, optionsOf(Style::CurvatureLines));
    for (const char* channel : {"R", "G", "B", "A", "Z"})
      EXPECT_EQ(streaks.channels.at(channel), lit.channels.at(channel)) << channel;
  }
  // Between umbilics and directed points the contrast grows.
  const Scene scene = torusScene(false);
  const Image lit = renderCpu(scene, optionsOf(Style::Lit));
  double before = 1;
  for (const double range : {1.0, 30.0, 60.0, 1000.0}) {
    RenderOptions options = optionsOf(Style::CurvatureLines);
    options.style.curvatureRange = range;
    const std::vector<double> factors = factorsOf(renderCpu(scene, options), lit);
    double sum = 0, count = 0;
    for (const double factor : factors) {
      if (!(factor > 0)) continue;
      sum += (factor - 1) * (factor - 1);
      ++count;
    }
    const double contrast = std::sqrt(sum / count);
    EXPECT_LT(contrast, before) << range;
    before = contrast;
  }
  EXPECT_EQ(before, 0);
}

TEST(CurvatureLines, EndAtTheOutlineOfASurfaceInFront) {
  // A walk on the rod in front passes no pixel of the rod behind it, so the picture of the front
  // rod does not depend on the rod behind.
  const auto rod = [](const V3d& at, const V3d& axis) {
    return levelset::makeCylinder(0.5, 6, at, axis, 0.05);
  };
  Scene both = support::sceneOf(rod(V3d(0, 0, 2), V3d(1, 0, 0)), 120, 120);
  both.camera.from = V3d(0, 0, 10);
  both.camera.to = V3d(0);
  both.camera.orthoHeight = 3;
  Scene front = both;
  // The same id, as for two parts of one solid: the depth alone tells them apart.
  both.solids.push_back(
      {.band = rod(V3d(0, 0, -2), V3d(0.3, 1, 0).normalized()), .id = front.solids[0].id});
  for (const int direction : {1, 2}) {
    RenderOptions options = optionsOf(Style::CurvatureLines, direction);
    options.style.curvatureRange = 5;
    const Image a = renderEmbree(front, options), b = renderEmbree(both, options);
    std::size_t same = 0;
    for (std::size_t i = 0; i < a.pixelCount(); ++i) {
      if (!std::isfinite(a.channels.at("Z")[i])) continue;
      ASSERT_EQ(a.channels.at("Z")[i], b.channels.at("Z")[i]);
      ASSERT_NEAR(a.channels.at("R")[i], b.channels.at("R")[i], support::rounding(8));
      ++same;
    }
    EXPECT_GT(same, 3000u);
  }
}

TEST(CurvatureLines, HaveTheSameBitsOnBothProcessorsAndForAnyNumberOfThreads) {
  for (const double width : {0.0, 2.0, 5.0}) {
    const Scene scene = torusScene(true);
    RenderOptions options = optionsOf(Style::CurvatureLines, 2);
    options.style.lineWidth = width;
    const Image one = support::onThreads(1, [&] { return renderCpu(scene, options); });
    EXPECT_TRUE(compareImages(one, support::onThreads(4, [&] { return renderCpu(scene, options); }),
                              {.exact = true})
                    .agrees());
    if (width != 2) continue;
    EXPECT_TRUE(compareImages(one, renderGpu(scene, options), {.exact = true}).agrees());
  }
}

TEST(CurvatureLines, HaveTheGivenWidth) {
  // Across the streaks the correlation is that of noise that a Gaussian smooths twice.
  const Scene scene = torusScene(false);
  const Image lit = renderCpu(scene, optionsOf(Style::Lit));
  for (const double width : {2.0, 4.0}) {
    RenderOptions options = optionsOf(Style::CurvatureLines);
    options.style.lineWidth = width;
    const std::vector<double> factors = factorsOf(renderCpu(scene, options), lit);
    Correlation found;
    for (std::size_t i = 4; i + 4 < factors.size(); ++i) {
      const auto x = static_cast<int>(i % 240);
      // At the right, in the middle of the picture's height, the circles of the tube are
      // horizontal.
      const auto y = static_cast<int>(i / 240);
      if (x < 160 || x > 200 || y < 110 || y > 135) continue;
      const std::size_t below = i + 240 * static_cast<std::size_t>(width / 2);
      if (factors[i] > 0 && factors[below] > 0) found.add(factors[i], factors[below]);
    }
    // At a distance of one standard deviation of the Gaussian: exp(−1/4).
    EXPECT_NEAR(found.value(), std::exp(-0.25), measured(0.0525)) << width;
  }
}

TEST(CurvatureLines, LeavePicturesWithoutTheirLayersAlone) {
  const Scene scene = torusScene(false);
  Image image = renderCpu(scene, optionsOf(Style::Lit));
  image.channels.erase("direction2.Y");
  const std::vector<float> before = image.channels.at("G");
  drawCurvatureLines(image, scene.camera, {.direction = 2}, 5);
  EXPECT_EQ(image.channels.at("G"), before);
  drawCurvatureLines(image, scene.camera, {.direction = 1}, 5);
  EXPECT_NE(image.channels.at("G"), before);
}

TEST(CurvatureLines, RefuseTransparentPartsAndWideStreaks) {
  Scene scene = torusScene(false);
  RenderOptions options = optionsOf(Style::CurvatureLines);
  options.style.lineWidth = 17;
  for (const auto& draw : {renderCpu, renderGpu, renderEmbree}) {
    EXPECT_THROW((void)draw(scene, options), levelset::UsageError);
    Scene transparent = scene;
    transparent.solids[0].opacity = 0.5;
    EXPECT_THROW((void)draw(transparent, optionsOf(Style::CurvatureLines)), levelset::UsageError);
  }
}

}  // namespace curvature_lines_test
