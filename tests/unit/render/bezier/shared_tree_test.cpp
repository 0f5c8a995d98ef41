#include "render/bezier/shared_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "levelset/error.h"
#include "render/bezier/bezier_caster.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/threads.h"

namespace {

using bezier_scenes::V3d;
using render::BezierPicture;
using render::BezierRoot;
using render::BezierVolume;
using render::Camera;

Camera cameraAt(const V3d& from, int size, std::optional<double> ortho = {}) {
  Camera camera;
  camera.from = from;
  camera.up = V3d(0.1, 0.2, 1);
  camera.width = camera.height = size;
  camera.orthoHeight = ortho;
  return camera;
}

/// Distances of the two intersections of a ray with the unit sphere.
std::vector<double> ofSphere(const Camera::Ray& ray) {
  const double b = ray.origin.dot(ray.direction), c = ray.origin.length2() - 1, d = b * b - c;
  if (d <= 0) return {};
  return {-b - std::sqrt(d), -b + std::sqrt(d)};
}

bool isSame(const BezierPicture& a, const BezierPicture& b) {
  if (a.first != b.first || a.roots.size() != b.roots.size()) return false;
  for (std::size_t n = 0; n < a.roots.size(); ++n) {
    const BezierRoot &r = a.roots[n], &s = b.roots[n];
    if (r.depth != s.depth || r.distance != s.distance || r.patch != s.patch ||
        r.attribute != s.attribute || r.parameter != s.parameter || r.normal != s.normal ||
        r.isEntry != s.isEntry || r.isSingular != s.isSingular)
      return false;
  }
  return true;
}

TEST(SharedTree, FindsBothSidesOfTheExactSphere) {
  double distance = 0, normal = 0;
  for (const std::optional<double> ortho : {std::optional<double>(), std::optional<double>(2.6)}) {
    const Camera camera = cameraAt(V3d(2, -3, 1.5), 48, ortho);
    for (int degree = 2; degree <= 5; ++degree) {
      const BezierPicture all =
          castBezier(bezier_scenes::sphere(degree), camera, {.allRoots = true});
      std::size_t pixel = 0, hits = 0;
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x, ++pixel) {
          const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
          const std::vector<double> exact = ofSphere(ray);
          ASSERT_EQ(all.first[pixel + 1] - all.first[pixel], exact.size()) << x << " " << y;
          for (std::size_t n = 0; n < exact.size(); ++n) {
            const BezierRoot& root = all.roots[all.first[pixel] + n];
            distance = std::max(distance, std::abs(root.distance - exact[n]));
            normal =
                std::max(normal, (root.normal - (ray.origin + ray.direction * exact[n])).length());
            EXPECT_EQ(root.isEntry, n == 0);
          }
          hits += !exact.empty();
        }
      EXPECT_GT(hits, 500U);
    }
  }
  EXPECT_LE(distance, 1.2e-13);  // measured 4.3e-14
  EXPECT_LE(normal, 1.8e-8);     // measured 6.2e-9
}

TEST(SharedTree, FindsParametricSurfaces) {
  // Eight rational patches make the exact sphere. Their common edges give each root once.
  const BezierVolume volume = bezier_scenes::sphereSurfaces();
  requireBezierVolume(volume);
  double distance = 0, normal = 0;
  for (const V3d& from : {V3d(2, -3, 1.5), V3d(0, 0, 4), V3d(4, 0, 0)}) {
    const Camera camera = cameraAt(from, 33);
    const BezierPicture all = castBezier(volume, camera, {.allRoots = true});
    std::size_t pixel = 0;
    for (int y = 0; y < 33; ++y)
      for (int x = 0; x < 33; ++x, ++pixel) {
        const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
        const std::vector<double> exact = ofSphere(ray);
        ASSERT_EQ(all.nearest(pixel) == nullptr, exact.empty()) << x << " " << y;
        const std::size_t count = all.first[pixel + 1] - all.first[pixel];
        EXPECT_EQ(count, exact.size()) << x << " " << y;
        if (exact.empty()) continue;
        const BezierRoot& root = *all.nearest(pixel);
        distance = std::max(distance, std::abs(root.distance - exact[0]));
        const V3d outside = ray.origin + ray.direction * exact[0];
        if (!root.isSingular) normal = std::max(normal, root.normal.cross(outside).length());
      }
  }
  EXPECT_LE(distance, 4e-14);  // measured 1.2e-14
  EXPECT_LE(normal, 1.4e-8);   // measured 4.8e-9
}

TEST(SharedTree, HasTheSameBitsForAnyNumberOfThreads) {
  for (const BezierVolume& volume : {bezier_scenes::bentCylinder(), bezier_scenes::dice()}) {
    const Camera camera = cameraAt(V3d(3, -4, 2), 70);
    for (const bool all : {false, true}) {
      const auto cast = [&] { return castBezier(volume, camera, {.allRoots = all}); };
      const BezierPicture one = support::onThreads(1, cast), four = support::onThreads(4, cast);
      EXPECT_GT(one.roots.size(), 1000U);
      EXPECT_TRUE(isSame(one, four));
    }
  }
}

TEST(SharedTree, SharingChangesNoBit) {
  // Roots are found in the same nodes for each size of the tiles, also without sharing.
  const BezierVolume volume = bezier_scenes::bentCylinder();
  const Camera camera = cameraAt(V3d(3, -4, 2), 32);
  const BezierPicture shared = castBezier(volume, camera, {.allRoots = true});
  EXPECT_TRUE(isSame(shared, castBezier(volume, camera, {.allRoots = true, .tile = 5})));
  EXPECT_TRUE(
      isSame(shared, castBezier(volume, camera, {.allRoots = true, .tile = 1, .sharedLevels = 0})));
  const BezierPicture nearest = castBezier(volume, camera);
  for (std::size_t pixel = 0; pixel + 1 < shared.first.size(); ++pixel) {
    const BezierRoot *a = nearest.nearest(pixel), *b = shared.nearest(pixel);
    ASSERT_EQ(a == nullptr, b == nullptr);
    if (a) {
      EXPECT_EQ(a->depth, b->depth);
    }
  }
}

TEST(SharedTree, TheNearestRootIsTheFirstOfAll) {
  // So it does not depend on the order in which nodes are visited. Along z, rays lie in the faces
  // between the surfaces, and find roots twice that differ by a rounding error.
  std::vector<bezier_scenes::BezierScene> scenes = bezier_scenes::scenes(2, 24);
  Camera along = cameraAt(V3d(0, 0, 5), 65, 2.5);
  along.up = V3d(0, 1, 0);
  scenes.push_back({"surfaces along z", bezier_scenes::sphereSurfaces(), {along}});
  for (const bezier_scenes::BezierScene& scene : scenes)
    for (const Camera& camera : scene.cameras) {
      const BezierPicture all = castBezier(scene.volume, camera, {.allRoots = true}),
                          nearest = castBezier(scene.volume, camera);
      BezierPicture first;
      first.first.push_back(0);
      for (std::size_t pixel = 0; pixel + 1 < all.first.size(); ++pixel) {
        if (all.nearest(pixel)) first.roots.push_back(*all.nearest(pixel));
        first.first.push_back(first.roots.size());
      }
      EXPECT_GT(first.roots.size(), 20U) << scene.name;
      EXPECT_TRUE(isSame(nearest, first)) << scene.name;
    }
}

TEST(SharedTree, TurnedPatchesGiveTheSameSurface) {
  // A patch whose first parameter runs backwards has a negative Jacobian everywhere.
  BezierVolume volume = bezier_scenes::sphere(2), turned = volume;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 9; ++j) {
      const auto to = static_cast<std::size_t>(9 * i + j),
                 from = static_cast<std::size_t>(9 * (2 - i) + j);
      turned.patches[0].points[to] = volume.patches[0].points[from];
      turned.patches[0].attributes[0][to] = volume.patches[0].attributes[0][from];
    }
  const Camera camera = cameraAt(V3d(2, -3, 1.5), 24);
  const BezierPicture a = castBezier(volume, camera), b = castBezier(turned, camera);
  ASSERT_EQ(a.first, b.first);
  double depth = 0, normal = 0;
  for (std::size_t n = 0; n < a.roots.size(); ++n) {
    depth = std::max(depth, std::abs(a.roots[n].depth - b.roots[n].depth));
    normal = std::max(normal, (a.roots[n].normal - b.roots[n].normal).length());
  }
  EXPECT_LE(depth, 8e-15);     // measured 2.7e-15
  EXPECT_LE(normal, 2.7e-14);  // measured 9e-15
}

TEST(SharedTree, HitsTheSphereInATangent) {
  // Rays of pixel centres at x = 1 exactly: the double root is a hit, whose depth is known to the
  // root of the rounding error only.
  const BezierVolume volume = bezier_scenes::sphere(2);
  Camera camera = cameraAt(V3d(0, 0, 5), 4, 4.0);
  camera.up = V3d(0, 1, 0);
  camera.to = V3d(0.5, 0.5, 0);
  camera.from = V3d(0.5, 0.5, 5);
  const BezierPicture picture = castBezier(volume, camera, {.allRoots = true});
  std::size_t tangents = 0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      const auto pixel = static_cast<std::size_t>(4 * y + x);
      const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
      const double radius = std::hypot(ray.origin.x, ray.origin.y);
      const std::size_t count = picture.first[pixel + 1] - picture.first[pixel];
      if (radius != 1) {
        EXPECT_EQ(count, radius < 1 ? 2U : 0U);
        continue;
      }
      ++tangents;
      ASSERT_GE(count, 1U);
      EXPECT_TRUE(picture.roots[picture.first[pixel]].isSingular);
      EXPECT_NEAR(picture.roots[picture.first[pixel]].depth, 5, 6e-7);  // measured 2.2e-7
    }
  EXPECT_EQ(tangents, 4U);
  EXPECT_EQ(picture.counts.overruns, 0U);
}

TEST(SharedTree, HitsARootOfOrderFour) {
  // Two balls touch. The depth is known to the fourth root of the rounding error. With all roots,
  // so many nodes stay undecided that the ray gives up, and the overrun is counted.
  const BezierVolume volume = bezier_scenes::touchingBalls();
  const Camera camera = cameraAt(V3d(0, -6, 0), 1);
  const BezierPicture picture = castBezier(volume, camera);
  ASSERT_EQ(picture.roots.size(), 1U);
  EXPECT_TRUE(picture.roots[0].isSingular);
  EXPECT_NEAR(picture.roots[0].depth, 6, 1.7e-3);  // measured 5.7e-4
  EXPECT_EQ(castBezier(volume, camera, {.allRoots = true}).counts.overruns, 1U);
}

TEST(SharedTree, EdgesOfExpressionsStaySharp) {
  // In the parameters of the twisted die, no hit lies beyond an edge of the cube or in a pip.
  const BezierVolume volume = bezier_scenes::dice();
  const BezierPicture picture = castBezier(volume, cameraAt(V3d(3, -4, 2.5), 96));
  std::size_t faces = 0, pips = 0;
  double beyond = 0;
  for (const BezierRoot& root : picture.roots) {
    (root.attribute < 3 ? faces : pips) += 1;
    const V3d p = root.parameter * 2.4 - V3d(1.2);
    for (int c = 0; c < 3; ++c) beyond = std::max(beyond, std::abs(p[c]) - 1);
    for (std::size_t a = 3; a < volume.attributeCount(); ++a)
      if (a != root.attribute) {
        EXPECT_GE(attributeAt(volume.patches[0], a, root.parameter), 0);
      }
  }
  EXPECT_LE(beyond, 7e-16);  // measured 2.2e-16
  EXPECT_GT(faces, 1000U);
  EXPECT_GT(pips, 100U);
}

TEST(SharedTree, EndsAtNearAndFar) {
  const BezierVolume volume = bezier_scenes::sphere(3);
  Camera camera = cameraAt(V3d(0, -4, 0), 33);
  camera.near = 3.9;
  BezierPicture picture = castBezier(volume, camera);
  const std::size_t middle = 33 * 16 + 16;
  ASSERT_NE(picture.nearest(middle), nullptr);
  EXPECT_NEAR(picture.nearest(middle)->depth, 5, 1e-12);
  EXPECT_FALSE(picture.nearest(middle)->isEntry);
  camera.far = 4.5;
  EXPECT_EQ(castBezier(volume, camera).nearest(middle), nullptr);
  camera.near = 0;
  camera.far = 3.1;
  picture = castBezier(volume, camera);
  for (const BezierRoot& root : picture.roots) EXPECT_LE(root.depth, 3.1);
  EXPECT_GT(picture.roots.size(), 10U);
}

TEST(SharedTree, SurvivesAVolumeThatIsAllSurface) {
  // Each point of the box has the isovalue. The ray hits it where it enters.
  BezierVolume volume = bezier_scenes::sphere(2);
  for (double& value : volume.patches[0].attributes[0]) value = 0;
  const BezierPicture picture = castBezier(volume, cameraAt(V3d(0, -4, 0), 3));
  ASSERT_NE(picture.nearest(4), nullptr);
  EXPECT_NEAR(picture.nearest(4)->depth, 2.75, 2e-7);  // measured 7.5e-8
}

TEST(SharedTree, RefusesWhatNeedsTooMuchMemory) {
  EXPECT_THROW((void)castBezier(bezier_scenes::sphere(5), cameraAt(V3d(0, -4, 0), 512),
                                {.maxBytes = 10'000}),
               levelset::ResourceLimit);
  EXPECT_THROW(render::BezierCaster(bezier_scenes::sphere(5), 10'000), levelset::ResourceLimit);
}

TEST(BezierCaster, FindsTheHitsOfTheTree) {
  for (const BezierVolume& volume : {bezier_scenes::sphere(2), bezier_scenes::collapsedEdge(),
                                     bezier_scenes::folded(), bezier_scenes::dice()}) {
    const render::BezierCaster caster(volume);
    bezier_scenes::Numbers numbers(17);
    const Camera camera = randomCamera(volume, numbers, 16);
    const BezierPicture picture = castBezier(volume, camera);
    const double diagonal = volume.bounds().size().length();
    double worst = 0;
    std::size_t pixel = 0;
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x, ++pixel) {
        Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
        const std::optional<BezierRoot> hit = caster.firstHit(ray);
        const BezierRoot* root = picture.nearest(pixel);
        ASSERT_EQ(hit.has_value(), root != nullptr);
        EXPECT_EQ(caster.isOccluded(ray), root != nullptr);
        if (!root) continue;
        worst = std::max({worst, std::abs(hit->distance - root->distance) / diagonal,
                          (hit->parameter - root->parameter).length()});
        ray.far = root->distance * (1 - 1e-9);
        EXPECT_FALSE(caster.isOccluded(ray));
      }
    EXPECT_LE(worst, 9e-15);  // measured 3e-15
    EXPECT_GT(picture.roots.size(), 10U);
    // The box of the parts contains all hits.
    for (const BezierRoot& root : picture.roots) {
      const V3d p = positionAt(volume.patches[root.patch], root.parameter);
      for (int c = 0; c < 3; ++c) {
        EXPECT_GE(p[c], caster.bounds().min[c] - 1e-12);
        EXPECT_LE(p[c], caster.bounds().max[c] + 1e-12);
      }
    }
  }
}

}  // namespace
