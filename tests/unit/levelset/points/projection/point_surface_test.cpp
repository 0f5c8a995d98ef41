#include "levelset/points/projection/point_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/unit/levelset/points/projection/projected_points.h"

namespace point_surface_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::PointCloud;
using levelset::points::PointSurface;
using support::doubleRounding;
using support::measured;
using support::measuredOrder;
using support::refusal;

/// Figures of projections of positions beside a surface, in spacings.
struct Figures {
  double mean = 0, worst = 0;  ///< distance from the surface
  double idempotence = 0;      ///< greatest distance from a foot to its own foot
  double worstNormal = 0;      ///< radians
};

template <class Distance, class Normal>
Figures project(const PointSurface& surface, const PointCloud& from, double spacing,
                const Distance& distance, const Normal& normal) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> offset(-0.3, 0.3);
  Figures figures;
  for (const V3d& p : from.positions) {
    const auto foot = surface.project(p + normal(p) * (offset(random) * spacing));
    if (!foot) {
      ADD_FAILURE() << "no foot";
      continue;
    }
    const double miss = distance(foot->point) / spacing;
    figures.mean += miss / static_cast<double>(from.size());
    figures.worst = std::max(figures.worst, miss);
    const V3d truth = normal(foot->point);
    figures.worstNormal =
        std::max(figures.worstNormal,
                 std::atan2(truth.cross(foot->normal).length(), truth.dot(foot->normal)));
    if (const auto again = surface.project(foot->point))
      figures.idempotence =
          std::max(figures.idempotence, (again->point - foot->point).length() / spacing);
    else
      ADD_FAILURE() << "no foot of a foot";
  }
  return figures;
}

double sphereDistance(const V3d& p) {
  return std::abs(p.length() - 1);
}
V3d sphereNormal(const V3d& p) {
  return p.normalized();
}

Figures onSphere(std::size_t count) {
  const PointSurface surface(projected_points::sphere(count), {});
  return project(surface, projected_points::sphere(1501),
                 projected_points::hexagonalSpacing(4 * std::numbers::pi, count), sphereDistance,
                 sphereNormal);
}

const double kTorusArea = 1.6 * std::numbers::pi * std::numbers::pi;

Figures onTorus(const PointCloud& cloud, double smoothing) {
  const PointSurface surface(cloud, {.smoothing = smoothing});
  return project(surface, projected_points::torus(1501),
                 projected_points::hexagonalSpacing(kTorusArea, cloud.size()),
                 projected_points::torusDistance, projected_points::torusNormal);
}

/// Order of the mean error in world units, when four times as many points halve the spacing.
double orderOf(const Figures& coarse, const Figures& fine) {
  return 1 + std::log2(coarse.mean / fine.mean);
}

TEST(PointSurface, ConvergesOnASphere) {
  const Figures coarse = onSphere(1000), middle = onSphere(4000);
  EXPECT_LT(coarse.mean, measured(4.4e-6));
  EXPECT_LT(middle.mean, measured(1.8e-7));
  EXPECT_GT(orderOf(coarse, middle), measuredOrder(5.6));
  EXPECT_LT(middle.worstNormal, measured(4.9e-5));
  EXPECT_LT(middle.idempotence, doubleRounding(25));
}

TEST(PointSurface, ConvergesOnATorus) {
  const Figures coarse = onTorus(projected_points::torus(1000), 1),
                middle = onTorus(projected_points::torus(4000), 1),
                fine = onTorus(projected_points::torus(16000), 1);
  EXPECT_LT(middle.mean, measured(8.2e-6));
  EXPECT_LT(middle.worst, measured(2.6e-4));
  EXPECT_GT(orderOf(coarse, middle), measuredOrder(5.8));
  EXPECT_GT(orderOf(middle, fine), measuredOrder(5.0));
  EXPECT_LT(middle.worstNormal, measured(1.5e-3));
  EXPECT_LT(middle.idempotence, measured(3.3e-6));
}

TEST(PointSurface, SmoothsNoise) {
  PointCloud cloud = projected_points::torus(4000);
  projected_points::addNoise(cloud, 0.1 * projected_points::hexagonalSpacing(kTorusArea, 4000));
  const Figures sharp = onTorus(cloud, 1), smooth = onTorus(cloud, 2);
  EXPECT_LT(sharp.mean, measured(0.054));
  EXPECT_LT(smooth.mean, measured(0.024));
  EXPECT_LT(smooth.idempotence, measured(5.2e-4));
}

TEST(PointSurface, ReproducesAPlaneAndAQuadric) {
  PointCloud plane = projected_points::square(20);
  const PointSurface flat(plane, {});
  PointCloud bowl = plane;
  for (V3d& p : bowl.positions) {
    p -= V3d(0.5, 0.5, 0);
    p.z = p.x * p.x - 0.5 * p.y * p.y;
  }
  const PointSurface curved(bowl, {});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0.2, 0.8);
  for (int i = 0; i < 200; ++i) {
    const V3d p(uniform(random), uniform(random), 0.02);
    const auto foot = flat.project(p);
    ASSERT_TRUE(foot);
    EXPECT_LT((foot->point - V3d(p.x, p.y, 0)).length(), doubleRounding(8));
  }
  // At the origin the local coordinates are those of the quadric, up to the angle that is left.
  const auto foot = curved.project(V3d(0, 0, 0.01));
  ASSERT_TRUE(foot);
  EXPECT_LT(foot->point.length(), measured(1.1e-8));
  EXPECT_NEAR(std::abs(foot->normal.z), 1, doubleRounding(20));
}

TEST(PointSurface, KeepsTwoSheetsApart) {
  PointCloud sheets = projected_points::square(30);
  const std::size_t lower = sheets.size();
  const double gap = 3.0 / 30;
  for (std::size_t i = 0; i < lower; ++i)
    sheets.positions.push_back(sheets.positions[i] + V3d(0.01, 0.005, gap));
  const PointSurface surface(sheets, {});
  EXPECT_EQ(surface.partCount(), 2u);
  double worst = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const V3d& p = surface.positions()[i];
    const double height = p.z > gap / 2 ? gap : 0;
    const auto foot = surface.project(p + V3d(0, 0, p.z > gap / 2 ? -0.3 * gap : 0.3 * gap));
    ASSERT_TRUE(foot);
    worst = std::max(worst, std::abs(foot->point.z - height));
  }
  EXPECT_LT(worst, doubleRounding(1));
}

TEST(PointSurface, HasABorderAroundASquareOnly) {
  const PointSurface square(projected_points::square(20), {});
  for (std::size_t i = 0; i < square.size(); ++i) {
    const V3d& p = square.positions()[i];
    const bool isOnEdge = p.x == 0 || p.y == 0 || p.x == 1 || p.y == 1;
    EXPECT_EQ(square.isBorder(i), isOnEdge) << p;
  }
  const PointSurface closed(projected_points::sphere(1000), {});
  for (std::size_t i = 0; i < closed.size(); ++i) EXPECT_FALSE(closed.isBorder(i));
  const auto beyond = square.project(V3d(1.05, 0.5, 0)), inside = square.project(V3d(0.95, 0.5, 0));
  ASSERT_TRUE(beyond && inside);
  EXPECT_TRUE(beyond->isBeyondBorder);
  EXPECT_FALSE(inside->isBeyondBorder);
  EXPECT_LT((square.borderEnd(beyond->point, beyond->nearest).point - V3d(1, 0.5, 0)).length(),
            doubleRounding(4));
}

TEST(PointSurface, TakesTheSideOfGivenNormals) {
  PointCloud cloud = projected_points::sphere(1000);
  for (const V3d& p : cloud.positions) cloud.normals.emplace_back(-p);
  const PointSurface inwards(cloud, {});
  cloud.normals.clear();
  const PointSurface outwards(cloud, {});
  for (std::size_t i = 0; i < inwards.size(); ++i) {
    EXPECT_LT(inwards.normal(i).dot(inwards.positions()[i]), -0.99);
    EXPECT_GT(outwards.normal(i).dot(outwards.positions()[i]), 0.99);
  }
}

TEST(PointSurface, KnowsTheCurvature) {
  const PointSurface surface(projected_points::torus(4000), {});
  double worst = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    // The circle of the tube bends most: 1 / 0.4.
    worst = std::max(worst, std::abs(surface.curvature(i) - 2.5));
  }
  EXPECT_LT(worst, measured(0.071));
}

TEST(PointSurface, HasTheSameBitsForAnyNumberOfThreads) {
  PointCloud cloud = projected_points::torus(2000);
  projected_points::addNoise(cloud, 0.003);
  const auto feet = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      const PointSurface surface(cloud, {});
      std::vector<double> all;
      for (const V3d& p : cloud.positions) {
        const auto foot = surface.project(p * 1.01);
        if (foot) all.insert(all.end(), {foot->point.x, foot->point.y, foot->normal.z});
      }
      return all;
    });
  };
  const auto one = feet(1);
  EXPECT_EQ(one.size(), 3 * cloud.size());
  EXPECT_EQ(one, feet(4));
}

TEST(PointSurface, RefusesPointsWithoutASurface) {
  PointCloud cloud;
  cloud.positions = {V3d(0), V3d(1, 0, 0), V3d(0)};
  EXPECT_NE(refusal<InvalidInput>([&] {
              static_cast<void>(PointSurface(cloud, {}));
            }).find("fewer than 3 different positions"),
            std::string::npos);
  for (int i = 0; i < 50; ++i) cloud.positions.emplace_back(0.1 * i, 0.2 * i, 0.3 * i);
  cloud.positions.erase(cloud.positions.begin(), cloud.positions.begin() + 3);
  EXPECT_NE(refusal<InvalidInput>([&] {
              static_cast<void>(PointSurface(cloud, {}));
            }).find("lie on a line"),
            std::string::npos);
}

}  // namespace point_surface_test
