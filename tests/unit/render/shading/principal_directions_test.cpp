// Principal directions, against closed forms on a torus, a cylinder and an ellipsoid, with all
// filters, on solids and volumes.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/shading/style.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"
#include "tests/support/volume_scenes.h"

namespace principal_directions_test {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::NarrowBand;
using namespace render;
using support::measured;

RenderOptions optionsOf(Filter filter) {
  return {
      .samples = 1, .ambientSamples = 0, .shadowSamples = 0, .filter = filter, .directions = true};
}

V3d vectorAt(const Image& image, const std::string& name, std::size_t i) {
  return {image.channels.at(name + ".X")[i], image.channels.at(name + ".Y")[i],
          image.channels.at(name + ".Z")[i]};
}

/// Angle between two lines, radians.
double angleBetween(const V3d& a, const V3d& b) {
  return std::atan2(a.cross(b).length(), std::abs(a.dot(b)));
}

/// Surface with known principal directions.
struct Formula {
  std::string name;
  std::function<double(const V3d&)> distance;  ///< negative inside
  std::function<V3d(const V3d&)> first;        ///< first principal direction, of any length
  V3d half;                                    ///< half the size of its box
};

V3d around(const V3d& p) {
  return {-p.y, p.x, 0};
}

Formula torus() {
  // Offset from the circle of radius 1. The first direction is that of the tube's circles.
  const auto ring = [](const V3d& p) {
    return p - (p.x == 0 && p.y == 0 ? V3d(1, 0, 0) : V3d(p.x, p.y, 0).normalized());
  };
  return {"torus", [=](const V3d& p) { return ring(p).length() - 0.4; },
          [=](const V3d& p) { return ring(p).cross(around(p)); }, V3d(1.4, 1.4, 0.4)};
}

Formula cylinder() {
  return {"cylinder", [](const V3d& p) { return std::hypot(p.x, p.y) - 0.6; }, around,
          V3d(0.6, 0.6, 0.5)};
}

/// The ellipsoid Σ x²/a² = 1, with its value divided by its slope. By Dupin's theorem its principal
/// directions are the normals of the confocal quadrics Σ x²/(a² − λ) = 1.
Formula ellipsoid() {
  const V3d squares(1.2 * 1.2, 0.8 * 0.8, 0.5 * 0.5);
  const auto divided = [=](const V3d& p, double lambda) {
    return V3d(p.x / (squares.x - lambda), p.y / (squares.y - lambda), p.z / (squares.z - lambda));
  };
  const auto confocal = [=](const V3d& p, double low, double high) {
    for (int i = 0; i < 60; ++i) {  // the value grows from −∞ to ∞ between two poles
      const double middle = 0.5 * (low + high);
      (divided(p, middle).dot(p) < 1 ? low : high) = middle;
    }
    return divided(p, low);
  };
  const auto bend = [=](const V3d& d) { return divided(d, 0).dot(d) / d.length2(); };
  return {"ellipsoid",
          [=](const V3d& p) {
            const V3d g = divided(p, 0);
            return (g.dot(p) - 1) / std::max(2 * g.length(), 1.0);
          },
          [=](const V3d& p) {
            const V3d a = confocal(p, squares.z, squares.y), b = confocal(p, squares.y, squares.x);
            return bend(a) > bend(b) ? a : b;
          },
          V3d(1.2, 0.8, 0.5)};
}

/// Root mean square of the angle between the drawn and the exact direction, times k1 − k2.
double errorOf(const Image& image, const Formula& formula) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    if (!std::isfinite(image.channels.at("Z")[i])) continue;
    const V3d p = vectorAt(image, "P", i);
    if (formula.name == "cylinder" && std::abs(p.z) > 0.3) continue;  // its box has ends
    const double angle = angleBetween(vectorAt(image, "direction1", i), formula.first(p)),
                 spread =
                     image.channels.at("curvature.k1")[i] - image.channels.at("curvature.k2")[i];
    sum += angle * angle * spread * spread;
    ++count;
  }
  EXPECT_GT(count, 100u) << formula.name;
  return std::sqrt(sum / static_cast<double>(count));
}

double bandError(const Formula& formula, double voxel, Filter filter) {
  const NarrowBand band =
      support::sampleBand(formula.distance, {-formula.half, formula.half}, voxel, 4);
  Scene scene = support::sceneOf(band, 80, 60);
  scene.camera.up = V3d(0, 1, 0.1);
  return errorOf(renderCpu(scene, optionsOf(filter)), formula);
}

TEST(PrincipalDirections, ConvergeOnATorus) {
  struct Expected {
    Filter filter;
    double order, finest;
  };
  // The second derivatives of the others jump between cells or tetrahedra.
  for (const auto& [filter, order, finest] :
       {Expected{Filter::Trilinear, 2.12, 1.44e-4}, Expected{Filter::Tricubic, 0.9, 0.0197},
        Expected{Filter::BSpline, 2, 7.28e-4}, Expected{Filter::BSplineQi, 2.12, 1.44e-4},
        Expected{Filter::SuperQuadratic, 0.98, 0.0174}, Expected{Filter::CubicC1, 1, 0.0127},
        Expected{Filter::BccQuadratic, 0.99, 0.0312}}) {
    const double coarse = bandError(torus(), 0.1, filter),
                 middle = bandError(torus(), 0.05, filter),
                 fine = bandError(torus(), 0.025, filter);
    EXPECT_GE(std::log2(coarse / middle), support::measuredOrder(order)) << filterName(filter);
    EXPECT_GE(std::log2(middle / fine), support::measuredOrder(order)) << filterName(filter);
    EXPECT_LE(fine, measured(finest)) << filterName(filter);
  }
}

TEST(PrincipalDirections, AreThoseOfACylinderAndAnEllipsoid) {
  for (const auto& [filter, order, error] :
       {std::tuple(Filter::Trilinear, 2.95, 1.01e-3), std::tuple(Filter::BSpline, 1.98, 5.66e-3),
        std::tuple(Filter::BSplineQi, 3.06, 7.9e-4)}) {
    EXPECT_LE(bandError(cylinder(), 0.05, filter), measured(1.78e-5)) << filterName(filter);
    const double coarse = bandError(ellipsoid(), 0.1, filter),
                 fine = bandError(ellipsoid(), 0.05, filter);
    EXPECT_LE(fine, measured(error)) << filterName(filter);
    EXPECT_GE(std::log2(coarse / fine), support::measuredOrder(order)) << filterName(filter);
  }
}

TEST(PrincipalDirections, AreThoseOfSurfacesInVolumesWithShearedAxes) {
  const M44d linear(-0.05, 0.02, 0, 0, 0.01, 0.06, 0, 0, 0.02, -0.01, 0.05, 0, 0, 0, 0, 1);
  const int size = 60;
  struct Expected {
    Filter filter;
    double torus, ellipsoid;
  };
  for (const Formula& formula : {torus(), ellipsoid()})
    for (const Expected& expected :
         {Expected{Filter::Trilinear, 9.37e-4, 1.15e-3}, Expected{Filter::Tricubic, 0.053, 0.0266},
          Expected{Filter::BSpline, 6.52e-3, 6.54e-3},
          Expected{Filter::BSplineQi, 9.32e-4, 9.97e-4},
          Expected{Filter::SuperQuadratic, 0.0421, 0.0525},
          Expected{Filter::CubicC1, 0.0315, 0.0285},
          Expected{Filter::BccQuadratic, 0.0768, 0.116}}) {
      const Filter filter = expected.filter;
      const V3d middle = V3d(0.5 * (size - 1)) * linear;
      const levelset::Volume volume =
          support::sampled({V3i(size), linear * M44d().setTranslation(-middle)},
                           [&](const V3d& p) { return -formula.distance(p); });
      Scene scene;
      scene.solids.push_back(
          {.band = {}, .volume = std::make_shared<const VolumeSurface>(volume, 0.0)});
      scene.camera = framingCamera(scene, 80, 60, scene.camera.verticalFov, V3d(0, 1, 0.1));
      const double figure = formula.name == "torus" ? expected.torus : expected.ellipsoid;
      EXPECT_LE(errorOf(renderCpu(scene, optionsOf(filter)), formula), measured(figure))
          << filterName(filter) << ", " << formula.name;
    }
}

TEST(PrincipalDirections, AreUnitTangentsAtRightAnglesAlsoAtUmbilics) {
  // All points of a ball and of a plane are umbilics.
  for (const NarrowBand& band : {levelset::makeSphere(1, V3d(0), 0.05),
                                 levelset::makeBox(V3d(2, 1, 3), V3d(0), 0.05), support::rings()}) {
    const Image image = renderCpu(support::sceneOf(band, 80, 60), optionsOf(Filter::Trilinear));
    std::size_t hits = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      const V3d a = vectorAt(image, "direction1", i), b = vectorAt(image, "direction2", i),
                n = vectorAt(image, "N", i);
      if (!std::isfinite(image.channels.at("Z")[i])) {
        ASSERT_EQ(a, V3d(0));
        ASSERT_EQ(b, V3d(0));
        continue;
      }
      ++hits;
      ASSERT_NEAR(a.length(), 1, support::rounding(2));
      ASSERT_NEAR(b.length(), 1, support::rounding(2));
      ASSERT_NEAR(a.dot(n), 0, support::rounding(2));
      ASSERT_NEAR(b.dot(n), 0, support::rounding(2));
      ASSERT_NEAR(a.dot(b), 0, support::rounding(2));
      ASSERT_EQ(asLine(a), a);
      ASSERT_EQ(asLine(b), b);
    }
    EXPECT_GT(hits, 1000u);
  }
}

TEST(PrincipalDirections, ChangePlacesInASubtractedSolid) {
  // The wall of a hole bends towards its axis: k1 = 0 along the axis, and k2 < 0 around it.
  Scene scene = support::sceneOf(levelset::makeBox(V3d(3, 3, 1), V3d(0), 0.05), 80, 60);
  scene.solids.push_back(
      {.band = levelset::makeCylinder(1, 4, V3d(0), V3d(0, 0, 1), 0.05), .id = 2});
  scene.csg = CsgExpression("a - b", {"a", "b"});
  for (const auto& draw : {renderCpu, renderEmbree}) {
    const Image image = draw(scene, optionsOf(Filter::Trilinear));
    std::size_t walls = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      if (image.ids.at("id")[i] != 2) continue;
      const V3d p = vectorAt(image, "P", i);
      ++walls;
      EXPECT_LE(angleBetween(vectorAt(image, "direction1", i), V3d(0, 0, 1)), measured(1.05e-6));
      EXPECT_LE(angleBetween(vectorAt(image, "direction2", i), around(p)), measured(4.36e-6));
    }
    EXPECT_GT(walls, 50u);
  }
}

TEST(PrincipalDirections, AgreeWithTheJudgeAndHaveTheSameBitsOnBothProcessors) {
  for (const Filter filter : kFilters) {
    const Scene scene = support::sceneOf(support::rings());
    const Image ours = renderCpu(scene, optionsOf(filter));
    const ImageComparison judged = compareImages(ours, renderEmbree(scene, optionsOf(filter)));
    EXPECT_TRUE(judged.agrees()) << filterName(filter) << ": " << judged.reason();
    EXPECT_TRUE(std::any_of(judged.layers.begin(), judged.layers.end(), [](const auto& layer) {
      return layer.layer == "direction2" && layer.compared > 1000 && layer.largest > 0;
    }));
    EXPECT_EQ(
        compareImages(ours, renderGpu(scene, optionsOf(filter)), {.exact = true}).differentBits, 0u)
        << filterName(filter);
  }
}

TEST(PrincipalDirections, AreThoseOfSoftExpressions) {
  Scene scene = support::sceneOf(levelset::makeCylinder(1, 8, V3d(0), V3d(0, 0, 1), 0.1), 64, 48);
  scene.solids.push_back({.band = levelset::makeSphere(1, V3d(1.2, 0, 0), 0.1), .id = 2});
  scene.csg = CsgExpression("a | b", {"a", "b"});
  scene.softness = 0.25;
  const Image ours = renderCpu(scene, optionsOf(Filter::Trilinear));
  const ImageComparison judged =
      compareImages(ours, renderEmbree(scene, optionsOf(Filter::Trilinear)));
  EXPECT_TRUE(judged.agrees()) << judged.reason();
  std::size_t onCylinder = 0;
  for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
    const V3d p = vectorAt(ours, "P", i);
    if (!std::isfinite(ours.channels.at("Z")[i]) || std::abs(p.z) < 2 || std::abs(p.z) > 3.5)
      continue;
    ++onCylinder;
    EXPECT_LE(angleBetween(vectorAt(ours, "direction2", i), V3d(0, 0, 1)), measured(2e-6));
  }
  EXPECT_GT(onCylinder, 50u);
}

TEST(PrincipalDirections, AreComparedAsLinesAwayFromUmbilics) {
  const Scene scene =
      support::sceneOf(levelset::makeTorus(1, 0.4, V3d(0), V3d(0, 0, 1), 0.05), 64, 48);
  const Image image = renderCpu(scene, optionsOf(Filter::Trilinear));
  const auto differenceOf = [&](const Image& other) {
    const ImageComparison found = compareImages(image, other);
    for (const LayerComparison& layer : found.layers)
      if (layer.layer == "direction1") return std::pair(layer.largest, found.agrees());
    return std::pair(-1.0, false);
  };
  Image negated = image, turned = image, round = image;
  const double angle = 0.01;
  double most = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    const V3d a = vectorAt(image, "direction1", i), b = vectorAt(image, "direction2", i);
    const V3d away = a * std::cos(angle) + b * std::sin(angle);
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name = std::string("direction1.") + "XYZ"[axis];
      negated.channels.at(name)[i] *= -1;
      turned.channels.at(name)[i] = round.channels.at(name)[i] = static_cast<float>(away[axis]);
    }
    const float k1 = image.channels.at("curvature.k1")[i],
                k2 = image.channels.at("curvature.k2")[i];
    most = std::max(most, static_cast<double>(k1 - k2));
    round.channels.at("curvature.k1")[i] = k2;
  }
  EXPECT_EQ(differenceOf(negated), std::pair(0.0, true));
  const auto [largest, agrees] = differenceOf(turned);
  EXPECT_FALSE(agrees);
  EXPECT_NEAR(largest / (angle * most * 0.05), 1, measured(4.63e-8));
  EXPECT_EQ(differenceOf(round).first, 0);  // at an umbilic all directions are equal
}

TEST(PrincipalDirections, HaveColoursWithoutASign) {
  const V3d line = V3d(0.2, -0.7, 0.5).normalized();
  EXPECT_EQ(directionColour(line, 1), directionColour(-line, 1));
  EXPECT_EQ(directionColour(line, 0), directionColour(V3d(1, 0, 0), 0));
  const Imath::C3f x = directionColour(V3d(1, 0, 0), 1), z = directionColour(V3d(0, 0, 1), 1);
  EXPECT_GT(x.x, 10 * x.y);
  EXPECT_GT(z.z, 10 * z.y);
  // The weight depends on the ratio of curvature to range, and not on the sign.
  EXPECT_EQ(directionWeight(2, 2, 1), 0);
  EXPECT_EQ(directionWeight(2, 1.9, 1), 1);
  EXPECT_EQ(directionWeight(2, 1.99, 1), directionWeight(-1.99, -2, 1));
  EXPECT_NEAR(directionWeight(4, 3.92, 4), directionWeight(2, 1.96, 2),
              support::doubleRounding(50));
}

TEST(PrincipalDirections, ColourASolid) {
  // A cylinder along z: the second direction is that of the axis, and blue.
  Scene scene = support::sceneOf(levelset::makeCylinder(1, 8, V3d(0), V3d(0, 0, 1), 0.1), 64, 48);
  scene.camera.from = V3d(9, 0, 0);
  scene.camera.to = V3d(0);
  scene.camera.up = V3d(0, 0, 1);
  scene.camera.orthoHeight = 4;
  for (const int direction : {1, 2}) {
    RenderOptions options = optionsOf(Filter::Trilinear);
    options.style.style = Style::Directions;
    options.style.direction = direction;
    const Image image = renderCpu(scene, options);
    const auto at = [&](const char* channel) { return image.channels.at(channel)[64 * 24 + 32]; };
    EXPECT_GT(at(direction == 1 ? "G" : "B"), 3 * at(direction == 1 ? "B" : "G"));
  }
}

}  // namespace principal_directions_test
