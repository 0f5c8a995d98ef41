// Accuracy of the filters, against closed forms: positions, normals and curvatures on a ball, a
// torus, a cylinder and a quartic, and their convergence. Also compares the kernel with the judge.

#include "render/filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace filter_test {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

RenderOptions optionsOf(Filter filter) {
  return {.samples = 1, .ambientSamples = 0, .shadowSamples = 0, .filter = filter};
}

V3d vectorAt(const Image& image, const std::string& name, std::size_t i) {
  return {image.channels.at(name + ".X")[i], image.channels.at(name + ".Y")[i],
          image.channels.at(name + ".Z")[i]};
}

/// Smallest and largest radius of a drawn ball less its exact radius, in voxels.
struct Shift {
  double least = HUGE_VAL, most = -HUGE_VAL;
  [[nodiscard]] double worst() const { return std::max(-least, most); }
};

Shift shiftOf(double radius, Filter filter) {
  const V3d center(0.3, 0.2, 0.1);
  const Image image = renderCpu(support::sceneOf(levelset::makeSphere(radius, center, 1), 96, 96),
                                optionsOf(filter));
  Shift shift;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    if (!std::isfinite(image.channels.at("Z")[i])) continue;
    const double off = (vectorAt(image, "P", i) - center).length() - radius;
    shift.least = std::min(shift.least, off);
    shift.most = std::max(shift.most, off);
  }
  return shift;
}

TEST(Filters, HaveTheStatedPositionError) {
  // The trilinear interpolant is off by at most an eighth of the second differences. The plain
  // spline is off by a sixth of the Laplacian everywhere. The quasi-interpolating spline is
  // fourth-order accurate.
  for (const double radius : {10.0, 20.0, 40.0}) {
    const Shift linear = shiftOf(radius, Filter::Trilinear);
    EXPECT_LE(linear.worst(), 0.26 / radius) << radius;
    EXPECT_GE(linear.worst(), 0.1 / radius) << radius;
    const Shift plain = shiftOf(radius, Filter::BSpline);
    EXPECT_NEAR(plain.least, -1 / (3 * radius), support::measured(0.00128) / radius) << radius;
    const Shift octahedra = shiftOf(radius, Filter::BccQuadratic);
    EXPECT_NEAR(octahedra.least, -1 / (4 * radius), support::measured(0.0087) / radius) << radius;
    EXPECT_NEAR(octahedra.most, -1 / (4 * radius), support::measured(0.0087) / radius) << radius;
    EXPECT_NEAR(plain.most, -1 / (3 * radius), support::measured(9.84e-4) / radius) << radius;
  }
  // Cubic convolution keeps quadratic functions. The third derivatives of a distance fall with R²,
  // so its error does, too.
  const double cubic = shiftOf(10, Filter::Tricubic).worst();
  EXPECT_LE(cubic, support::measured(5.41e-4));
  EXPECT_GE(cubic / shiftOf(20, Filter::Tricubic).worst(), 3.9);
  const double coarse = shiftOf(10, Filter::BSplineQi).worst();
  EXPECT_LE(coarse, 1e-4);
  EXPECT_GE(coarse / shiftOf(20, Filter::BSplineQi).worst(), 6);  // 8 except for single precision
}

/// Smooth function whose zero set is drawn.
struct Formula {
  std::string name;
  std::function<double(const V3d&)> value;
  std::function<V3d(const V3d&)> normal;
  std::function<double(const V3d&)> mean, gauss;
  V3d half;  ///< half the size of its box
};

/// Mean and Gaussian curvature of f = 0, from the gradient and the diagonal of a diagonal Hessian.
double meanOf(const V3d& g, const V3d& h) {
  const double gHg = g.x * g.x * h.x + g.y * g.y * h.y + g.z * g.z * h.z;
  return (g.length2() * (h.x + h.y + h.z) - gHg) / (2 * std::pow(g.length(), 3));
}
double gaussOf(const V3d& g, const V3d& h) {
  return (g.x * g.x * h.y * h.z + g.y * g.y * h.x * h.z + g.z * g.z * h.x * h.y) /
         (g.length2() * g.length2());
}

std::vector<Formula> formulas() {
  const auto radial = [](const V3d& p) {
    return p.x == 0 && p.y == 0 ? V3d(1, 0, 0) : V3d(p.x, p.y, 0).normalized();
  };
  // Offset from the circle of radius 1.
  const auto ring = [=](const V3d& p) { return p - radial(p); };
  // Goursat's x⁴ + y⁴ + z⁴ = 1, divided by its slope, which is close to a distance.
  const auto g = [](const V3d& p) {
    return V3d(p.x * p.x * p.x, p.y * p.y * p.y, p.z * p.z * p.z) * 4.0;
  };
  const auto h = [](const V3d& p) { return V3d(p.x * p.x, p.y * p.y, p.z * p.z) * 12.0; };
  return {{"ball", [](const V3d& p) { return p.length() - 1; },
           [](const V3d& p) { return p.normalized(); }, [](const V3d&) { return 1.0; },
           [](const V3d&) { return 1.0; }, V3d(1)},
          {"cylinder", [](const V3d& p) { return std::hypot(p.x, p.y) - 0.6; }, radial,
           [](const V3d&) { return 1 / 1.2; }, [](const V3d&) { return 0.0; }, V3d(0.6, 0.6, 0.5)},
          {"torus", [=](const V3d& p) { return ring(p).length() - 0.4; },
           [=](const V3d& p) { return ring(p).normalized(); },
           [=](const V3d& p) {
             const double c = ring(p).normalized().dot(radial(p));
             return (1 + 0.8 * c) / (0.8 * (1 + 0.4 * c));
           },
           [=](const V3d& p) {
             const double c = ring(p).normalized().dot(radial(p));
             return c / (0.4 * (1 + 0.4 * c));
           },
           V3d(1.4, 1.4, 0.4)},
          {"Goursat's quartic",
           [=](const V3d& p) { return (g(p).dot(p) / 4 - 1) / std::max(g(p).length(), 0.5); },
           [=](const V3d& p) { return g(p).normalized(); },
           [=](const V3d& p) { return meanOf(g(p), h(p)); },
           [=](const V3d& p) { return gaussOf(g(p), h(p)); }, V3d(1)}};
}

struct ShapeErrors {
  double normal = 0, mean = 0, gauss = 0;  ///< root mean square errors: radians, world units
};

ShapeErrors errorsOf(const Formula& formula, double voxel, Filter filter) {
  // A band of four voxels. With three, the cut-off affects the fourth digit of the curvature.
  const NarrowBand band =
      support::sampleBand(formula.value, {-formula.half, formula.half}, voxel, 4);
  Scene scene = support::sceneOf(band, 80, 60);
  const Image image = renderEmbree(scene, optionsOf(filter));
  ShapeErrors sum;
  double count = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    if (!std::isfinite(image.channels.at("Z")[i])) continue;
    const V3d p = vectorAt(image, "P", i);
    // The ends of the cylinder lie at the ends of its box.
    if (formula.name == "cylinder" && std::abs(p.z) > 0.3) continue;
    const auto squared = [](double v) { return v * v; };
    sum.normal += (vectorAt(image, "N", i) - formula.normal(p)).length2();
    sum.mean += squared(image.channels.at("curvature.mean")[i] - formula.mean(p));
    sum.gauss += squared(image.channels.at("curvature.gauss")[i] - formula.gauss(p));
    ++count;
  }
  EXPECT_GT(count, 100) << formula.name;
  return {std::sqrt(sum.normal / count), std::sqrt(sum.mean / count), std::sqrt(sum.gauss / count)};
}

TEST(Filters, NormalsAndCurvaturesConverge) {
  for (const Formula& formula : formulas())
    for (const Filter filter : {Filter::Trilinear, Filter::BSplineQi}) {
      const ShapeErrors coarse = errorsOf(formula, 0.1, filter),
                        middle = errorsOf(formula, 0.05, filter),
                        fine = errorsOf(formula, 0.025, filter);
      const auto order = [](double a, double b) { return std::log2(a / b); };
      const std::string what = formula.name + ", " + filterName(filter);
      // At the trilinear interpolant's position the normal differs, also in second order.
      EXPECT_GE(order(coarse.normal, fine.normal) / 2, 1.8) << what;
      EXPECT_GE(order(coarse.mean, middle.mean), 1.5) << what;
      EXPECT_GE(order(middle.mean, fine.mean), 1.5) << what;
      EXPECT_LE(fine.mean, support::measured(4.85e-4)) << what;
      if (formula.name != "cylinder") {
        EXPECT_GE(order(coarse.gauss, fine.gauss) / 2, 1.5) << what;
        EXPECT_LE(fine.gauss, support::measured(7.87e-4)) << what;
      }
    }
}

/// Expects the same bits of the kernel on both processors, and agreement with the judge.
/// @param isAlongLattice  rays run in planes between cells
void expectProven(const Scene& scene, Filter filter, const std::string& what,
                  bool isAlongLattice = false) {
  const RenderOptions options = optionsOf(filter);
  const Image ours = renderCpu(scene, options);
  ImageComparisonOptions allowed;
  // Planes between tetrahedra lie there, too, and the derivatives jump across them. Second
  // derivatives of C¹ splines jump between cells or tetrahedra. Both answers are correct.
  if (isAlongLattice && tetrahedralDegree(filter) > 0)
    allowed.tolerances["N"] = {HUGE_VAL, HUGE_VAL};
  if (isAlongLattice && (tetrahedralDegree(filter) > 0 || filter == Filter::Tricubic ||
                         filter == Filter::BccQuadratic))
    for (const char* layer : {"curvature.mean", "curvature.gauss", "curvature.k1", "curvature.k2"})
      allowed.tolerances[layer] = {HUGE_VAL, HUGE_VAL};
  const ImageComparison judged = compareImages(ours, renderEmbree(scene, options), allowed);
  EXPECT_GT(judged.bothHit, 5u) << filterName(filter) << ", " << what;
  EXPECT_TRUE(judged.agrees()) << filterName(filter) << ", " << what << ": " << judged.reason();
  const ImageComparison bits = compareImages(ours, renderGpu(scene, options), {.exact = true});
  EXPECT_EQ(bits.differentBits, 0u) << filterName(filter) << ", " << what << ": " << bits.reason();
}

TEST(Filters, OfSplinesAgreeWithTheJudge) {
  const NarrowBand sheet = levelset::makeBox(V3d(30, 30, 1.2), V3d(0.1, 0.2, 0.3), 1),
                   needle = levelset::makeCapsule(V3d(-40, 3, 2), V3d(40, 7, 5), 1, 1);
  for (const Filter filter : kFilters) {
    if (filter == Filter::Trilinear) continue;
    for (const auto& [name, band] :
         {std::pair{"rings", support::rings()}, {"sheet", sheet}, {"needle", needle}}) {
      expectProven(support::sceneOf(band), filter, name);
      for (const V3d& from : {V3d(100, 0, 0), V3d(0, 0, -100)})
        expectProven(support::alongTheLattice(band, from), filter, name, true);
    }
    // Faces lie on planes of grid points, some of them between blocks. No ray may slip through
    // where only rounding decides the side. (Rays within such a face have no side.)
    for (const auto& [name, band] : {std::pair{"cube", levelset::makeBox(V3d(32), V3d(0), 1)},
                                     {"plate", support::latticeBox()}}) {
      Scene scene = support::sceneOf(band, 200, 150);
      expectProven(scene, filter, name);
      scene.camera.from = V3d(70, 5, 3);
      expectProven(scene, filter, name);
      scene.camera.orthoHeight = 41.3;
      expectProven(scene, filter, name);
    }
    Scene within = support::sceneOf(support::rings());
    within.camera.from = V3d(24, 0.1, 0.2);
    within.camera.to = V3d(20, 10, 1);
    expectProven(within, filter, "from within");
  }
}

TEST(Filters, OfSplinesNeedTheirBand) {
  const Scene scene = support::sceneOf(levelset::makeSphere(10, V3d(0), 1, {.halfWidth = 2}));
  for (const auto& draw : {renderCpu, renderEmbree}) {
    EXPECT_NO_THROW((void)draw(scene, optionsOf(Filter::Trilinear)));
    EXPECT_THROW((void)draw(scene, optionsOf(Filter::BSpline)), levelset::InvalidInput);
    EXPECT_THROW((void)draw(scene, optionsOf(Filter::BSplineQi)), levelset::InvalidInput);
  }
}

}  // namespace filter_test
