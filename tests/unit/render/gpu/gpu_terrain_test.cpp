// Drawing of terrains with OpenGL: no background shines through, depths are those of rays, far
// from the origin, too, and memory of the device.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "levelset/error.h"
#include "render/gpu/terrain/patch_slots.h"
#include "render/gpu/terrain/terrain_painter.h"
#include "render/meshes/mesh_rays.h"
#include "render/terrain/terrain_detail.h"
#include "tests/support/drawn_terrain.h"
#include "tests/support/measured.h"
#include "tests/support/terrain_stores.h"

namespace gpu_terrain_test {

using namespace render;
using Imath::V3d;
using levelset::HeightField;

struct Land {
  HeightField field;
  TerrainDetail detail;
  std::unique_ptr<TerrainPainter> painter;

  explicit Land(const V3d& middle, int columns = 129, int rows = 129, int cells = 8,
                bool isPierced = false)
      : field(heightsAt(middle, columns, rows, isPierced)),
        detail(support::storeOf(field, cells), {.maxBytes = std::size_t{1} << 26}),
        painter(makeTerrainPainter(detail.layout(), std::size_t{1} << 24)) {}

  static HeightField heightsAt(const V3d& middle, int columns, int rows, bool isPierced) {
    HeightField field = support::cutTerrain(support::fractalTerrain(7, 0.5, 11), columns, rows);
    field.origin = {middle.x - columns / 2.0, middle.y - rows / 2.0};
    for (float& height : field.heights) height += static_cast<float>(middle.z);
    if (isPierced)
      for (int row = 40; row < 60; ++row)
        for (int column = 30; column < 45; ++column)
          field.heights[field.index(column, row)] = levelset::kMissingHeight;
    return field;
  }
};

bool isGround(const TerrainPicture& picture, int x, int y) {
  return picture.colours[4 * static_cast<std::size_t>(y * picture.width + x) + 3] != 0;
}

/// Returns true if all pixels within a distance are ground, in the picture or beyond its edges.
bool isDeepInGround(const TerrainPicture& picture, int x, int y, int reach) {
  for (int j = std::max(y - reach, 0); j <= std::min(y + reach, picture.height - 1); ++j)
    for (int i = std::max(x - reach, 0); i <= std::min(x + reach, picture.width - 1); ++i)
      if (!isGround(picture, i, j)) return false;
  return true;
}

/// Where the picture of the full data has ground, further from the sky than the pixel error, every
/// picture has.
TEST(GpuTerrain, LetsNoBackgroundShineThrough) {
  std::mt19937 random(7);
  Land whole({0, 0, 0}), cut({0, 0, 0}, 120, 87), pierced({0, 0, 0}, 129, 129, 8, true);
  std::size_t pixels = 0;
  for (Land* land : {&whole, &cut, &pierced})
    for (int n = 0; n < 12; ++n) {
      const Camera camera = support::randomCamera(land->field.bounds(), random);
      const TerrainPicture full = land->painter->draw(land->detail.select(camera, 1e-9), camera);
      const int allowed = 1 + n % 3;
      const TerrainPicture drawn =
          land->painter->draw(land->detail.select(camera, allowed), camera);
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          if (isGround(drawn, x, y) || !isDeepInGround(full, x, y, allowed + 1)) continue;
          ADD_FAILURE() << "background at " << x << ", " << y << " of view " << n;
          return;
        }
      for (std::size_t k = 3; k < full.colours.size(); k += 4) pixels += full.colours[k] != 0;
    }
  EXPECT_GT(pixels, 300000u);
}

levelset::TriMesh shifted(levelset::TriMesh mesh, const V3d& by) {
  for (V3d& p : mesh.positions) p += by;
  return mesh;
}

/// Depths of pixels are those of rays with the same triangles in double precision, at the origin
/// and 10^6 and 3 × 10^7 units away from it. Pixels whose neighbours have other depths are left
/// out: there, the ray may pass beside an edge.
TEST(GpuTerrain, HasTheDepthsOfRays) {
  for (const V3d& middle : {V3d(0), V3d(1e6, -1e6, 0), V3d(-3e7, 2e7, 500)}) {
    Land land(middle);
    Camera camera;
    camera.from = middle + V3d(-50, -40, 30);
    camera.to = middle;
    camera.up = {0, 0, 1};
    camera.width = 320;
    camera.height = 200;
    for (const bool isParallel : {false, true}) {
      if (isParallel) camera.orthoHeight = 40;
      const TerrainSelection selection = land.detail.select(camera, 1);
      const TerrainPicture picture = land.painter->draw(selection, camera);
      Scene scene;
      scene.meshes.push_back(
          {.mesh = std::make_shared<const levelset::TriMesh>(
               shifted(terrainTriangles(land.detail.layout(), selection), -camera.from))});
      const MeshRays rays(scene);
      const CameraRays views(camera);
      double worst = 0;
      std::size_t compared = 0, unlike = 0;
      for (int y = 1; y + 1 < camera.height; ++y)
        for (int x = 1; x + 1 < camera.width; ++x) {
          if (!isDeepInGround(picture, x, y, 1)) continue;
          const Camera::Ray ray = views.at(x + 0.5, y + 0.5);
          const Hit hit = rays.intersect(ray.origin - camera.from, ray.direction, 0, 1e9);
          const std::size_t pixel = static_cast<std::size_t>(y * camera.width + x);
          const double depth = static_cast<double>(picture.surfaces[pixel].w),
                       across =
                           std::abs(static_cast<double>(picture.surfaces[pixel + 1].w) - depth);
          if (across > 0.02 * depth) continue;
          ++compared;
          const double error = std::abs(hit.distance * ray.direction.dot(views.axis()) - depth);
          if (hit.distance > 1e8 || error > 0.02 * depth)
            ++unlike;
          else
            worst = std::max(worst, error / depth);
        }
      EXPECT_GT(compared, 50000u);
      EXPECT_LE(unlike, 2u);
      // Corners are rounded to parts of a pixel, which displaces grazing grounds in perspective.
      EXPECT_LT(worst, support::measured(isParallel ? 9.7e-5 : 2.7e-3));
    }
  }
}

/// Moving view and terrain together by whole samples changes no pixel.
TEST(GpuTerrain, DrawsTheSameFarFromTheOrigin) {
  std::vector<std::uint8_t> first;
  for (const V3d& middle : {V3d(0), V3d(1 << 20, -(1 << 20), 0)}) {
    Land land(middle);
    Camera camera;
    camera.from = middle + V3d(-50, -40, 30);
    camera.to = middle;
    camera.up = {0, 0, 1};
    camera.width = 320;
    camera.height = 200;
    const TerrainPicture picture = land.painter->draw(land.detail.select(camera, 1), camera);
    if (first.empty()) first = picture.colours;
    EXPECT_EQ(picture.colours, first);
  }
}

/// A slope is as bright as its normal says, and missing samples show the background.
TEST(GpuTerrain, ShadesByNormals) {
  HeightField plane{.columns = 65, .rows = 65};
  for (int row = 0; row < 65; ++row)
    for (int column = 0; column < 65; ++column)
      plane.heights.push_back(column > 40 ? levelset::kMissingHeight
                                          : static_cast<float>(0.5 * column - 0.25 * row));
  TerrainDetail detail(support::storeOf(plane, 8), {.maxBytes = std::size_t{1} << 22});
  const auto painter = makeTerrainPainter(detail.layout());
  Camera camera;
  camera.from = {32, 32, 100};
  camera.to = {32, 32, 0};
  camera.width = camera.height = 64;
  camera.orthoHeight = 64;
  const TerrainPaint paint{.colour = {0.5f, 0.4f, 0.3f}, .towardsLight = {1, 2, 3}};
  const TerrainPicture picture = painter->draw(detail.select(camera, 1), camera, paint);
  const V3d normal = V3d(-0.5, 0.25, 1).normalized(), light = V3d(1, 2, 3).normalized();
  const double shade = 0.75 * normal.dot(light) + 0.25 * (0.5 + 0.5 * normal.z);
  const double power = 1.055 * std::pow(0.5 * shade, 1 / 2.4) - 0.055;
  EXPECT_NEAR(picture.colours[4 * (20 * 64 + 20)], 255 * power, 1);
  const Imath::V4f& surface = picture.surfaces[20 * 64 + 20];
  EXPECT_LT((V3d(surface.x, surface.y, surface.z) - normal).length(), support::rounding(8));
  EXPECT_TRUE(isGround(picture, 39, 30));
  EXPECT_FALSE(isGround(picture, 41, 30));
}

/// Patches are sent to the device once. If they exceed its memory, they are drawn in parts, with
/// the same picture.
TEST(GpuTerrain, KeepsPatchesOnTheDevice) {
  Land land({0, 0, 0});
  Camera camera;
  camera.from = {-50, -40, 30};
  camera.to = {0, 0, 0};
  camera.up = {0, 0, 1};
  camera.width = 320;
  camera.height = 200;
  const TerrainSelection selection = land.detail.select(camera, 1);
  const TerrainPicture first = land.painter->draw(selection, camera);
  EXPECT_EQ(land.painter->cost().uploads, selection.parts.size());
  EXPECT_EQ(land.painter->cost().calls, 1u);
  const TerrainPicture second = land.painter->draw(selection, camera);
  EXPECT_EQ(land.painter->cost().uploads, 0u);
  EXPECT_EQ(first.colours, second.colours);
  const auto small = makeTerrainPainter(land.detail.layout(), 10 * 81 * sizeof(float));
  const TerrainPicture third = small->draw(selection, camera);
  EXPECT_GT(small->cost().calls, 1u);
  EXPECT_EQ(first.colours, third.colours);
  EXPECT_EQ(first.surfaces, third.surfaces);
}

TEST(GpuTerrain, RefusesWithSentences) {
  Land land({0, 0, 0}, 20, 20);
  EXPECT_THROW((void)makeTerrainPainter(land.detail.layout(), 10), levelset::UsageError);
  Camera camera;
  EXPECT_THROW((void)land.painter->draw({}, camera, {.towardsLight = V3d(0)}),
               levelset::UsageError);
  camera.width = 100000;
  camera.height = 2;
  EXPECT_THROW((void)land.painter->draw({}, camera), levelset::ResourceLimit);
}

TEST(PatchSlots, ReuseThePlaceThatWasUsedFirst) {
  PatchSlots slots(2);
  slots.startPicture();
  EXPECT_TRUE(slots.place(1)->isNew);
  EXPECT_TRUE(slots.place(2)->isNew);
  EXPECT_FALSE(slots.place(3));  // both are needed for this picture
  EXPECT_FALSE(slots.place(1)->isNew);
  slots.startPicture();
  EXPECT_EQ(slots.place(3)->number, 1u);
  EXPECT_FALSE(slots.place(1)->isNew);
}

}  // namespace gpu_terrain_test
