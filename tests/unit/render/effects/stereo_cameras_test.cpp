// Traced stereo pictures: cameras with asymmetric frusta, and what the renderers draw from them.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/camera.h"
#include "render/cpu/cpu_renderer.h"
#include "render/effects/effects.h"
#include "render/effects/picture_view.h"
#include "render/effects/stereo.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/effect_pictures.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/render_scenes.h"

namespace stereo_cameras_test {

using Imath::V3d;
using namespace render;

Camera middleCamera() {
  Camera camera;
  camera.from = V3d(9, 4, 30);
  camera.to = V3d(1, -2, 3);
  camera.width = 120;
  camera.height = 80;
  return camera;
}

/// Horizontal and vertical position of a point in the picture, pixels.
Imath::V2d pixelOf(const Camera& camera, const V3d& point) {
  const V3d ndc = point * camera.worldToNdc();
  return {ndc.x * camera.width, ndc.y * camera.height};
}

TEST(StereoCameras, HaveTheParallaxInClosedForm) {
  const Camera middle = middleCamera();
  const double eyes = 0.8, screen = 17;
  const auto [left, right] = stereoCameras(middle, eyes, screen);
  const double width = middle.pixelSteps().right.length();
  for (const double depth : {4.0, screen, 100.0})
    for (const Imath::V2d& at : {Imath::V2d(60, 40), Imath::V2d(10, 70), Imath::V2d(111, 3)}) {
      const Camera::Ray ray = middle.ray(at.x, at.y);
      const V3d point = ray.origin + ray.direction * (depth / ray.direction.dot(middle.axis()));
      const Imath::V2d inLeft = pixelOf(left, point), inRight = pixelOf(right, point);
      const double parallax = eyes * (1 / depth - 1 / screen) / width;
      EXPECT_NEAR(inLeft.x - inRight.x, parallax, 1e-10) << depth;
      EXPECT_NEAR(0.5 * (inLeft.x + inRight.x), at.x, 1e-10) << depth;
      EXPECT_NEAR(inLeft.y, at.y, 1e-10) << depth;
      EXPECT_NEAR(inRight.y, at.y, 1e-10) << depth;
      // The rays of the eyes lead to the point.
      for (const Camera& eye : {left, right}) {
        const Imath::V2d place = pixelOf(eye, point);
        const Camera::Ray seen = eye.ray(place.x, place.y);
        EXPECT_LT((point - seen.origin).cross(seen.direction).length(), 1e-10) << depth;
      }
    }
  // The axes are parallel.
  EXPECT_LT((left.axis() - right.axis()).length(), support::doubleRounding(8));
  EXPECT_NEAR((right.from - left.from).length(), eyes, 1e-12);
}

TEST(StereoCameras, RefuseOrthographicViewsAndLengthsThatAreNotPositive) {
  Camera camera = middleCamera();
  for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW((void)stereoCameras(camera, wrong, 10), levelset::UsageError);
    EXPECT_THROW((void)stereoCameras(camera, 1, wrong), levelset::UsageError);
  }
  camera.orthoHeight = 10;
  EXPECT_THROW((void)stereoCameras(camera, 1, 10), levelset::UsageError);
  camera.axisShift = 3;
  EXPECT_THROW(validate(camera), levelset::UsageError);
}

/// Parts of all kinds, seen by an eye whose frustum is far from symmetric.
Scene shiftedScene() {
  Scene scene = support::sceneOf(support::rings(), 120, 90);
  scene.quadrics.push_back(makeQuadricPart({{V3d(-8, 24, 12), 9}}, {}));
  BezierVolume volume = bezier_scenes::sphere(2);
  bezier_scenes::deform(volume.patches[0], [](const V3d& p) { return p * 8 + V3d(-30, -16, 20); });
  scene.beziers.push_back({.caster = BezierCaster(std::move(volume))});
  MeshPart part;
  part.mesh = std::make_shared<const levelset::TriMesh>(support::sphereMesh(7, V3d(25, 20, 10)));
  scene.meshes.push_back(part);
  scene.camera.axisShift = 31.25;
  return scene;
}

TEST(StereoCameras, SeeEachPointWhereItIs) {
  const Scene scene = shiftedScene();
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  for (const Image& image : {renderCpu(scene, options), renderEmbree(scene, options)}) {
    double worst = 0;
    std::size_t seen = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const auto i = static_cast<std::size_t>(y * image.width + x);
        if (!std::isfinite(image.channels.at("Z")[i])) continue;
        ++seen;
        V3d point;
        for (int a = 0; a < 3; ++a)
          point[a] = static_cast<double>(image.channels.at(std::string("P.") + "XYZ"[a])[i]);
        const Imath::V2d place = pixelOf(scene.camera, point) - Imath::V2d(x + 0.5, y + 0.5);
        worst = std::max({worst, std::abs(place.x), std::abs(place.y)});
      }
    EXPECT_GT(seen, 2000u);
    EXPECT_LT(worst, 1e-4);  // positions in single precision
  }
}

TEST(StereoCameras, DrawThePictureOfAWiderSymmetricView) {
  Scene scene = shiftedScene();
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  const int shift = 30;
  scene.camera.axisShift = shift;
  const Image cut = renderCpu(scene, options);
  scene.camera.axisShift = 0;
  scene.camera.width += 2 * shift;
  const Image wide = renderCpu(scene, options);
  std::size_t different = 0;
  double worst = 0;
  for (int y = 0; y < cut.height; ++y)
    for (int x = 0; x < cut.width; ++x) {
      const float a = cut.channels.at("Z")[static_cast<std::size_t>(y * cut.width + x)],
                  b = wide.channels.at("Z")[static_cast<std::size_t>(y * wide.width + x)];
      if (std::isfinite(a) != std::isfinite(b))
        ++different;
      else if (std::isfinite(a))
        worst = std::max(worst, std::abs(static_cast<double>(a) - static_cast<double>(b)));
    }
  EXPECT_EQ(different, 0u);
  EXPECT_LT(worst, 1e-4);
}

TEST(StereoCameras, AgreeBetweenKernelJudgeAndGpu) {
  const Scene scene = shiftedScene();
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  const Image kernel = renderCpu(scene, options);
  const ImageComparison found = compareImages(kernel, renderEmbree(scene, options));
  EXPECT_TRUE(found.agrees()) << found.reason();
  EXPECT_EQ(compareImages(renderGpu(scene, options), kernel, {.exact = true}).differentBits, 0u);
}

TEST(StereoCameras, KeepEffectsOfTheDepthInPlace) {
  // Outlines of an inclined plane, and light in the picture, use the position of the axis.
  Camera camera = middleCamera();
  camera.axisShift = 40;
  const Image image = support::pictureOf(
      camera,
      [](const Camera::Ray& ray) {
        return support::onPlane(ray, V3d(0), V3d(1, 0.4, 1).normalized());
      },
      20);
  const PictureView view(image);
  EXPECT_NEAR(view.middleX(), camera.middleX(), 1e-4);
  for (const float line :
       outlineLayer(view, {.width = 2, .spacing = 1, .step = 0.05}, CpuScreenRunner()))
    EXPECT_EQ(line, 0.0f);
  for (const float open :
       occlusionLayer(view, {.radius = 5, .occluderDepth = 1}, CpuScreenRunner()))
    EXPECT_EQ(open, 1.0f);
}

/// Root mean square of the differences of two pictures over the pixels, of all channels of colour.
double rmsOf(const Image& a, const Image& b) {
  double sum = 0;
  for (const char* name : {"R", "G", "B"})
    for (std::size_t i = 0; i < a.pixelCount(); ++i) {
      const double d =
          static_cast<double>(a.channels.at(name)[i]) - static_cast<double>(b.channels.at(name)[i]);
      sum += d * d;
    }
  return std::sqrt(sum / (3.0 * static_cast<double>(a.pixelCount())));
}

TEST(StereoCameras, ShowTheErrorOfThePairFromDepth) {
  const auto ballOnPlate = levelset::unite(levelset::makeSphere(10, V3d(0, 10, 0), 0.5),
                                           levelset::makeBox(V3d(60, 4, 60), V3d(0, -2, 0), 0.5));
  const struct {
    const char* name;
    Scene scene;
    double times;        // the default distance of the eyes
    double error, none;  // docs/effects.md has these figures
  } cases[] = {{"rings", support::sceneOf(support::rings()), 1, 0.0136, 0.00706},
               {"rings", support::sceneOf(support::rings()), 6, 0.0147, 0.0312},
               {"ball on a plate", support::sceneOf(ballOnPlate), 1, 0.00833, 0.013},
               {"ball on a plate", support::sceneOf(ballOnPlate), 6, 0.0144, 0.0526}};
  const RenderOptions options{.samples = 16, .ambientSamples = 4, .shadowSamples = 1};
  for (const auto& [name, scene, times, error, none] : cases) {
    const Image middle = renderCpu(scene, options);
    const Imath::V2d depths = PictureView(middle).depthRange();
    const double eyes = times * defaultEyeDistance(depths), screen = defaultScreenDepth(depths);
    Scene seen = scene;
    seen.camera = stereoCameras(scene.camera, eyes, screen)[1];
    const Image drawn = renderCpu(seen, options);
    EXPECT_LT(rmsOf(drawn, seenFromBeside(middle, 0.5 * eyes, screen)), support::measured(error))
        << name << " " << times;
    EXPECT_NEAR(rmsOf(drawn, middle), none, 0.1 * none) << name << " " << times;
  }
}

}  // namespace stereo_cameras_test
