#include "levelset/points/field/local_quadric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/measured.h"

namespace local_quadric_test {

using Imath::V3d;
using levelset::points::LocalQuadric;
using levelset::points::QuadricFit;

double height(double x, double y) {
  return 0.1 + 0.2 * x - 0.3 * y + 0.5 * x * x - 0.4 * x * y + 0.25 * y * y;
}

V3d normalAt(double x, double y) {
  return V3d(-(0.2 + x - 0.4 * y), -(-0.3 - 0.4 * x + 0.5 * y), 1).normalized();
}

/// Fit to points of the height function in a disc of radius 0.5.
LocalQuadric fitOf(double scale, bool hasNormals) {
  QuadricFit fit(V3d(0), V3d(0, 0, 1), 0.6 * scale);
  for (int n = 0; n < 20; ++n) {
    const double radius = 0.5 * std::sqrt((n + 0.5) / 20), turn = 2.4 * n;
    const double x = radius * std::cos(turn), y = radius * std::sin(turn);
    fit.add(scale * V3d(x, y, height(x, y)), hasNormals ? normalAt(x, y) : V3d(1, 0, 0),
            1.0 + n % 3);
  }
  return fit.solve();
}

TEST(LocalQuadric, ReproducesAQuadraticHeight) {
  for (const double scale : {1e-6, 1.0, 1e6})
    for (const bool hasNormals : {true, false}) {
      const LocalQuadric quadric = fitOf(scale, hasNormals);
      double worst = 0;
      for (const double x : {-0.3, 0.0, 0.2})
        for (const double y : {-0.25, 0.1, 0.3})
          worst =
              std::max(worst, std::abs(quadric.distance(scale * V3d(x, y, height(x, y)))) / scale);
      EXPECT_LT(worst, support::measured(2.4e-9)) << scale << ' ' << hasNormals;
      // Above the surface, the distance is that along the vertical, divided by the secant.
      const double above = 0.01;
      EXPECT_NEAR(quadric.distance(scale * V3d(0.1, 0.1, height(0.1, 0.1) + above)) / scale,
                  above * normalAt(0.1, 0.1).z, support::measured(2.1e-9));
    }
}

TEST(LocalQuadric, OfPointsOnALineIsFlatAcross) {
  QuadricFit fit(V3d(0), V3d(0, 0, 1), 1);
  for (int n = -5; n <= 5; ++n) fit.add(V3d(n / 5.0, 0, 0.1), V3d(1, 0, 0), 1);
  const LocalQuadric quadric = fit.solve();
  EXPECT_NEAR(quadric.distance(V3d(0.5, 0, 0.1)), 0, support::measured(1.5e-10));
  EXPECT_NEAR(quadric.distance(V3d(0, 0.9, 0.3)), 0.2, support::measured(2.3e-10));
}

}  // namespace local_quadric_test
