#include "render/bezier/bezier_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "levelset/error.h"
#include "tests/support/bezier_scenes.h"

namespace {

using bezier_scenes::Numbers;
using bezier_scenes::V3d;
using render::BezierPatch;
using render::BezierVolume;

TEST(BezierVolume, ConvertsSplinesByKnotInsertion) {
  // The B-spline volume as a map of the unit cube is the reference.
  Numbers numbers(3);
  for (const bool isRational : {false, true}) {
    render::SplineVolume spline;
    spline.axes = {levelset::uniformAxis(3, 6), levelset::uniformAxis(2, 3),
                   levelset::uniformAxis(1, 4)};
    spline.attributes.resize(1);
    for (int n = 0; n < 6 * 3 * 4; ++n) {
      spline.points.emplace_back(numbers(), numbers(), numbers());
      spline.attributes[0].push_back(numbers());
      if (isRational) spline.weights.push_back(1.5 + numbers());
    }
    const Imath::M44d cube = levelset::frameOf({V3d(0), V3d(1)});
    const levelset::ControlLattice reference({spline.axes, cube, spline.points, spline.weights});
    const std::vector<BezierPatch> patches = bezierPatches(spline);
    ASSERT_EQ(patches.size(), 3U * 1 * 3);
    double worst = 0;
    for (std::size_t n = 0; n < patches.size(); ++n)
      for (int sample = 0; sample < 20; ++sample) {
        const V3d local = (V3d(numbers(), numbers(), numbers()) + V3d(1)) / 2;
        const V3d cell(static_cast<double>(n / 3), 0, static_cast<double>(n % 3));
        const V3d global = (cell + local) / V3d(3, 1, 3);
        worst = std::max(worst, (positionAt(patches[n], local) - reference.at(global)).length());
      }
    EXPECT_LE(worst, 2e-15);  // measured 7e-16
  }
}

TEST(BezierVolume, ElevatesWithoutChange) {
  Numbers numbers(5);
  BezierPatch patch = bezier_scenes::collapsedEdge().patches[0];
  BezierPatch high = patch;
  for (int axis = 0; axis < 3; ++axis) high = elevated(elevated(high, axis), axis);
  EXPECT_EQ(high.degree, (std::array<int, 3>{4, 4, 4}));
  double worst = 0;
  for (int sample = 0; sample < 100; ++sample) {
    const V3d u = (V3d(numbers(), numbers(), numbers()) + V3d(1)) / 2;
    worst = std::max({worst, (positionAt(patch, u) - positionAt(high, u)).length(),
                      std::abs(attributeAt(patch, 0, u) - attributeAt(high, 0, u))});
  }
  EXPECT_LE(worst, 1.3e-15);  // measured 5e-16
}

TEST(BezierVolume, AttributesAreThoseOfTheirPolynomials) {
  Numbers numbers(7);
  double worst = 0;
  for (int degree = 2; degree <= 5; ++degree) {
    const BezierPatch ball = bezier_scenes::sphere(degree).patches[0];
    for (int sample = 0; sample < 50; ++sample) {
      const V3d u = (V3d(numbers(), numbers(), numbers()) + V3d(1)) / 2;
      worst =
          std::max(worst, std::abs(attributeAt(ball, 0, u) - positionAt(ball, u).length2() + 1));
    }
  }
  const BezierPatch drop = bezier_scenes::teardrop().patches[0];
  for (int sample = 0; sample < 50; ++sample) {
    const V3d u = (V3d(numbers(), numbers(), numbers()) + V3d(1)) / 2;
    const V3d p = positionAt(drop, u);
    worst = std::max(worst, std::abs(attributeAt(drop, 0, u) - p.y * p.y - p.z * p.z +
                                     0.5 * std::pow(p.x, 4) * (p.x + 1)));
  }
  EXPECT_LE(worst, 4e-15);  // measured 1.6e-15
}

TEST(BezierVolume, FindsTheInsideOfAllAttributesAtOnce) {
  Numbers numbers(11);
  const BezierPatch patch = bezier_scenes::dice().patches[0];
  std::size_t inside = 0;
  for (int sample = 0; sample < 100; ++sample) {
    const V3d u = (V3d(numbers(), numbers(), numbers()) + V3d(1)) / 2;
    const std::vector<char> found = insideAt(patch, 0, u);
    for (std::size_t a = 0; a < patch.attributes.size(); ++a) {
      EXPECT_EQ(found[a] != 0, attributeAt(patch, a, u) < 0);
      inside += found[a] != 0;
    }
  }
  EXPECT_GT(inside, 100U);
}

TEST(BezierVolume, SidesOfExpressions) {
  using render::sideOf;
  using render::SurfaceSide;
  const std::vector<int> difference{0, 1, -3};
  EXPECT_EQ(sideOf(difference, 0, {0, 0}), SurfaceSide::Same);
  EXPECT_EQ(sideOf(difference, 0, {0, 1}), SurfaceSide::None);
  EXPECT_EQ(sideOf(difference, 1, {1, 0}), SurfaceSide::Flipped);
  EXPECT_EQ(sideOf(difference, 1, {0, 0}), SurfaceSide::None);
  EXPECT_EQ(sideOf({0, 1, -1}, 1, {1, 0}), SurfaceSide::None);
  EXPECT_EQ(sideOf({0, 1, -2}, 1, {1, 0}), SurfaceSide::Same);
  EXPECT_EQ(sideOf({}, 0, {0}), SurfaceSide::Same);
}

TEST(BezierVolume, RefusesWhatIsNoVolume) {
  const auto refused = [](const std::function<void(BezierVolume&)>& spoil) -> std::string {
    BezierVolume volume = bezier_scenes::collapsedEdge();
    spoil(volume);
    try {
      requireBezierVolume(volume);
    } catch (const levelset::InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refused([](BezierVolume&) {}), "");
  EXPECT_EQ(refused([](BezierVolume& v) { v.patches[0].weights[3] = 0; }),
            "patch 0: weight 3 is 0; give positive weights from 1e-06 to 1000000");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].weights[3] = -1; }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].weights.pop_back(); }), "");
  EXPECT_NE(refused([](BezierVolume& v) {
              v.patches[0].points[0].x = std::numeric_limits<double>::quiet_NaN();
            }),
            "");
  EXPECT_NE(refused([](BezierVolume& v) {
              v.patches[0].attributes[0][2] = std::numeric_limits<double>::infinity();
            }),
            "");
  EXPECT_NE(refused([](BezierVolume& v) { v.isovalue = std::nan(""); }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].degree[1] = 0; }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].degree[1] = 21; }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].points.pop_back(); }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches[0].attributes.clear(); }), "");
  EXPECT_NE(refused([](BezierVolume& v) { v.patches.clear(); }), "");
  EXPECT_NE(refused([](BezierVolume& v) {
              v.patches[0].attributes.push_back(v.patches[0].attributes[0]);
            }),
            "");  // two attributes without an expression
  for (const std::vector<int>& expression :
       {std::vector<int>{1}, {0, 0}, {0, -1}, {-1}, {0, 0, -4}})
    EXPECT_NE(refused([&](BezierVolume& v) { v.expression = expression; }), "");
}

}  // namespace
