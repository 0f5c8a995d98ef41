#include "mapping/layers/layer_schemes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "mapping/distortion/distortion.h"
#include "mapping/layers/layer_resampling.h"
#include "mapping/layers/relaxation.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace layer_schemes_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::LayerScheme;
using mapping::ParticleLayer;
using mapping::Patch;
using mapping::PatchOptions;
using mapping::PatchResult;
using support::makeBall;
using support::square;

/// The half-space below z = bump · cos x cos y.
NarrowBand makeGround(double bump, double voxel = 0.1) {
  return support::sampleBand(
      [=](const V3d& p) {
        return (p.z - bump * std::cos(4 * p.x) * std::cos(4 * p.y)) /
               std::sqrt(1 + 16 * bump * bump);
      },
      {V3d(-3, -3, -0.5), V3d(3, 3, 0.5)}, voxel);
}

std::size_t foldsOf(const Patch& patch) {
  return mapping::surveyDistortion(mapping::PrismMap(patch, {}).samples(), V3d(1)).folded;
}

TEST(SweepCurve, FollowsACircle) {
  std::vector<V3d> points;
  for (int i = 0; i <= 8; ++i)
    points.emplace_back(std::cos(i * M_PI / 8), std::sin(i * M_PI / 8), 0);
  const mapping::SweepCurve curve(points);
  EXPECT_NEAR(curve.length(), M_PI, support::measured(9.86e-4));
  for (double s = 0; s < curve.length(); s += 0.05) {
    const V3d p = curve.position(s), t = curve.tangent(s);
    EXPECT_NEAR(p.length(), 1, support::measured(7.14e-4));
    EXPECT_NEAR(t.length(), 1, support::doubleRounding(1));
    EXPECT_NEAR(t.dot(p), 0, support::measured(0.0168));
  }
  const mapping::SweepCurve straight(std::vector<V3d>{V3d(1), V3d(1, 1, 4)});
  EXPECT_DOUBLE_EQ(straight.length(), 3);
  EXPECT_LE((straight.position(1) - V3d(1, 1, 2)).length(), support::doubleRounding(4));
  EXPECT_LE((straight.tangent(3) - V3d(0, 0, 1)).length(), support::doubleRounding(4));
}

TEST(ConformingLayers, AreRadialAboveASphere) {
  const double radius = 2, height = 0.8;
  const double side = radius * std::sin(0.5) / std::sqrt(2.0), up = radius * std::cos(0.5);
  const PatchResult made = mapping::makePatch(makeBall(radius, 0.1), square(side, up), height,
                                              {.layers = 5, .scheme = LayerScheme::Conforming});
  ASSERT_EQ(made.patch.layers.size(), 5u);
  const ParticleLayer& surface = made.patch.layers.front();
  for (const ParticleLayer& layer : made.patch.layers) {
    const ParticleLayer below = mapping::withCounts(surface, layer.columns, layer.rows);
    for (std::size_t n = 0; n < layer.positions.size(); ++n) {
      EXPECT_NEAR(layer.positions[n].length(), radius + layer.w * height,
                  support::measured(2.38e-5) * height);
      EXPECT_LE((layer.positions[n].normalized() - below.positions[n].normalized()).length(),
                support::measured(2.16e-5));
    }
  }
  EXPECT_EQ(foldsOf(made.patch), 0u);
}

double spacingOf(const ParticleLayer& layer) {
  Patch patch;
  patch.layers = {layer};
  return mapping::meanSpacing(patch);
}

TEST(LayerDensity, EqualsTheDensityOfTheSurface) {
  // Layers two and a half times as wide at the top of the ball's patch, or a third as wide by
  // taper.
  const double side = std::sin(0.5) / std::sqrt(2.0), up = std::cos(0.5);
  const NarrowBand ball = makeBall(1, 0.05), ground = makeGround(0.05);
  const std::array<V3d, 4> onBall = square(side, up), onGround = square(1, 0);
  struct Made {
    const char* what;
    PatchResult result;
    double topStretch;
  };
  const Made all[] = {
      {"conforming",
       mapping::makePatch(ball, onBall, 1.5,
                          {.layers = 5, .scheme = LayerScheme::Conforming, .spacing = 0.08}),
       2.5},
      {"conforming, tapered",
       mapping::makePatch(ball, onBall, 1.5,
                          {.layers = 5,
                           .scheme = LayerScheme::Conforming,
                           .transform = {.taper = 0.6},
                           .spacing = 0.08}),
       1.6},
      {"spline, tapered",
       mapping::makePatch(
           ground, onGround, 1,
           {.layers = 5, .scheme = LayerScheme::Spline, .transform = {.taper = 1.0 / 3}}),
       1.0 / 3},
      {"reduced, tapered",
       mapping::makePatch(ground, onGround, 0.3, {.layers = 5, .transform = {.taper = 1.0 / 3}}),
       1.0 / 3}};
  for (const Made& made : all) {
    SCOPED_TRACE(made.what);
    const std::vector<ParticleLayer>& layers = made.result.patch.layers;
    const double spacing = spacingOf(layers.front());
    for (const ParticleLayer& layer : layers) {
      EXPECT_NEAR(spacingOf(layer) / spacing, 1, support::measured(0.243, 0.28)) << layer.w;
      EXPECT_TRUE(layer.hasRim());
      EXPECT_EQ(layer.rim.size(), 2 * (layer.columns + layer.rows) + 4);
    }
    const auto cells = [](const ParticleLayer& layer) {
      return static_cast<double>(layer.columns - 1);
    };
    EXPECT_NEAR(cells(layers.back()) / cells(layers.front()), made.topStretch,
                support::measured(0.0556));
    EXPECT_EQ(foldsOf(made.result.patch), 0u);
  }
  // A layer count that exceeds the budget of all layers is reduced unless it is requested.
  const PatchResult chosen =
      mapping::makePatch(ball, onBall, 1.5, {.layers = 12, .scheme = LayerScheme::Conforming});
  EXPECT_LE(chosen.patch.particleCount(), 2600u);
  for (const LayerScheme scheme : {LayerScheme::Reduced, LayerScheme::Conforming})
    for (const double taper : {1e3, 1e30, 1e300}) {
      const PatchOptions wide{
          .layers = 3, .scheme = scheme, .transform = {.taper = taper}, .spacing = 0.08};
      EXPECT_THROW((void)mapping::makePatch(ball, onBall, 0.3, wide), levelset::ResourceLimit)
          << taper;
    }
  const PatchResult counted = mapping::makePatch(
      ball, onBall, 1.5, {.layers = 3, .scheme = LayerScheme::Conforming, .cells = {8, 9}});
  for (const ParticleLayer& layer : counted.patch.layers) {
    EXPECT_EQ(layer.columns, 9u);
    EXPECT_EQ(layer.rows, 10u);
  }
}

TEST(LayerResampling, PreservesQuadraticsAndTheirRim) {
  // x and y are texture coordinates, z is a paraboloid. Catmull-Rom reproduces both.
  const auto place = [](double u, double v) { return V3d(u, 2 * v, u * u - u * v + 3 * v * v); };
  const auto sampled = [&](int columns, int rows) {
    ParticleLayer layer;
    layer.columns = static_cast<std::size_t>(columns);
    layer.rows = static_cast<std::size_t>(rows);
    layer.rim.resize(2 * (layer.columns + layer.rows) + 4);
    for (int j = -1; j <= rows; ++j)
      for (int i = -1; i <= columns; ++i) {
        const V3d p =
            place(i / static_cast<double>(columns - 1), j / static_cast<double>(rows - 1));
        if (i >= 0 && i < columns && j >= 0 && j < rows)
          layer.positions.push_back(p);
        else
          layer.rim[layer.rimIndex(i, j)] = p;
      }
    return layer;
  };
  const ParticleLayer coarse = sampled(8, 7), expected = sampled(15, 12);
  const ParticleLayer fine = mapping::withCounts(coarse, 15, 12);
  for (int j = -1; j <= 12; ++j)
    for (int i = -1; i <= 15; ++i)
      EXPECT_LE((fine.beyond(i, j) - expected.beyond(i, j)).length(), support::doubleRounding(8))
          << i << ' ' << j;
  // With fewer particles the new rim continues straight beyond the given one.
  const ParticleLayer few = mapping::withCounts(coarse, 4, 4);
  const V3d end = coarse.beyond(-1, 0), next = coarse.at(0, 0);
  EXPECT_LE((few.beyond(-1, 0) - (end + (end - next) * (4.0 / 3))).length(),
            support::doubleRounding(1));
  EXPECT_LE((few.at(3, 3) - coarse.at(7, 6)).length(), support::doubleRounding(4));
}

TEST(ConformingLayers, SpreadWhereReducedLayersStayEven) {
  // On bumpy ground. The thesis shows this effect in a figure; the test uses the areas of cells.
  const NarrowBand ground = makeGround(0.12);
  const PatchOptions even{.scheme = LayerScheme::Reduced, .spacing = 0.12},
      faithful{.scheme = LayerScheme::Conforming, .spacing = 0.12};
  const Patch reduced = mapping::makePatch(ground, square(1), 0.5, even).patch;
  const Patch conforming = mapping::makePatch(ground, square(1), 0.5, faithful).patch;
  EXPECT_LT(mapping::cellAreaVariation(reduced.layers.back()),
            0.5 * mapping::cellAreaVariation(conforming.layers.back()));
}

TEST(ConformingLayers, SlowDownTowardsTheMedialAxis) {
  // A trough whose walls meet above. Reduced layers are refused there, conforming layers fold and
  // report it.
  const NarrowBand trough =
      support::sampleBand([](const V3d& p) { return 1.5 - std::hypot(p.x, p.z - 1.5); },
                          {V3d(-1.6, -2, -0.2), V3d(1.6, 2, 3.2)}, 0.1);
  const std::array<V3d, 4> corners = {V3d(-0.9, -0.8, 0.3), V3d(0.9, -0.8, 0.3), V3d(0.9, 0.8, 0.3),
                                      V3d(-0.9, 0.8, 0.3)};
  const Patch patch =
      mapping::makePatch(trough, corners, 2, {.scheme = LayerScheme::Conforming}).patch;
  for (const V3d& p : patch.layers.back().positions)
    EXPECT_LE(std::abs(p.x), support::measured(0.00348));  // near the axis, not through it
  const Patch shallow =
      mapping::makePatch(trough, corners, 0.7, {.scheme = LayerScheme::Conforming}).patch;
  EXPECT_EQ(foldsOf(shallow), 0u);
}

TEST(SplineLayers, AreStraightByDefault) {
  const PatchOptions options{.layers = 4, .scheme = LayerScheme::Spline};
  const Patch patch = mapping::makePatch(makeGround(0), square(1), 1.5, options).patch;
  for (const ParticleLayer& layer : patch.layers)
    for (std::size_t n = 0; n < layer.positions.size(); ++n) {
      const V3d& foot = patch.layers.front().positions[n];
      EXPECT_LE((layer.positions[n] - foot - V3d(0, 0, 1.5 * layer.w)).length(),
                support::doubleRounding(1.25));
    }
}

TEST(SplineLayers, MoveAsRigidBodies) {
  // A quarter of a circle of radius 3, with the patch well inside it.
  std::vector<V3d> arc;
  for (int i = 1; i <= 6; ++i)
    arc.emplace_back(3 - 3 * std::cos(i * M_PI / 12), 0, 3 * std::sin(i * M_PI / 12));
  const PatchOptions options{.layers = 7, .scheme = LayerScheme::Spline, .spline = arc};
  const PatchResult made = mapping::makePatch(makeGround(0), square(1), 4.7, options);
  EXPECT_EQ(made.report.slowed, 0u);
  const std::vector<ParticleLayer>& layers = made.patch.layers;
  const auto spread = [](const ParticleLayer& layer, std::size_t n) {
    return (layer.positions[n] - layer.positions.front()).length();
  };
  for (const ParticleLayer& layer : layers)
    for (std::size_t n = 0; n < layer.positions.size(); ++n)
      EXPECT_NEAR(spread(layer, n), spread(layers.front(), n), support::doubleRounding(30));
  // At the end the layer faces along x, at the distance along the circle.
  V3d low(10), high(-10);
  for (const V3d& p : layers.back().positions)
    for (int axis = 0; axis < 3; ++axis)
      low[axis] = std::min(low[axis], p[axis]), high[axis] = std::max(high[axis], p[axis]);
  EXPECT_LE(high.x - low.x, 0.05);
  EXPECT_NEAR(high.z - low.z, 2, support::measured(2.05e-4));
  EXPECT_NEAR(0.5 * (low.z + high.z), 3, support::measured(7.57e-5));
  EXPECT_EQ(foldsOf(made.patch), 0u);
}

TEST(SplineLayers, SlowParticlesThatWouldCross) {
  // A bend of radius 0.5 under a patch that extends outwards by 1.
  const std::vector<V3d> bend = {V3d(0, 0, 0.5), V3d(0.15, 0, 0.85), V3d(0.5, 0, 1),
                                 V3d(1.5, 0, 1)};
  const PatchOptions options{.layers = 9, .scheme = LayerScheme::Spline, .spline = bend};
  const PatchResult made = mapping::makePatch(makeGround(0), square(1), 2.2, options);
  EXPECT_GT(made.report.slowed, 0u);
  EXPECT_LT(made.report.slowed, made.patch.layers.front().positions.size());
  for (std::size_t k = 1; k < made.patch.layers.size(); ++k)
    for (std::size_t n = 0; n < made.patch.layers[k].positions.size(); ++n)
      EXPECT_GT(
          (made.patch.layers[k].positions[n] - made.patch.layers[k - 1].positions[n]).length(), 0);
}

TEST(SplineLayers, FadeToAPlane) {
  const double radius = 2, side = 0.8, up = std::sqrt(4 - 2 * 0.64);
  const PatchOptions options{.scheme = LayerScheme::Spline, .fade = true};
  const Patch patch = mapping::makePatch(makeBall(radius, 0.1), square(side, up), 1, options).patch;
  const auto relief = [](const ParticleLayer& layer) {
    const auto [low, high] =
        std::minmax_element(layer.positions.begin(), layer.positions.end(),
                            [](const V3d& a, const V3d& b) { return a.z < b.z; });
    return high->z - low->z;
  };
  const double first = relief(patch.layers.front());
  EXPECT_GT(first, 0.3);
  EXPECT_LE(relief(patch.layers.back()), support::rounding(8));  // accuracy of the normal
  EXPECT_NEAR(relief(patch.layers[3]), 0.4 * first, support::rounding(2.5));  // w = 0.6
}

TEST(LayerTransform, TwistsTapersAndBends) {
  const NarrowBand ground = makeGround(0);
  for (const LayerScheme scheme :
       {LayerScheme::Reduced, LayerScheme::Conforming, LayerScheme::Spline}) {
    const auto top = [&](const mapping::LayerTransform& transform) {
      // With fixed counts each particle has a counterpart in the other patches.
      const PatchOptions options{
          .layers = 5, .scheme = scheme, .transform = transform, .cells = {12, 12}};
      return mapping::makePatch(ground, square(1), 1, options).patch.layers.back();
    };
    const ParticleLayer plain = top({}), twisted = top({.twist = M_PI / 2}),
                        tapered = top({.taper = 0.5}), bent = top({.bend = 1});
    for (std::size_t n = 0; n < plain.positions.size(); ++n) {
      const V3d p = plain.positions[n];
      EXPECT_LE((twisted.positions[n] - V3d(-p.y, p.x, p.z)).length(),
                support::doubleRounding(2.5));
      EXPECT_LE((tapered.positions[n] - V3d(0.5 * p.x, 0.5 * p.y, p.z)).length(),
                support::doubleRounding(1));
      // The axis is an arc of length 1 and angle 1.
      const V3d expected(1 - std::cos(1.0) + p.x * std::cos(1.0), p.y,
                         std::sin(1.0) - p.x * std::sin(1.0));
      EXPECT_LE((bent.positions[n] - expected).length(), support::measured(5.98e-14));
    }
  }
}

TEST(LayerSchemes, RefuseInvalidOptions) {
  const NarrowBand ground = makeGround(0);
  const auto refused = [&](const PatchOptions& options) {
    try {
      (void)mapping::makePatch(ground, square(1), 1, options);
    } catch (const levelset::UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused({.fade = true}).find("require --particles spline"), std::string::npos);
  EXPECT_NE(refused({.scheme = LayerScheme::Spline, .spline = {V3d(0, 0, 0.5)}}).find("only 0.5"),
            std::string::npos);
  EXPECT_NE(refused({.scheme = LayerScheme::Spline, .spline = {V3d(0)}}).find("two equal points"),
            std::string::npos);
  EXPECT_NE(refused({.scheme = LayerScheme::Spline, .spline = {V3d(std::nan(""))}}).find("finite"),
            std::string::npos);
  EXPECT_NE(refused({.transform = {.taper = 0}}).find("positive scale"), std::string::npos);
  EXPECT_NE(refused({.transform = {.twist = std::nan("")}}).find("twist"), std::string::npos);
}

}  // namespace layer_schemes_test
