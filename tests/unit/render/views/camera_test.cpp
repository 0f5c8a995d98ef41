#include "render/camera.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "levelset/error.h"
#include "tests/support/measured.h"

namespace camera_test {

using namespace render;
using Imath::V3d;

Camera tiltedCamera() {
  Camera camera;
  camera.from = {3, 2, 5};
  camera.to = {0.5, -0.25, 0};
  camera.width = 400;
  camera.height = 300;
  return camera;
}

/// Expects that the NDC of points along a ray are the image position of the ray.
void expectNdcMatchesRays(const Camera& camera) {
  for (const double x : {0.0, 17.25, 200.0, 400.0}) {
    for (const double y : {0.0, 150.0, 299.5}) {
      const Camera::Ray ray = camera.ray(x, y);
      EXPECT_NEAR(ray.direction.length(), 1, support::doubleRounding(1));
      V3d ndc;
      camera.worldToNdc().multVecMatrix(ray.origin + ray.direction * 7, ndc);
      EXPECT_NEAR(ndc.x, x / camera.width, support::doubleRounding(2));
      EXPECT_NEAR(ndc.y, y / camera.height, support::doubleRounding(1.5));
    }
  }
}

TEST(Camera, RaysAgreeWithNdc) {
  Camera camera = tiltedCamera();
  expectNdcMatchesRays(camera);
  camera.orthoHeight = 2.5;
  expectNdcMatchesRays(camera);
}

TEST(Camera, HasUpAboveAndRightToTheRight) {
  const Camera camera;
  EXPECT_GT(camera.ray(512, 0).direction.y, 0.1);
  EXPECT_GT(camera.ray(1024, 512).direction.x, 0.1);
  V3d p;
  camera.worldToCamera().multVecMatrix(V3d(1, 2, 0), p);
  EXPECT_NEAR((p - V3d(1, 2, 5)).length(), 0,
              support::doubleRounding(4));  // x points right, y up, z along the view
}

TEST(Camera, FieldOfViewIsVertical) {
  Camera camera;
  camera.width = 300;
  camera.height = 100;
  const V3d top = camera.ray(150, 0).direction;
  EXPECT_NEAR(std::acos(top.dot(camera.axis())), camera.verticalFov / 2,
              support::doubleRounding(4));
}

TEST(Camera, SeesBetweenItsPlanes) {
  Camera camera = tiltedCamera();
  EXPECT_EQ(camera.ray(3, 5).near, 0);
  EXPECT_EQ(camera.ray(3, 5).far, Camera::kNoDepth);
  camera.near = 2;
  camera.far = 7;
  for (const bool isOrtho : {false, true}) {
    if (isOrtho) camera.orthoHeight = 3;
    const Camera::Ray ray = camera.ray(3, 5);
    const auto depthAt = [&](double t) {
      return (ray.origin + ray.direction * t - camera.from).dot(camera.axis());
    };
    EXPECT_NEAR(depthAt(ray.near), 2, support::doubleRounding(3));
    EXPECT_NEAR(depthAt(ray.far), 7, support::doubleRounding(12.5));
  }
}

TEST(Camera, FramesABoxAtAnyAspect) {
  const Imath::Box3d boxes[] = {
      {V3d(-1), V3d(1)}, {V3d(10, 0, -3), V3d(11, 40, -2)}, {V3d(-500, 2, 7), V3d(500, 2.001, 9)}};
  for (const auto& box : boxes) {
    for (const auto& [width, height] : {std::pair{100, 100}, {1600, 200}, {200, 1600}}) {
      const Camera camera = framingCamera(box, width, height);
      double reach = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const V3d p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                    corner & 4 ? box.max.z : box.min.z);
        EXPECT_GT((p - camera.from).dot(camera.axis()), 0);
        V3d ndc;
        camera.worldToNdc().multVecMatrix(p, ndc);
        reach = std::max({reach, std::abs(2 * ndc.x - 1), std::abs(2 * ndc.y - 1)});
      }
      EXPECT_NEAR(reach, 0.94, support::doubleRounding(50));
    }
  }
}

TEST(Camera, RefusesInvalidCameras) {
  const auto refused = [](auto&& change) {
    Camera camera = tiltedCamera();
    change(camera);
    EXPECT_THROW(validate(camera), levelset::UsageError);
  };
  EXPECT_NO_THROW(validate(tiltedCamera()));
  refused([](Camera& c) { c.width = 0; });
  refused([](Camera& c) { c.height = -4; });
  refused([](Camera& c) { c.to = c.from; });
  refused([](Camera& c) { c.up = (c.to - c.from) * -3.0; });
  refused([](Camera& c) { c.up = V3d(0); });
  refused([](Camera& c) { c.from.x = std::numeric_limits<double>::quiet_NaN(); });
  refused([](Camera& c) { c.to.y = std::numeric_limits<double>::infinity(); });
  refused([](Camera& c) { c.verticalFov = 0; });
  refused([](Camera& c) { c.verticalFov = std::numbers::pi; });
  refused([](Camera& c) { c.orthoHeight = -1; });
  refused([](Camera& c) { c.orthoHeight = std::numeric_limits<double>::quiet_NaN(); });
  refused([](Camera& c) { c.near = -1; });
  refused([](Camera& c) { c.near = std::numeric_limits<double>::infinity(); });
  refused([](Camera& c) { c.near = std::numeric_limits<double>::quiet_NaN(); });
  refused([](Camera& c) { c.far = 0; });
  refused([](Camera& c) { c.far = std::numeric_limits<double>::infinity(); });
  refused([](Camera& c) { c.near = 2, c.far = 2; });
  Camera huge = tiltedCamera();
  huge.width = huge.height = 1000000;
  EXPECT_THROW(validate(huge), levelset::ResourceLimit);
  EXPECT_THROW((void)framingCamera({}, 64, 64), levelset::UsageError);
  EXPECT_THROW((void)framingCamera({V3d(0), V3d(1)}, 0, 64), levelset::UsageError);
}

}  // namespace camera_test
