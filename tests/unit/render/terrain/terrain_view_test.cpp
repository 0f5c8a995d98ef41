// Frustum tests of boxes, and the vertical error that a pixel error allows in them.

#include "render/terrain/terrain_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/drawn_terrain.h"

namespace terrain_view_test {

using namespace render;
using Imath::Box3d;
using Imath::V3d;
using support::PicturePoint;

const Box3d kWorld({-100, -100, 0}, {100, 100, 40});

Box3d randomBox(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> unit(0, 1);
  const V3d low = kWorld.min + V3d(unit(random), unit(random), unit(random)) * kWorld.size();
  return {low, low + V3d(unit(random), unit(random), unit(random)) * size};
}

/// Points of the box that are in the picture move by at most the pixel error, and in some boxes by
/// nearly as much.
TEST(TerrainView, KeepsThePixelError) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  double most = 0;
  for (int n = 0; n < 2000; ++n) {
    const Camera camera = support::randomCamera(kWorld, random);
    const Imath::M44d toNdc = camera.worldToNdc();
    const double pixelError = 0.25 + 8 * unit(random);
    const TerrainView view(camera, pixelError);
    const Box3d box = randomBox(random, n % 2 == 0 ? 3 : 30);
    const double allowed = view.allowedError(box);
    for (int k = 0; k < 40; ++k) {
      V3d p = box.min + V3d(unit(random), unit(random), unit(random)) * box.size();
      V3d q = p;
      q.z += k % 2 == 0 ? allowed : -allowed;
      q.z = std::clamp(q.z, box.min.z, box.max.z);
      const PicturePoint a = support::inPicture(camera, toNdc, p);
      if (!a.isInside) continue;
      const PicturePoint b = support::inPicture(camera, toNdc, q);
      const double moved = std::hypot(a.x - b.x, a.y - b.y);
      EXPECT_LE(moved, pixelError * (1 + 1e-9));
      most = std::max(most, moved / pixelError);
    }
  }
  EXPECT_GT(most, 0.9);
}

/// A box with a point in the picture is kept, also if planes are left out that the box around it
/// does not cross. Boxes far outside are dropped.
TEST(TerrainView, KeepsWhatIsVisible) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  int kept = 0, dropped = 0;
  for (int n = 0; n < 2000; ++n) {
    Camera camera = support::randomCamera(kWorld, random);
    if (n % 3 == 0) camera.near = 20 * unit(random);
    if (n % 5 == 0) camera.far = camera.near + 50;
    const Imath::M44d toNdc = camera.worldToNdc();
    const TerrainView view(camera, 1);
    const Box3d box = randomBox(random, 30);
    Box3d around = box;
    around.extendBy(randomBox(random, 30));
    const auto outer = view.crossed(around, TerrainView::kAllPlanes);
    const auto direct = view.crossed(box, TerrainView::kAllPlanes);
    EXPECT_EQ(direct, outer ? view.crossed(box, *outer) : std::nullopt);
    bool isSeen = false;
    for (int k = 0; k < 40; ++k) {
      const V3d p = box.min + V3d(unit(random), unit(random), unit(random)) * box.size();
      isSeen = isSeen || support::inPicture(camera, toNdc, p).isInside;
    }
    EXPECT_TRUE(direct || !isSeen);
    kept += direct.has_value();
    dropped += !direct;
  }
  EXPECT_GT(kept, 200);
  EXPECT_GT(dropped, 200);
}

TEST(TerrainView, SeesNoHeightsFromAbove) {
  Camera camera;
  camera.from = {0, 0, 100};
  camera.to = {0, 0, 0};
  camera.orthoHeight = 50;
  const TerrainView parallel(camera, 1);
  EXPECT_TRUE(std::isinf(parallel.allowedError(kWorld)));
  EXPECT_FALSE(parallel.crossed(Box3d(), TerrainView::kAllPlanes));
  // Vertically below the eye, heights are seen from above.
  camera.orthoHeight.reset();
  const TerrainView view(camera, 1);
  EXPECT_GT(view.allowedError({{-1, -1, 0}, {1, 1, 1}}),
            10 * view.allowedError({{29, 29, 0}, {31, 31, 1}}));
}

}  // namespace terrain_view_test
