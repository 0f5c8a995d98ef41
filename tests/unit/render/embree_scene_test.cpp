#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "levelset/error.h"
#include "render/embree/embree_renderer.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace embree_scene_test {

using namespace render;
using Imath::V3d;
using levelset::NarrowBand;

NarrowBand sphereBand(const V3d& centre, double radius, double h) {
  return support::sampleBand([=](const V3d& p) { return (p - centre).length() - radius; },
                             {centre - V3d(radius), centre + V3d(radius)}, h);
}

Scene sceneOf(const NarrowBand& band) {
  Scene scene;
  scene.solids.push_back({.band = band});
  return scene;
}

/// The trilinear interpolant, written in the simplest form.
double trilinear(const NarrowBand& band, const V3d& world) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  const openvdb::Vec3d p = grid.worldToIndex(levelset::toVdb(world));
  const openvdb::Coord base = openvdb::Coord::floor(p);
  const openvdb::Vec3d f = p - base.asVec3d();
  double sum = 0;
  for (int n = 0; n < 8; ++n) {
    const int i = n & 1, j = n >> 1 & 1, k = n >> 2;
    const double weight = (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
    sum += weight * static_cast<double>(grid.tree().getValue(base.offsetBy(i, j, k)));
  }
  return sum;
}

V3d randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return V3d(normal(random), normal(random), normal(random)).normalized();
}

// Rays towards the centre meet the sphere at right angles, so the depth has the error of the
// interpolant. This error is h²/8 times the Laplacian, which is 2/r within the cell, plus the
// rounding of the values.
TEST(EmbreeScene, SphereDepthConvergesSecondOrder) {
  const V3d centre(0.013, -0.021, 0.007);
  double previous = 0;
  for (const double h : {0.1, 0.05, 0.025}) {
    const EmbreeScene scene(sceneOf(sphereBand(centre, 1, h)));
    std::mt19937 random(7);
    double worst = 0;
    for (int i = 0; i < 4000; ++i) {
      const V3d d = randomDirection(random);
      const Hit hit = scene.intersect(centre - d * 5.0, d);
      ASSERT_TRUE(hit.found);
      worst = std::max(worst, std::abs(hit.distance - 4));
      ASSERT_LT((hit.normal + d).length(), support::measured(4.99e-4) * h);
    }
    EXPECT_LT(worst, 0.25 * h * h / (1 - std::sqrt(3.0) * h) + 1e-7);
    if (previous > 0) {
      EXPECT_GT(std::log2(previous / worst), 1.8) << "h = " << h;
    }
    previous = worst;
    RecordProperty("worst_depth_error_in_voxels", std::to_string(worst / h));
  }
}

TEST(EmbreeScene, HitsLieOnTheInterpolant) {
  const double h = 0.05;
  const NarrowBand band = support::sampleBand(
      [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.4; },
      {V3d(-1.4, -1.4, -0.4), V3d(1.4, 1.4, 0.4)}, h);
  const EmbreeScene scene(sceneOf(band));
  std::mt19937 random(3);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const V3d d = randomDirection(random);
    const Hit hit = scene.intersect(randomDirection(random) * 3.0 - d * 3.0, d);
    if (!hit.found) continue;
    ++hits;
    ASSERT_LT(std::abs(trilinear(band, hit.position)), support::doubleRounding(40) * h);
  }
  EXPECT_GT(hits, 1000);
}

// Origins are on lattice points, directions are axial, diagonal or nearly axial, and grid values
// may be exactly zero. A ray must hit if it clearly meets the exact sphere, and miss if it clearly
// misses it. In between, the test steps along the interpolant itself.
TEST(EmbreeScene, LatticeRaysNeitherLeakNorHitFalsely) {
  const double radius = 50;
  const NarrowBand band = sphereBand(V3d(0), radius, 1);
  const EmbreeScene scene(sceneOf(band));
  const V3d directions[] = {{1, 0, 0}, {0, 1, 0},     {0, 0, 1},       {1, 1, 0},
                            {1, 1, 1}, {0.6, 0, 0.8}, {1e-4, 1e-5, 1}, {0.3, 0.4, 0.866}};
  const double slack = 0.01;  // > h²/8 (2/R) = 0.005 voxel
  int rays = 0, missed = 0, extra = 0, wrong = 0, grazing = 0;
  double worstResidual = 0;
  for (const V3d& raw : directions) {
    const V3d d = raw.normalized();
    const int axis = d.z >= d.x && d.z >= d.y ? 2 : d.x >= d.y ? 0 : 1;
    for (int i = -122; i <= 122; ++i) {
      for (int j = -122; j <= 122; ++j) {
        V3d origin(std::round(-250 * d.x), std::round(-250 * d.y), std::round(-250 * d.z));
        origin[(axis + 1) % 3] += i;
        origin[(axis + 2) % 3] += j;
        const Hit hit = scene.intersect(origin, d);
        ++rays;
        const double along = -origin.dot(d), squared = origin.length2() - along * along;
        const double apart = std::sqrt(std::max(0.0, squared));
        if (hit.found)
          worstResidual = std::max(worstResidual, std::abs(trilinear(band, hit.position)));
        if (apart > radius + slack) {
          extra += hit.found;
        } else if (apart < radius - slack) {
          missed += !hit.found;
          const auto depth = [&](double r) { return along - std::sqrt(r * r - squared); };
          wrong += hit.found &&
                   (hit.distance < depth(radius + slack) || hit.distance > depth(radius - slack));
        } else {
          ++grazing;
          bool isInside = false;
          double least = 1;
          for (double t = along - 3; t < along + 3; t += 1e-3) {
            const double value = trilinear(band, origin + d * t);
            isInside = isInside || value < 0;
            least = std::min(least, value);
          }
          missed += isInside && !hit.found;
          extra += hit.found && least > 1e-6;  // the step length exceeds the width of such a hit
        }
      }
    }
  }
  EXPECT_EQ(rays, 480200);
  EXPECT_GT(grazing, 20);
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(extra, 0);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(worstResidual, support::doubleRounding(60));
}

TEST(EmbreeScene, ThinSheetHasNoHoles) {
  const double thickness = 0.02;  // voxels, around a plane of grid points
  const NarrowBand band =
      support::sampleBand([=](const V3d& p) { return std::abs(p.z) - thickness / 2; },
                          {V3d(-20, -20, 0), V3d(20, 20, 0)}, 1);
  const EmbreeScene scene(sceneOf(band));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-15, 15);
  for (int i = 0; i < 20000; ++i) {
    V3d d = randomDirection(random);
    d.z = -std::abs(d.z) - 0.05;
    d.normalize();
    const bool onLattice = i % 2;
    V3d target(place(random), place(random), thickness / 2);
    if (onLattice) target = {std::round(target.x), std::round(target.y), target.z};
    const Hit hit = scene.intersect(target - d * 2.0, d);
    ASSERT_TRUE(hit.found);
    ASSERT_NEAR(hit.distance, 2, support::measured(6.33e-9));
    ASSERT_TRUE(scene.isOccluded(target - d * 2.0, d, 0, 2.1));
  }
}

// The saddle c - (x - 1/2)(y - 1/2) equals its trilinear interpolant and has exact grid values.
// Rays cross the surface twice in one cell, between ends of equal sign.
TEST(EmbreeScene, FindsBothCrossingsWithinOneCell) {
  const double c = 1.0 / 64;
  const EmbreeScene scene(sceneOf(support::sampleBand(
      [=](const V3d& p) { return c - (p.x - 0.5) * (p.y - 0.5); }, {V3d(-2), V3d(2)}, 1)));
  std::mt19937 random(13);
  std::uniform_real_distribution<double> inCell(0, 1);
  int within = 0, missing = 0;
  for (int i = 0; i < 20000; ++i) {
    const V3d d = randomDirection(random), start(inCell(random), inCell(random), inCell(random));
    const double u = start.x - 0.5, v = start.y - 0.5;
    // c - (u + t dx)(v + t dy) = 0
    const double qa = -d.x * d.y, qb = -(u * d.y + v * d.x), qc = c - u * v;
    const double discriminant = qb * qb - 4 * qa * qc;
    if (std::abs(discriminant) < 1e-9 || std::abs(qc) < 1e-6) continue;
    // Length of the ray within the cell.
    double leave = 10;
    for (int a = 0; a < 3; ++a) leave = std::min(leave, ((d[a] > 0 ? 1 : 0) - start[a]) / d[a]);
    double roots[2] = {10, 10};
    if (discriminant > 0) {
      const double q = -0.5 * (qb + std::copysign(std::sqrt(discriminant), qb));
      const double r0 = q / qa, r1 = qc / q;
      if (r0 > 0) roots[0] = r0;
      if (r1 > 0) roots[1] = r1;
      if (roots[1] < roots[0]) std::swap(roots[0], roots[1]);
    }
    const Hit hit = scene.intersect(start, d, 0, leave);
    if (roots[0] < leave - 1e-9) {
      ASSERT_TRUE(hit.found) << i;
      ASSERT_NEAR(hit.distance, roots[0], support::doubleRounding(12.5));
      within += roots[1] < leave;
    } else if (roots[0] > leave + 1e-9) {
      ASSERT_FALSE(hit.found) << i;
      ++missing;
    }
  }
  EXPECT_GT(within, 100);
  EXPECT_GT(missing, 1000);
}

TEST(EmbreeScene, RayFromInsideHitsTheExit) {
  const EmbreeScene scene(sceneOf(sphereBand(V3d(0), 1, 0.05)));
  std::mt19937 random(17);
  for (int i = 0; i < 500; ++i) {
    const V3d d = randomDirection(random);
    const Hit hit = scene.intersect(V3d(0), d);
    ASSERT_TRUE(hit.found);
    ASSERT_NEAR(hit.distance, 1, 0.25 * 0.05 * 0.05 + 1e-7);
    ASSERT_GT(hit.normal.dot(d), 0.999);  // points outwards
  }
}

TEST(EmbreeScene, NearAndFarLimitTheSearch) {
  const EmbreeScene scene(sceneOf(sphereBand(V3d(0), 1, 0.05)));
  const V3d origin(0.011, 0.013, -5), d(0, 0, 1);
  const Hit front = scene.intersect(origin, d), back = scene.intersect(origin, d, 4.5);
  EXPECT_NEAR(front.distance, 4, support::measured(6e-4));
  EXPECT_NEAR(back.distance, 6, support::measured(6e-4));
  EXPECT_FALSE(scene.intersect(origin, d, 0, front.distance - 1e-9).found);
  EXPECT_TRUE(scene.intersect(origin, d, 0, front.distance + 1e-9).found);
  EXPECT_FALSE(scene.isOccluded(origin, d, 0, front.distance - 1e-9));
  EXPECT_TRUE(scene.isOccluded(origin, d, 0, front.distance + 1e-9));
  EXPECT_FALSE(scene.isOccluded(origin, d, back.distance + 1e-9, 1e9));
}

TEST(EmbreeScene, DistanceDoesNotReducePrecision) {
  const NarrowBand band = sphereBand(V3d(0), 1, 0.05);
  const EmbreeScene scene(sceneOf(band));
  const V3d d = V3d(0.3, -0.4, 0.8).normalized();
  for (const double away : {1e1, 1e3, 1e5, 1e7}) {
    const Hit hit = scene.intersect(d * -away, d);
    ASSERT_TRUE(hit.found);
    EXPECT_NEAR(hit.distance, away - 1, 0.25 * 0.05 * 0.05 + 1e-7 + 1e-15 * away);
  }
}

TEST(EmbreeScene, FollowsRotatedAndScaledGrids) {
  const double h = 0.037, angle = 0.7;
  auto transform = openvdb::math::Transform::createLinearTransform(h);
  transform->postRotate(angle, openvdb::math::X_AXIS);
  transform->postRotate(1.1, openvdb::math::Z_AXIS);
  transform->postTranslate({1000.25, -3, 7.5});
  const V3d centre(1000.7, -3.2, 7.1);
  auto grid = levelset::emptyLevelSet(transform, 3);
  openvdb::Coord c;
  const openvdb::Coord middle = openvdb::Coord::round(grid->worldToIndex(levelset::toVdb(centre)));
  for (c[0] = middle[0] - 20; c[0] <= middle[0] + 20; ++c[0])
    for (c[1] = middle[1] - 20; c[1] <= middle[1] + 20; ++c[1])
      for (c[2] = middle[2] - 20; c[2] <= middle[2] + 20; ++c[2]) {
        const double value = (levelset::toImath(grid->indexToWorld(c)) - centre).length() - 0.5;
        if (std::abs(value) < 3 * h)
          grid->tree().setValueOn(c, static_cast<float>(value));
        else if (value < 0)
          grid->tree().setValueOff(c, static_cast<float>(-3 * h));
      }
  const EmbreeScene scene(sceneOf(levelset::makeBand(grid)));
  std::mt19937 random(19);
  for (int i = 0; i < 2000; ++i) {
    const V3d d = randomDirection(random);
    const Hit hit = scene.intersect(centre - d * 2.0, d);
    ASSERT_TRUE(hit.found);
    ASSERT_NEAR(hit.distance, 1.5, 0.5 * h * h + 1e-7);
    ASSERT_LT((hit.normal + d).length(), support::measured(1.77e-5));
    ASSERT_NEAR(hit.curvature.mean, 2, support::measured(0.0032));
  }
}

TEST(EmbreeScene, NearestSolidWinsAndTiesGoToTheLowerId) {
  const NarrowBand left = sphereBand(V3d(0, 0, -1), 0.5, 0.05);
  const NarrowBand right = sphereBand(V3d(0, 0, 1), 0.5, 0.05);
  Scene scene;
  scene.solids.push_back({.band = left, .id = 9});
  scene.solids.push_back({.band = right, .id = 4});
  const EmbreeScene both(scene);
  EXPECT_EQ(both.intersect({0.01, 0.02, -5}, {0, 0, 1}).id, 9u);
  EXPECT_EQ(both.intersect({0.01, 0.02, 5}, {0, 0, -1}).id, 4u);

  scene.solids = {{.band = left, .id = 7}, {.band = left, .id = 3}, {.band = left, .id = 5}};
  const EmbreeScene same(scene);
  std::mt19937 random(23);
  for (int i = 0; i < 500; ++i) {
    const V3d d = randomDirection(random);
    const Hit hit = same.intersect(V3d(0, 0, -1) - d, d);
    ASSERT_EQ(hit.id, 3u);
    ASSERT_EQ(hit.solid, 1u);
  }
}

TEST(EmbreeScene, OcclusionAgreesWithHits) {
  const double h = 0.06;
  const NarrowBand band = support::sampleBand(
      [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.3; },
      {V3d(-1.3, -1.3, -0.3), V3d(1.3, 1.3, 0.3)}, h);
  const EmbreeScene scene(sceneOf(band));
  std::mt19937 random(29);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const V3d d = randomDirection(random), origin = randomDirection(random) * 1.5;
    const bool isHit = scene.intersect(origin, d, 0, 2).found;
    hits += isHit;
    ASSERT_EQ(scene.isOccluded(origin, d, 0, 2), isHit);
  }
  EXPECT_GT(hits, 2000);
}

TEST(EmbreeScene, CurvatureOfATorus) {
  const double ring = 1, tube = 0.4, h = 0.02;
  const EmbreeScene scene(sceneOf(support::sampleBand(
      [=](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - ring, p.z) - tube; },
      {V3d(-1.4, -1.4, -0.4), V3d(1.4, 1.4, 0.4)}, h)));
  std::mt19937 random(31);
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  for (int i = 0; i < 2000; ++i) {
    const double u = angle(random), v = angle(random);
    const V3d n(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
    const V3d middle(ring * std::cos(u), ring * std::sin(u), 0);
    const Hit hit = scene.intersect(middle, n);
    ASSERT_TRUE(hit.found);
    EXPECT_LT((hit.normal - n).length(), support::measured(6.34e-6));
    const double around = std::cos(v) / (ring + tube * std::cos(v)), across = 1 / tube;
    const CurvatureSample c = hit.curvature;
    ASSERT_NEAR(c.k1, across, support::measured(8.03e-4) * across);
    ASSERT_NEAR(c.k2, around, support::measured(5.02e-4) * across);
    ASSERT_NEAR(c.mean, (across + around) / 2, support::measured(4.34e-4) * across);
    ASSERT_NEAR(c.gauss, across * around, support::measured(5.6e-4) * across * across);
  }
}

TEST(EmbreeScene, EmptySceneHasNoHits) {
  const EmbreeScene scene((Scene()));
  EXPECT_TRUE(scene.bounds().isEmpty());
  EXPECT_FALSE(scene.intersect(V3d(0), V3d(1, 0, 0)).found);
  EXPECT_FALSE(scene.isOccluded(V3d(0), V3d(1, 0, 0), 0, 1));
}

TEST(EmbreeScene, RefusesInvalidRays) {
  const EmbreeScene scene(sceneOf(sphereBand(V3d(0), 1, 0.2)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)scene.intersect(V3d(nan, 0, 0), V3d(1, 0, 0)), levelset::UsageError);
  EXPECT_THROW((void)scene.intersect(V3d(0), V3d(nan, 0, 0)), levelset::UsageError);
  EXPECT_THROW((void)scene.isOccluded(V3d(0), V3d(0), 0, 1), levelset::UsageError);
}

}  // namespace embree_scene_test
