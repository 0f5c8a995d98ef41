#include "apps/viewer/interaction/orbit_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace orbit_camera_test {

using Imath::V2d;
using Imath::V3d;
using render::Camera;
using viewer::OrbitCamera;

constexpr int kWidth = 640, kHeight = 480;

Camera startCamera() {
  Camera camera;
  camera.from = {3, 2, 5};
  camera.to = {0.5, -0.25, 0.1};
  return camera;
}

void expectNear(const V3d& a, const V3d& b, double tolerance) {
  EXPECT_LE((a - b).length(), tolerance)
      << a.x << ',' << a.y << ',' << a.z << " and " << b.x << ',' << b.y << ',' << b.z;
}

/// Pixel position of a point in the picture.
V2d pixelOf(const Camera& camera, const V3d& place) {
  const V3d ndc = place * camera.worldToNdc();
  return {ndc.x * camera.width, ndc.y * camera.height};
}

TEST(OrbitCamera, KeepsACameraUntilItIsMoved) {
  const Camera given = startCamera();
  const Camera seen = OrbitCamera(given).camera(kWidth, kHeight);
  EXPECT_EQ(seen.from, given.from);
  EXPECT_EQ(seen.to, given.to);
  EXPECT_EQ(seen.up, given.up);
  EXPECT_EQ(seen.width, kWidth);
}

TEST(OrbitCamera, RotatesAroundItsTargetAtConstantDistance) {
  OrbitCamera orbit(startCamera());
  const double distance = orbit.targetDepth();
  for (int i = 0; i < 50; ++i) orbit.orbit(0.3, 0.1 * std::sin(i));
  const Camera seen = orbit.camera(kWidth, kHeight);
  expectNear(seen.to, startCamera().to, 1e-12);
  EXPECT_NEAR(orbit.targetDepth(), distance, 1e-12 * distance);
}

TEST(OrbitCamera, ReturnsAfterAFullTurn) {
  OrbitCamera orbit(startCamera());
  for (int i = 0; i < 8; ++i) orbit.orbit(std::numbers::pi / 4, 0);
  expectNear(orbit.camera(1, 1).from, startCamera().from, 1e-12);
}

TEST(OrbitCamera, MovesTheEyeToTheRightAndUp) {
  Camera camera;  // on the z axis
  OrbitCamera orbit(camera);
  orbit.orbit(std::numbers::pi / 2, 0);
  expectNear(orbit.camera(1, 1).from, {5, 0, 0}, 1e-12);
  orbit = OrbitCamera(camera);
  orbit.orbit(0, std::numbers::pi / 6);
  expectNear(orbit.camera(1, 1).from, {0, 2.5, 5 * std::cos(std::numbers::pi / 6)}, 1e-12);
}

TEST(OrbitCamera, StopsAtThePolesAndRotatesThere) {
  OrbitCamera orbit((Camera()));
  orbit.orbit(0, 10);
  expectNear(orbit.camera(1, 1).from, {0, 5, 0}, 1e-12);
  expectNear(orbit.camera(1, 1).up, {0, 0, -1}, 1e-12);
  orbit.orbit(std::numbers::pi / 2, 0);
  expectNear(orbit.camera(1, 1).up, {-1, 0, 0}, 1e-9);
  orbit.orbit(0, -std::numbers::pi / 2);  // down again, in the new direction
  expectNear(orbit.camera(1, 1).from, {5, 0, 0}, 1e-8);
}

TEST(OrbitCamera, PansSoThatThePickedPointStaysUnderThePointer) {
  for (const bool isOrtho : {false, true}) {
    OrbitCamera orbit(startCamera());
    if (isOrtho) orbit.toggleOrtho();
    const Camera before = orbit.camera(kWidth, kHeight);
    const V2d from(100, 350), to(420, 77);
    const double depth = 4.25;
    const Camera::Ray ray = before.ray(from.x, from.y);
    const V3d place = ray.origin + ray.direction * (depth / ray.direction.dot(before.axis()));
    orbit.pan(from, to, depth, kWidth, kHeight);
    const V2d seen = pixelOf(orbit.camera(kWidth, kHeight), place);
    EXPECT_NEAR(seen.x, to.x, 1e-8);
    EXPECT_NEAR(seen.y, to.y, 1e-8);
    expectNear(orbit.camera(1, 1).axis(), before.axis(), 1e-12);
  }
}

TEST(OrbitCamera, ZoomsTowardsThePointer) {
  for (const bool isOrtho : {false, true}) {
    OrbitCamera orbit(startCamera());
    if (isOrtho) orbit.toggleOrtho();
    const Camera before = orbit.camera(kWidth, kHeight);
    const V2d pointer(500, 60);
    const double depth = 5;
    const Camera::Ray ray = before.ray(pointer.x, pointer.y);
    const V3d place = ray.origin + ray.direction * (depth / ray.direction.dot(before.axis()));
    orbit.zoom(0.5, pointer, depth, kWidth, kHeight);
    const Camera after = orbit.camera(kWidth, kHeight);
    const V2d seen = pixelOf(after, place);
    EXPECT_NEAR(seen.x, pointer.x, 1e-8);
    EXPECT_NEAR(seen.y, pointer.y, 1e-8);
    if (isOrtho)
      EXPECT_NEAR(*after.orthoHeight, 0.5 * *before.orthoHeight, 1e-12);
    else
      EXPECT_NEAR((after.from - place).length(), 0.5 * (before.from - place).length(), 1e-12);
  }
}

TEST(OrbitCamera, FramesABoxInPicturesOfAnyShape) {
  const Imath::Box3d box(V3d(-3, 0, 1), V3d(4, 1, 2));
  for (const bool isOrtho : {false, true})
    for (const auto& [width, height] : {std::pair(640, 480), {300, 900}, {1, 1}}) {
      OrbitCamera orbit(startCamera());
      if (isOrtho) orbit.toggleOrtho();
      orbit.frame(box, width, height);
      const Camera seen = orbit.camera(width, height);
      for (int corner = 0; corner < 8; ++corner) {
        const V2d at = pixelOf(
            seen, V3d(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                      corner & 4 ? box.max.z : box.min.z));
        EXPECT_GE(at.x, 0);
        EXPECT_LE(at.x, width);
        EXPECT_GE(at.y, 0);
        EXPECT_LE(at.y, height);
      }
    }
}

TEST(OrbitCamera, LooksAlongAxesAndContinuesToRotate) {
  OrbitCamera orbit(startCamera());
  const double distance = orbit.targetDepth();
  for (const V3d& axis : {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, -1), V3d(0, -1, 0)}) {
    orbit.lookAgainst(axis);
    expectNear(orbit.camera(1, 1).from, startCamera().to + axis * distance, 1e-12);
    EXPECT_NO_THROW(render::validate(orbit.camera(10, 10)));
    orbit.orbit(0.1, 0.1);
    EXPECT_NO_THROW(render::validate(orbit.camera(10, 10)));
  }
}

TEST(OrbitCamera, KeepsTheSizeOfTheTargetBetweenPerspectives) {
  OrbitCamera orbit(startCamera());
  const Camera before = orbit.camera(kWidth, kHeight);
  const V3d beside = before.to + before.pixelSteps().right * (100 * orbit.targetDepth());
  orbit.toggleOrtho();
  EXPECT_TRUE(orbit.isOrtho());
  EXPECT_NEAR(pixelOf(orbit.camera(kWidth, kHeight), beside).x, kWidth / 2 + 100, 1e-8);
  orbit.toggleOrtho();
  expectNear(orbit.camera(1, 1).from, before.from, 1e-12);
}

TEST(OrbitCamera, RefusesMovesThatOverflow) {
  OrbitCamera orbit(startCamera());
  const double infinite = std::numeric_limits<double>::infinity();
  const auto expectStill = [&] {
    const Camera seen = orbit.camera(kWidth, kHeight);
    EXPECT_EQ(seen.from, startCamera().from);
    EXPECT_EQ(seen.to, startCamera().to);
  };
  orbit.zoom(0, {1, 1}, 5, kWidth, kHeight);
  orbit.zoom(-1, {1, 1}, 5, kWidth, kHeight);
  orbit.zoom(infinite, {1, 1}, 5, kWidth, kHeight);
  orbit.pan({0, 0}, {1, 1}, infinite, kWidth, kHeight);
  orbit.centreOn(V3d(infinite));
  orbit.orbit(infinite, 0);
  orbit.frame(Imath::Box3d(), kWidth, kHeight);
  expectStill();
  EXPECT_NO_THROW(render::validate(orbit.camera(0, -3)));
}

}  // namespace orbit_camera_test
