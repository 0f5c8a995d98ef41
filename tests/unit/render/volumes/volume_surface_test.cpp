// Isosurfaces of volumes: the kernel on both processors against the judge and against closed
// forms.

#include "render/volumes/volume_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/isosurface/isosurface.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/grid_extension.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "levelset/volumes/filters/filtered_volume.h"
#include "levelset/volumes/filters/volume_filter.h"
#include "levelset/volumes/synthetic.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_trace.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/measured.h"
#include "tests/support/volume_scenes.h"

namespace volume_surface_test {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::Volume;
using support::measured;
using support::noisyBytes;
using support::obliqueMap;
using support::sampled;
using namespace render;

RenderOptions optionsOf(Filter filter) {
  return {.samples = 1, .ambientSamples = 0, .shadowSamples = 0, .filter = filter};
}

Scene sceneOf(const VolumeSurface& surface, int width = 96, int height = 72) {
  Scene scene;
  scene.solids.push_back({.band = {}, .volume = std::make_shared<const VolumeSurface>(surface)});
  scene.camera = framingCamera(scene, width, height, scene.camera.verticalFov, scene.camera.up);
  return scene;
}

/// Pixels that only one of two pictures shows a surface in, and the largest difference in depth of
/// the others.
struct DepthDifference {
  std::size_t both = 0, onlyOne = 0;
  double most = 0;
};

DepthDifference depthDifference(const Image& a, const Image& b) {
  DepthDifference result;
  const std::vector<float>&za = a.channels.at("Z"), &zb = b.channels.at("Z");
  for (std::size_t i = 0; i < za.size(); ++i) {
    const bool isA = std::isfinite(za[i]), isB = std::isfinite(zb[i]);
    result.onlyOne += isA != isB;
    if (!isA || !isB) continue;
    ++result.both;
    result.most = std::max(result.most, std::abs(static_cast<double>(za[i]) - zb[i]));
  }
  return result;
}

void expectJudged(const Image& ours, const Scene& scene, Filter filter, const std::string& what) {
  const Image judge = renderEmbree(scene, optionsOf(filter));
  // The curvatures of noise are large, and few pixels are compared.
  ImageComparisonOptions allowed;
  for (const char* layer : {"curvature.mean", "curvature.gauss"})
    allowed.tolerances[layer] = {measured(1.65e-4), HUGE_VAL};
  const ImageComparison judged = compareImages(ours, judge, allowed);
  EXPECT_TRUE(judged.agrees()) << filterName(filter) << ", " << what << ": " << judged.reason();
  const DepthDifference depth = depthDifference(ours, judge);
  EXPECT_GT(depth.both, 100u) << filterName(filter) << ", " << what;
  EXPECT_EQ(depth.onlyOne, 0u) << filterName(filter) << ", " << what;
}

TEST(VolumeSurface, KernelAndJudgeAgree) {
  const auto all = support::volumeSurfaces();
  for (std::size_t n = 0; n < all.size(); ++n)
    for (const Filter filter : kFilters) {
      if (isTricubicInCells(filter) && n > 2)
        continue;  // the judge is slow, and the traversal is the same
      const Scene scene = sceneOf(all[n].second, 64, 48);
      expectJudged(renderCpu(scene, optionsOf(filter)), scene, filter, all[n].first);
    }
}

TEST(VolumeSurface, HasTheSameBitsOnBothProcessors) {
  const std::vector<std::pair<std::string, VolumeSurface>> all = support::volumeSurfaces();
  for (std::size_t n = 0; n < 3; ++n)
    for (const Filter filter : kFilters) {
      const Scene scene = sceneOf(all[n].second);
      EXPECT_EQ(compareImages(renderCpu(scene, optionsOf(filter)),
                              renderGpu(scene, optionsOf(filter)), {.exact = true})
                    .differentBits,
                0u)
          << filterName(filter) << ", " << all[n].first;
    }
}

/// Returns true when the mask of a pool marks a cell, given in the index space of the volume.
bool isMarked(const BrickPool& pool, const V3i& cell) {
  const V3i at = cell - V3i(pool.origin[0], pool.origin[1], pool.origin[2]);
  for (int a = 0; a < 3; ++a)
    if (at[a] < 0 || at[a] >= 64 * pool.pages[static_cast<std::size_t>(a)]) return false;
  const int page = ((at.x >> 6) * pool.pages[1] + (at.y >> 6)) * pool.pages[2] + (at.z >> 6);
  const int lists = pool.page[static_cast<std::size_t>(page)];
  if (lists < 0) return false;
  const int slot = (at.x >> 3 & 7) << 6 | (at.y >> 3 & 7) << 3 | (at.z >> 3 & 7);
  const int brick = pool.entry[static_cast<std::size_t>(lists + slot)];
  const int bit = (at.x & 7) << 6 | (at.y & 7) << 3 | (at.z & 7);
  return brick >= 0 &&
         (pool.mask[static_cast<std::size_t>(16 * brick + (bit >> 5))] >> (bit & 31) & 1);
}

template <typename Spline>
void expectMarks(const Spline& spline, Filter filter) {
  const Volume volume = noisyBytes(24);
  const VolumeSurface surface(volume, 100.5);
  const BrickPool pool = makeBricks(surface, {.filter = filter});
  const auto sample = [&](int i, int j, int k) { return 100.5 - volume.at(i, j, k); };
  std::size_t marked = 0;
  for (int x = 1; x < 23; ++x)
    for (int y = 1; y < 23; ++y)
      for (int z = 1; z < 23; ++z) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int t = 0; t < Spline::kTetrahedra; ++t)
          for (const double b : spline.coefficients(sample, {{x, y, z}, t}).coefficients) {
            low = std::min(low, b);
            high = std::max(high, b);
          }
        const double rounding = 2e-5 * 160;
        if (std::min(std::abs(low), std::abs(high)) < rounding) continue;
        marked += isMarked(pool, V3i(x, y, z));
        ASSERT_EQ(isMarked(pool, V3i(x, y, z)), low < 0 && high > 0) << filterName(filter);
      }
  EXPECT_GT(marked, 500u);
}

TEST(VolumeSurface, MarksTheCubesWhoseCoefficientsDifferInSign) {
  expectMarks(levelset::QuadraticSuperSpline(), Filter::SuperQuadratic);
  expectMarks(levelset::CubicC1Spline(), Filter::CubicC1);
}

TEST(VolumeSurface, MarksTheCellsThatTheSurfaceOfTheFilterCrosses) {
  const Volume volume = noisyBytes(20);
  const VolumeSurface surface(volume, 100.5);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0, 1);
  for (const Filter filter : kFilters) {
    const auto named = levelset::volumeFilterNamed(filterName(filter));
    ASSERT_TRUE(named) << filterName(filter);
    const levelset::FilteredVolume interpolant(volume, *named);
    const BrickPool pool = makeBricks(surface, {.filter = filter});
    std::size_t crossed = 0;
    for (int x = 1; x < 18; ++x)
      for (int y = 1; y < 18; ++y)
        for (int z = 1; z < 18; ++z) {
          bool above = false, below = false;
          for (int n = 0; n < 40; ++n) {
            const V3d in(place(random), place(random), place(random));
            const double v = interpolant.value(V3d(x, y, z) + in - V3d(pool.shift()));
            (v > 100.5 ? above : below) = true;
          }
          if (!above || !below) continue;
          ++crossed;
          ASSERT_TRUE(isMarked(pool, V3i(x, y, z))) << filterName(filter);
        }
    EXPECT_GT(crossed, 500u) << filterName(filter);
  }
}

TEST(VolumeSurface, HasTheSameBitsWithAllInstructionSets) {
  const Scene scene = sceneOf({noisyBytes(24), 100.5});
  PixelBlock pixels(96 * 72);
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    pixels.x[n] = static_cast<float>(n % 96) - 47.5f;
    const std::size_t row = n / 96;
    pixels.y[n] = static_cast<float>(row) - 35.5f;
  }
  for (const Filter filter : kFilters) {
    const KernelScene kernel(scene, levelset::kNoMemoryLimit, filter);
    const KernelSolid& solid = kernel.solids().at(0);
    HitBlock first(pixels.size());
    ShapeBlock firstShapes(pixels.size());
    tracePixels(solid.pool, solid.fan, pixels, first, firstShapes, InstructionSet::Sse2);
    std::size_t hits = 0;
    for (const InstructionSet set : instructionSets()) {
      HitBlock other(pixels.size());
      ShapeBlock otherShapes(pixels.size());
      tracePixels(solid.pool, solid.fan, pixels, other, otherShapes, set);
      ASSERT_EQ(other.found, first.found);
      for (std::size_t n = 0; n < pixels.size(); ++n) {
        if (first.found[n] == 0) continue;
        ++hits;
        ASSERT_EQ(other.t[n], first.t[n]);
        for (std::size_t p = 0; p < ShapeBlock::kParts; ++p)
          ASSERT_EQ(otherShapes.part[p][n], firstShapes.part[p][n]);
      }
    }
    EXPECT_GT(hits, 1000u);
  }
}

TEST(VolumeSurface, HasTheDepthOfTheJudgeWithinAHundredThousandthOfAVoxel) {
  // The eye is close, and the voxel is the unit, so that single-precision depths are fine enough.
  // At the outline of the ball, rays graze the surface.
  const auto ball = [](const V3d& p) { return 8 - (p - V3d(12.1, 11.7, 12.3)).length(); };
  Scene scene = sceneOf({sampled({V3i(25), M44d()}, ball), 0}, 140, 140);
  scene.camera.from = V3d(12, 12, 24);
  scene.camera.to = V3d(12);
  scene.camera.up = V3d(0, 1, 0);
  scene.camera.orthoHeight = 16.2;
  for (const Filter filter : kFilters) {
    const DepthDifference found = depthDifference(renderCpu(scene, optionsOf(filter)),
                                                  renderEmbree(scene, optionsOf(filter)));
    EXPECT_EQ(found.onlyOne, 0u);
    EXPECT_GT(found.both, 9000u);
    EXPECT_LE(found.most, measured(1.9e-6, 1e-5)) << filterName(filter);
  }
}

/// Largest distance of the drawn points from a ball of radius 0.6, and largest angle of the normals
/// from the radius.
std::pair<double, double> ballErrors(const Scene& scene, Filter filter) {
  const Image image = renderCpu(scene, optionsOf(filter));
  const auto at = [&](const std::string& name, std::size_t i) {
    return V3d(image.channels.at(name + ".X")[i], image.channels.at(name + ".Y")[i],
               image.channels.at(name + ".Z")[i]);
  };
  double distance = 0, angle = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    if (!std::isfinite(image.channels.at("Z")[i])) continue;
    const V3d p = at("P", i);
    distance = std::max(distance, std::abs(p.length() - 0.6));
    angle = std::max(angle, (at("N", i) - p.normalized()).length());
  }
  return {distance, angle};
}

TEST(VolumeSurface, ConvergesToABall) {
  struct Expected {
    Filter filter;
    double order, angleOrder;
  };
  for (const auto& [filter, order, angleOrder] :
       {Expected{Filter::Trilinear, 2.01, 3.47}, Expected{Filter::Tricubic, 2.69, 2.05},
        Expected{Filter::BSpline, 2.01, 3.1}, Expected{Filter::BSplineQi, 3.85, 3.46},
        Expected{Filter::SuperQuadratic, 2.03, 1.97}, Expected{Filter::CubicC1, 2.02, 1.88},
        Expected{Filter::BccQuadratic, 2.03, 1.87}}) {
    const auto [coarse, coarseAngle] =
        ballErrors(sceneOf({levelset::sphereVolume(21, 0.6), 0}), filter);
    const auto [fine, fineAngle] =
        ballErrors(sceneOf({levelset::sphereVolume(41, 0.6), 0}), filter);
    EXPECT_GE(std::log2(coarse / fine), support::measuredOrder(order)) << filterName(filter);
    EXPECT_GE(std::log2(coarseAngle / fineAngle), support::measuredOrder(angleOrder))
        << filterName(filter);
  }
}

TEST(VolumeSurface, HasNormalsTowardsTheOutsideOnBothSides) {
  // The same surface; solid on the other side. Sheared and mirrored axes.
  const auto ball = [](const V3d& p) { return 0.6 - p.length(); };
  const Volume volume = sampled({V3i(30), obliqueMap()}, ball);
  EXPECT_LE(ballErrors(sceneOf({volume, 0}), Filter::Trilinear).second, measured(0.012));
  const Volume negated = sampled({V3i(30), obliqueMap()}, [&](const V3d& p) { return -ball(p); });
  const Image a = renderCpu(sceneOf({volume, 0}), optionsOf(Filter::Trilinear)),
              b = renderCpu(sceneOf({negated, 0, VolumeInside::Below}),
                            optionsOf(Filter::Trilinear));
  EXPECT_EQ(compareImages(a, b, {.exact = true}).differentBits, 0u);
}

TEST(VolumeSurface, IsTheIsosurfaceOfTheFilteredVolume) {
  const auto all = support::volumeSurfaces();
  for (const std::size_t n : {0u, 2u})
    for (const Filter filter : kFilters) {
      const VolumeSurface& surface = all[n].second;
      const levelset::FilteredVolume interpolant(
          surface.volume(), levelset::volumeFilterNamed(filterName(filter)).value());
      const M44d toIndex = surface.indexToWorld().inverse();
      const Image image = renderCpu(sceneOf(surface, 64, 48), optionsOf(filter));
      std::size_t hits = 0;
      double most = 0;  // distance from the isosurface, grid spacings
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        if (!std::isfinite(image.channels.at("Z")[i])) continue;
        ++hits;
        const V3d p(image.channels.at("P.X")[i], image.channels.at("P.Y")[i],
                    image.channels.at("P.Z")[i]);
        const levelset::VolumeDerivatives at = interpolant.derivatives(p * toIndex);
        most = std::max(most, std::abs(at.value - surface.isovalue()) / at.gradient.length());
      }
      EXPECT_GT(hits, 300u) << filterName(filter);
      EXPECT_LE(most, measured(1.09e-6)) << filterName(filter) << ", " << all[n].first;
    }
}

TEST(VolumeSurface, IsThatOfTheLevelSet) {
  const Volume volume = levelset::marschnerLobb(41);
  const double voxel = 0.05;
  Scene ofVolume = sceneOf({volume, 0.5}, 96, 72);
  // Look at the middle, away from the border, where the level set is closed.
  ofVolume.camera.from = V3d(0.35, 0.3, 0.9);
  ofVolume.camera.to = V3d(0.1, 0.1, 0);
  Scene ofBand = ofVolume;
  ofBand.solids[0].volume = nullptr;
  ofBand.solids[0].band = levelset::isosurface(volume, {.low = 0.5}, {.voxelSize = voxel / 2}).band;
  const Image a = renderCpu(ofVolume, optionsOf(Filter::Trilinear)),
              b = renderCpu(ofBand, optionsOf(Filter::Trilinear));
  const std::vector<float>&za = a.channels.at("Z"), &zb = b.channels.at("Z");
  std::size_t close = 0, all = 0;
  for (std::size_t i = 0; i < za.size(); ++i) {
    if (!std::isfinite(za[i]) && !std::isfinite(zb[i])) continue;
    ++all;
    close += std::abs(za[i] - zb[i]) < static_cast<float>(voxel);
  }
  EXPECT_GT(all, 5000u);
  EXPECT_GE(static_cast<double>(close), 0.99 * static_cast<double>(all));
}

TEST(VolumeSurface, EndsWhereAPlateauBegins) {
  // Values of 1 above the plane z = 10, less below it: with the isovalue 1 nothing is inside, and
  // with less the surface lies below the plateau.
  const Volume volume =
      sampled({V3i(21), M44d()}, [](const V3d& p) { return std::min(p.z / 10, 1.0); });
  EXPECT_TRUE(VolumeSurface(volume, 1).isEmpty());
  const VolumeSurface below(volume, 1, VolumeInside::Below);
  ASSERT_FALSE(below.isEmpty());
  Scene scene = sceneOf(below, 64, 64);
  scene.camera.from = V3d(9.7, 10.2, 40);
  scene.camera.to = V3d(9.7, 10.2, 0);
  scene.camera.up = V3d(0, 1, 0);
  scene.camera.orthoHeight = 8;
  const Image ours = renderCpu(scene, optionsOf(Filter::Trilinear));
  for (const float z : ours.channels.at("Z")) ASSERT_NEAR(z, 30, support::rounding(300));
  EXPECT_EQ(depthDifference(ours, renderEmbree(scene, optionsOf(Filter::Trilinear))).onlyOne, 0u);
}

TEST(VolumeSurface, WithAnIsovalueOutsideTheRangeIsEmpty) {
  const VolumeSurface surface(levelset::sphereVolume(20, 0.6), 5);
  EXPECT_TRUE(surface.isEmpty());
  EXPECT_TRUE(surface.blocks(Filter::Trilinear).empty());
  EXPECT_TRUE(surface.bounds().isEmpty());
  const Scene scene = sceneOf(surface, 32, 24);
  for (const Image& image :
       {renderCpu(scene), renderGpu(scene), renderEmbree(scene, optionsOf(Filter::Trilinear))})
    for (const float z : image.channels.at("Z")) EXPECT_TRUE(std::isinf(z));
  EXPECT_FALSE(surface.withIsovalue(0).isEmpty());
}

TEST(VolumeSurface, LiesBeyondTheSamplesWhereTheFilterDoes) {
  // Between two bright samples the tricubic filter has values up to 9/8.
  const auto kernel = [](double x) {
    const double a = std::abs(x);
    if (a >= 2) return 0.0;
    return a < 1 ? 1 + a * a * (1.5 * a - 2.5) : 2 + a * (-4 + a * (2.5 - 0.5 * a));
  };
  const Volume pair = sampled(
      {V3i(13), M44d()}, [](const V3d& p) { return p == V3d(6) || p == V3d(7, 6, 6) ? 1.0 : 0.0; });
  for (const auto& [isovalue, inside] :
       {std::pair(1.05, VolumeInside::Above), std::pair(-0.05, VolumeInside::Below)}) {
    const VolumeSurface surface(pair, isovalue, inside);
    EXPECT_TRUE(surface.isEmpty());
    EXPECT_TRUE(surface.isEmpty(Filter::Trilinear));
    EXPECT_TRUE(surface.isEmpty(Filter::CubicC1));
    EXPECT_FALSE(surface.isEmpty(Filter::Tricubic));
    Scene scene = sceneOf(surface, 96, 72);
    scene.camera.to = V3d(6.5, 6, 6);
    scene.camera.from = V3d(11, 14, 20);
    scene.camera.orthoHeight = inside == VolumeInside::Above ? 1.5 : 5;
    const Image image = renderCpu(scene, optionsOf(Filter::Tricubic));
    double most = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      if (!std::isfinite(image.channels.at("Z")[i])) continue;
      const V3d p(image.channels.at("P.X")[i], image.channels.at("P.Y")[i],
                  image.channels.at("P.Z")[i]);
      const double value = (kernel(p.x - 6) + kernel(p.x - 7)) * kernel(p.y - 6) * kernel(p.z - 6);
      most = std::max(most, std::abs(value - isovalue));
    }
    EXPECT_LE(most, measured(6.84e-7)) << isovalue;
    expectJudged(image, scene, Filter::Tricubic, "beyond the samples");
    EXPECT_EQ(compareImages(image, renderGpu(scene, optionsOf(Filter::Tricubic)), {.exact = true})
                  .differentBits,
              0u);
  }
}

TEST(VolumeSurface, RefusesWhatHasNoSurface) {
  const Volume volume = levelset::sphereVolume(8, 0.6);
  EXPECT_THROW(VolumeSurface(volume, std::numeric_limits<double>::quiet_NaN()),
               levelset::UsageError);
  EXPECT_THROW((void)VolumeSurface(volume, 0).withIsovalue(HUGE_VAL), levelset::UsageError);
  Scene scene = sceneOf({volume, 0}, 16, 16);
  scene.solids[0].quantization.bits = 8;
  EXPECT_THROW(renderCpu(scene), levelset::UsageError);
  // A grid with one layer of points has no cells.
  const VolumeSurface flat(sampled({V3i(9, 9, 1), M44d()}, [](const V3d& p) { return p.x - 4; }),
                           0.5);
  EXPECT_TRUE(flat.blocks(Filter::BSplineQi).empty());
  const Image image = renderCpu(sceneOf(flat, 16, 16));
  for (const float z : image.channels.at("Z")) EXPECT_TRUE(std::isinf(z));
}

TEST(VolumeSurface, CopiesTheExtendedField) {
  const Volume volume = noisyBytes(11);
  const VolumeSurface surface(volume, 90.5);
  const levelset::ExtendedGrid grid([&](int i, int j, int k) { return volume.at(i, j, k); },
                                    {11, 11, 11}, levelset::GridExtension::Quadratic);
  const V3i low(-4, 5, -2), size(9, 10, 40);
  std::vector<float> copied(9 * 10 * 40);
  surface.copyField(low, size, copied.data());
  std::size_t n = 0;
  const auto isNear = [](int i) { return i >= -2 && i < 13; };
  for (int x = low.x; x < low.x + size.x; ++x)
    for (int y = low.y; y < low.y + size.y; ++y)
      for (int z = low.z; z < low.z + size.z; ++z)
        ASSERT_EQ(copied[n++],
                  isNear(x) && isNear(y) && isNear(z) ? surface.field(grid(x, y, z)) : 0);
}

}  // namespace volume_surface_test
