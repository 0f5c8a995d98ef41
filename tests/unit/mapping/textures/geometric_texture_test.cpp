#include "mapping/textures/geometric_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"
#include "tests/support/threads.h"

namespace geometric_texture_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;
using mapping::mapTexture;
using mapping::Patch;
using mapping::TextureMap;
using mapping::TextureMerge;
using mapping::TextureResult;
using support::cap;
using support::makeBall;
using support::square;

double boxDistance(const V3d& p, const V3d& half) {
  const V3d d(std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z);
  const V3d out(std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0));
  return out.length() + std::min(std::max({d.x, d.y, d.z}), 0.0);
}

double torusDistance(const V3d& p, double radius, double tube) {
  return std::hypot(std::hypot(p.x, p.y) - radius, p.z) - tube;
}

NarrowBand makeRing(double radius, double tube, double voxel) {
  const double out = radius + tube;
  return support::sampleBand([=](const V3d& p) { return torusDistance(p, radius, tube); },
                             {V3d(-out, -out, -tube), V3d(out, out, tube)}, voxel);
}

/// A slab of 12 × 12 × 3 whose top is z = 0.
NarrowBand makeSlab(double voxel) {
  return support::sampleBand(
      [](const V3d& p) { return boxDistance(p + V3d(0, 0, 1.5), V3d(6, 6, 1.5)); },
      {V3d(-6, -6, -3), V3d(6, 6, 0)}, voxel);
}

TEST(GeometricTexture, FlatPatchIsTheIdentity) {
  // A torus with a tube of 16 voxels. Its box is mapped onto an equal box on top of a slab.
  const double voxel = 0.0625, tube = 1, radius = 2;
  const NarrowBand base = makeSlab(voxel), ring = makeRing(radius, tube, voxel);
  const Patch patch = mapping::makePatch(base, square(radius + tube), 2 * tube).patch;
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism}) {
    const TextureResult result =
        mapTexture(base, ring, patch, {.merge = TextureMerge::Alone, .map = map, .embedDepth = 0});
    EXPECT_NEAR(result.report.distortion.jacobian.least, 1, support::measured(3.57e-14));
    EXPECT_NEAR(result.report.distortion.stretch.least, 1, support::measured(3.31e-14));
    EXPECT_NEAR(result.report.distortion.stretch.most, 1, support::measured(2.13e-14));
    EXPECT_DOUBLE_EQ(result.report.voxelSize, voxel);

    const V3d center(0, 0, tube);
    double worst = 0;
    support::forEachActive(result.band, [&](const V3d& p, double phi) {
      const double truth = torusDistance(p - center, radius, tube);
      if (std::abs(truth) < 1.5 * voxel) worst = std::max(worst, std::abs(phi - truth));
    });
    EXPECT_LT(worst, support::measured(2.24e-4) * voxel);
    // In the other direction every point of the torus lies on the zero set.
    const levelset::BandSampler sampler(result.band, levelset::Interpolation::Tricubic);
    double missed = 0;
    for (int i = 0; i < 360; ++i)
      for (int j = 0; j < 120; ++j) {
        const double a = i * M_PI / 180, b = j * M_PI / 60, r = radius + tube * std::cos(b);
        const V3d p = center + V3d(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
        missed = std::max(missed, std::abs(sampler.value(p)));
      }
    EXPECT_LT(missed, support::measured(3.14e-4) * voxel);
  }
}

TEST(GeometricTexture, OtherKernelsMapAFlatPatchStraight) {
  const double voxel = 0.125;
  const NarrowBand base = makeSlab(voxel), ring = makeRing(1.2, 0.8, voxel);
  const Patch patch = mapping::makePatch(base, square(2), 1.6).patch;
  using mapping::RbfKernel;
  for (const RbfKernel kernel :
       {RbfKernel::Triharmonic, RbfKernel::ThinPlate, RbfKernel::Gaussian}) {
    const TextureResult result = mapTexture(base, ring, patch,
                                            {.merge = TextureMerge::Alone,
                                             .embedDepth = 0,
                                             .rbf = {.kernel = kernel, .lambdaFar = 0.1}});
    EXPECT_EQ(result.report.solve.directions, 3);
    EXPECT_EQ(result.report.solve.merged + result.report.solve.averaged, 0u);
    EXPECT_GT(result.report.solve.condition, 1);
    EXPECT_LT(result.report.solve.solveResidual, support::measured(1.18e-13));
    double worst = 0;
    support::forEachActive(result.band, [&](const V3d& p, double phi) {
      const double truth = torusDistance(p - V3d(0, 0, 0.8), 1.2, 0.8);
      if (std::abs(truth) < 1.5 * voxel) worst = std::max(worst, std::abs(phi - truth));
    });
    EXPECT_LT(worst, support::measured(0.00528) * voxel) << static_cast<int>(kernel);
  }
}

// The iterative solution, to a tenth of the map's tolerance, gives the same texture.
TEST(GeometricTexture, IterationGivesTheSameTexture) {
  const double voxel = 0.125;
  const NarrowBand base = makeBall(5, voxel), ring = makeRing(2, 1, voxel);
  const Patch patch = mapping::makePatch(base, cap(0.5, 5), 2, {.spacing = 0.3}).patch;
  mapping::TextureOptions options{.merge = TextureMerge::Alone, .mapTolerance = 0.01};
  const TextureResult dense = mapTexture(base, ring, patch, options);
  options.rbf.denseLimit = 500;
  const TextureResult result = mapTexture(base, ring, patch, options);
  EXPECT_FALSE(dense.report.solve.isIterative);
  EXPECT_TRUE(result.report.solve.isIterative);
  EXPECT_GT(result.report.solve.iterations, 2u);
  EXPECT_LE(result.report.solve.solveResidual, 0.1 * 0.01 * voxel / 2);
  const levelset::BandSampler sampler(dense.band);
  double worst = 0;
  support::forEachActive(result.band, [&](const V3d& p, double phi) {
    if (std::abs(phi) < 1.5 * voxel) worst = std::max(worst, std::abs(phi - sampler.value(p)));
  });
  EXPECT_LT(worst, support::measured(8.77e-6) * voxel);
}

TEST(GeometricTexture, PrismMapsExtendBeyondTheTexturesBand) {
  // Particles a voxel apart: one cell around the patch would be narrower than the band.
  const double voxel = 0.125;
  const NarrowBand base = makeSlab(voxel), ring = makeRing(2, 1, voxel);
  const Patch patch = mapping::makePatch(base, square(3), 2, {.spacing = voxel}).patch;
  const TextureResult result = mapTexture(
      base, ring, patch, {.merge = TextureMerge::Alone, .map = TextureMap::Prism, .embedDepth = 0});
  double worst = 0;
  support::forEachActive(result.band, [&](const V3d& p, double phi) {
    const double truth = torusDistance(p - V3d(0, 0, 1), 2, 1);
    if (std::abs(truth) < 1.5 * voxel) worst = std::max(worst, std::abs(phi - truth));
  });
  EXPECT_LT(worst, support::measured(8.73e-4) * voxel);
}

TEST(GeometricTexture, FoldsBesideTheTextureDoNotCount) {
  // Below the texture a prism map extends to the axis of the base. The texture does not.
  for (const double radius : {0.5, 0.75, 1.0}) {
    const NarrowBand rod = support::sampleBand(
        [=](const V3d& p) { return std::max(std::hypot(p.x, p.y) - radius, std::abs(p.z) - 4); },
        {V3d(-radius, -radius, -4), V3d(radius, radius, 4)}, 0.25);
    const Patch patch =
        mapping::makePatch(rod, mapping::cornersAround(rod, V3d(radius, 0, 0), 1, 1), 0.5).patch;
    const TextureResult result = mapTexture(
        rod, makeBall(1, 0.1), patch, {.merge = TextureMerge::Alone, .map = TextureMap::Prism});
    EXPECT_EQ(result.report.distortion.folded, 0u) << radius;
  }
  // The rim of a patch that ends beside an edge does not extend around to the other side of a thin
  // ear.
  const NarrowBand plate =
      support::sampleBand([](const V3d& p) { return boxDistance(p, V3d(10, 10, 0.375)); },
                          {V3d(-10, -10, -0.375), V3d(10, 10, 0.375)}, 0.25);
  const Patch patch =
      mapping::makePatch(plate, support::square(9.3, 0.375), 1.5, {.layers = 3, .spacing = 2})
          .patch;
  const TextureResult result =
      mapTexture(plate, makeRing(4, 1, 0.25), patch, {.merge = TextureMerge::Alone});
  EXPECT_EQ(result.report.distortion.folded, 0u);
}

TEST(GeometricTexture, CylinderCoordinatesAreThoseOfTheCylinder) {
  // u along the arc, v along the axis, w outwards, all within half a per cent of the height.
  const double radius = 2, height = 1, voxel = 0.05, angle = 0.6, half = 0.9;
  const NarrowBand base = support::sampleBand(
      [=](const V3d& p) { return std::max(std::hypot(p.x, p.z) - radius, std::abs(p.y) - 2.5); },
      {V3d(-radius, -2.5, -radius), V3d(radius, 2.5, radius)}, voxel);
  const auto at = [&](double a, double y, double w) {
    const double r = radius + w * height;
    return V3d(r * std::sin(a), y, r * std::cos(a));
  };
  const std::array<V3d, 4> corners = {at(-angle, -half, 0), at(angle, -half, 0), at(angle, half, 0),
                                      at(-angle, half, 0)};
  const Patch sparse = mapping::makePatch(base, corners, height, {.layers = 11}).patch;
  const Patch dense = mapping::makePatch(base, corners, height, {.spacing = 2 * voxel}).patch;
  for (const mapping::ParticleLayer& layer : sparse.layers)
    for (std::size_t n = 0; n < layer.positions.size(); ++n) {
      const auto share = [](std::size_t k, std::size_t count) {
        return 2 * static_cast<double>(k) / static_cast<double>(count - 1) - 1;
      };
      const V3d place = at(angle * share(n % layer.columns, layer.columns),
                           half * share(n / layer.columns, layer.rows), layer.w);
      ASSERT_LE((layer.positions[n] - place).length(), support::measured(2.8e-5) * height);
    }
  const double sink = 0.4;
  const mapping::RbfMap smooth = mapping::patchToTexture(sparse, {}, sink);
  const mapping::PrismMap shell(dense, {.embedDepth = sink, .rim = 0.1});
  for (const mapping::PatchMap* map : {static_cast<const mapping::PatchMap*>(&smooth),
                                       static_cast<const mapping::PatchMap*>(&shell)}) {
    V3d worst(0);
    for (int i = 0; i <= 20; ++i)
      for (int j = 0; j <= 4; ++j)
        for (int k = -4; k <= 10; ++k) {  // below the surface, where a texture is embedded
          const V3d uvw(i / 20.0, j / 4.0, k / 10.0);
          const V3d place =
              at(angle * (2 * uvw.x - 1), half * (2 * uvw.y - 1), uvw.z) * (1 - 1e-12);
          const V3d found = (*map)(place);
          ASSERT_TRUE(std::isfinite(found.length())) << uvw;
          const V3d size(2 * angle * (radius + uvw.z * height), 2 * half, height);
          for (int axis = 0; axis < 3; ++axis)
            worst[axis] = std::max(worst[axis], std::abs(found[axis] - uvw[axis]) * size[axis]);
        }
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LE(worst[axis], support::measured(0.00301) * height)
          << axis << (map == &shell ? " shell" : " rbf");
  }
}

/// @param halfWidth  of the sphere's band; the patch needs distances computed beyond it
void expectRadialCoordinates(double halfWidth) {
  const double radius = 2, height = 1, voxel = 0.1, polar = 0.5;
  const NarrowBand base = makeBall(radius, voxel, halfWidth);
  const Patch patch = mapping::makePatch(base, cap(polar, radius), height).patch;
  const Patch dense =
      mapping::makePatch(base, cap(polar, radius), height, {.spacing = voxel}).patch;
  const double sink = 0.4;
  const mapping::RbfMap smooth = mapping::patchToTexture(patch, {}, sink);
  const mapping::PrismMap shell(dense, {.embedDepth = sink, .rim = 0.1});
  const double corner = std::tan(polar) / std::sqrt(2.0);
  for (const mapping::PatchMap* map : {static_cast<const mapping::PatchMap*>(&smooth),
                                       static_cast<const mapping::PatchMap*>(&shell)}) {
    double worstW = 0, worstU = 0, worstPlane = 0;
    for (int i = -3; i <= 3; ++i)
      for (int j = -3; j <= 3; ++j) {
        const V3d ray = V3d(corner * i / 3, corner * j / 3, 1).normalized();
        const V3d foot = (*map)(ray * radius);
        for (int k = -4; k <= 10; ++k) {
          const double w = 0.1 * k;
          const V3d uvw = (*map)(ray * (radius + w * height));
          ASSERT_TRUE(std::isfinite((uvw - foot).length())) << uvw << foot;
          worstW = std::max(worstW, std::abs(uvw.z - w));
          worstU = std::max({worstU, std::abs(uvw.x - foot.x), std::abs(uvw.y - foot.y)});
          if (i == 0) worstPlane = std::max(worstPlane, std::abs(uvw.x - 0.5));
          if (j == 0) worstPlane = std::max(worstPlane, std::abs(uvw.y - 0.5));
        }
      }
    const char* name = map == &shell ? "shell" : "rbf";
    EXPECT_LE(worstW, support::measured(0.0036, 0.005)) << name;
    EXPECT_LE(worstU, support::measured(0.00247)) << name;
    // Cells are cut into tetrahedra along one of their diagonals, which breaks mirror symmetry.
    EXPECT_LE(worstPlane, map == &shell ? support::measured(0.00249) : support::rounding(12))
        << name;
  }
}

TEST(GeometricTexture, SphereCoordinatesAreRadial) {
  expectRadialCoordinates(3);
  expectRadialCoordinates(16);
}

TEST(GeometricTexture, BendsATorusOntoASphere) {
  const double radius = 2, height = 0.5, voxel = 0.05;
  const NarrowBand base = makeBall(radius, voxel, 3);
  const NarrowBand ring = makeRing(1, 0.25, 0.05);
  const Patch patch = mapping::makePatch(base, cap(0.6, radius), height).patch;
  const TextureResult result = mapTexture(base, ring, patch, {.merge = TextureMerge::Alone});
  // Its lowest point is a voxel deep in the sphere, its top at the height of the patch, all around.
  double low = 10, high = 0;
  support::forEachActive(result.band, [&](const V3d& p, double phi) {
    if (std::abs(phi) > 0.5 * voxel) return;
    // Outwards is downwards at the bottom and upwards at the top.
    low = std::min(low, p.length() + phi);
    high = std::max(high, p.length() - phi);
  });
  EXPECT_NEAR(low, radius - voxel, support::measured(0.00765) * voxel);
  EXPECT_NEAR(high, radius + height - voxel, support::measured(0.0029) * voxel);
  EXPECT_GT(result.report.blocksTested, result.report.blocksEvaluated);
  EXPECT_GT(result.report.distortion.jacobian.least, 0.3);
  EXPECT_GT(result.report.mapResidual, 0);
  EXPECT_LT(result.report.mapResidual, support::measured(0.00878));
}

TEST(GeometricTexture, FillsTheInsideOfTheTexture) {
  // Blocks outside the band may lie completely inside the texture.
  const double voxel = 0.06;
  const NarrowBand base = makeSlab(0.1), ball = makeBall(1, voxel, 3);
  const Patch patch = mapping::makePatch(base, square(2), 4).patch;
  const TextureResult result = mapTexture(
      base, ball, patch, {.merge = TextureMerge::Alone, .embedDepth = 0, .voxelSize = voxel});
  const levelset::BandSampler sampler(result.band);
  for (int n = 0; n <= 40; ++n) {
    EXPECT_LT(sampler.value(V3d(0, 0, 0.1 + 0.095 * n)), 0) << n;
    EXPECT_GT(sampler.value(V3d(0, 0, 4.1 + n)), 0) << n;
  }
}

TEST(GeometricTexture, HonoursTheTextureBox) {
  // A box twice as large in u halves the width of the texture.
  const double voxel = 0.1;
  const NarrowBand base = makeSlab(voxel), ball = makeBall(1, voxel, 3);
  const Patch patch = mapping::makePatch(base, square(2), 2).patch;
  const TextureResult result = mapTexture(base, ball, patch,
                                          {.merge = TextureMerge::Alone,
                                           .embedDepth = 0.5,
                                           .textureBox = Box3d(V3d(-2, -1, -1), V3d(2, 1, 1))});
  const Box3d bounds = result.band.zeroSetBounds();
  EXPECT_NEAR(bounds.min.x, -1, support::measured(4.44e-14) * voxel);
  EXPECT_NEAR(bounds.max.x, 1, support::measured(1.34e-13) * voxel);
  EXPECT_NEAR(bounds.max.y, 2, support::measured(3.11e-14) * voxel);
  EXPECT_NEAR(bounds.min.z, -0.5, support::measured(6.88e-14) * voxel);
  EXPECT_NEAR(bounds.max.z, 1.5, support::measured(1.78e-14) * voxel);
}

TEST(GeometricTexture, MirrorsWhenThePatchDoes) {
  const double voxel = 0.1;
  const NarrowBand base = makeSlab(voxel);
  const NarrowBand ball =
      support::sampleBand([](const V3d& p) { return (p - V3d(0.5, 0, 0)).length() - 0.5; },
                          {V3d(0, -0.5, -0.5), V3d(1, 0.5, 0.5)}, voxel);
  std::array<V3d, 4> corners = square(1);
  std::swap(corners[0], corners[1]);
  std::swap(corners[2], corners[3]);
  const Patch patch = mapping::makePatch(base, corners, 1, {.mirror = true}).patch;
  const TextureResult result = mapTexture(
      base, ball, patch,
      {.merge = TextureMerge::Alone, .textureBox = Box3d(V3d(-1, -0.5, -0.5), V3d(1, 0.5, 0.5))});
  EXPECT_GT(result.report.distortion.jacobian.least, 0.9);
  EXPECT_LT(result.band.zeroSetBounds().max.x, support::doubleRounding(30));
}

TEST(GeometricTexture, RefusesPatchesThatFold) {
  // Above the axis of a trough of radius 1 the sides would cross.
  const NarrowBand trough = support::sampleBand(
      [](const V3d& p) { return std::max(1 - std::hypot(p.y, p.z + 1e-9), -0.5); },
      {V3d(-1, -1, -1), V3d(1, 1, 1)}, 0.05, 30);
  const double y = 0.7, z = -std::sqrt(1 - y * y);
  Patch patch = mapping::makePatch(
                    trough, {V3d(-0.5, -y, z), V3d(0.5, -y, z), V3d(0.5, y, z), V3d(-0.5, y, z)},
                    0.9, {.layers = 4, .spacing = 0.15})
                    .patch;
  // Straight on past the axis, like explicit offsets.
  for (mapping::ParticleLayer& layer : patch.layers)
    for (V3d& p : layer.positions) {
      const double r = std::hypot(p.y, p.z);
      const double wanted = 1 - 1.4 * layer.w;
      p.y *= wanted / r, p.z *= wanted / r;
    }
  const NarrowBand ball = makeBall(1, 0.1, 3);
  const std::string message =
      support::refusal<levelset::InvalidInput>([&] { (void)mapTexture(trough, ball, patch); });
  EXPECT_NE(message.find("the worst at ("), std::string::npos) << message;
  EXPECT_NE(message.find("u, v, w"), std::string::npos) << message;
}

TEST(GeometricTexture, UnionIsOneSolidAndCarvingLeavesAHole) {
  const double voxel = 0.05, radius = 2;
  const NarrowBand base = makeBall(radius, voxel, 3), ring = makeRing(1, 0.25, 0.05);
  const Patch patch =
      mapping::makePatch(base, cap(0.6, radius), 0.5, {.layers = 3, .spacing = 0.15}).patch;
  const levelset::Measurement before = levelset::measure(base);
  const auto measured = [&](const mapping::TextureOptions& options) {
    return levelset::measure(mapTexture(base, ring, patch, options).band);
  };
  // Embedded by 0.2, the ring merges with the ball. Euler's number distinguishes the handle from a
  // separate ring.
  const levelset::Measurement united = measured({.embedDepth = 0.2, .voxelSize = voxel});
  EXPECT_EQ(united.components, 1u);
  EXPECT_EQ(united.surfaces, 1u);
  EXPECT_EQ(united.euler, 2);
  EXPECT_GT(united.volume, before.volume);
  const levelset::Measurement blended =
      measured({.embedDepth = 0.2, .blend = 0.2, .voxelSize = voxel});
  EXPECT_EQ(blended.components, 1u);
  EXPECT_GT(blended.volume, united.volume);
  const levelset::Measurement carved =
      measured({.merge = TextureMerge::Carve, .embedDepth = 0.2, .voxelSize = voxel});
  EXPECT_EQ(carved.components, 1u);
  EXPECT_LT(carved.volume, before.volume);
  // The volumes that carving removes and that the union adds are the two parts of the ring.
  const levelset::Measurement alone =
      measured({.merge = TextureMerge::Alone, .embedDepth = 0.2, .voxelSize = voxel});
  EXPECT_NEAR(united.volume - carved.volume, alone.volume,
              support::measured(0.0103) * alone.volume);
}

TEST(GeometricTexture, EmbeddedTexturesHaveTheVolumeOfTheirShareOfTheOffsetLayer) {
  // A box that fills the unit cube, on a ball: the part of a cone between two radii, up to the
  // sides.
  const double radius = 10, height = 2, voxel = 0.25;
  const NarrowBand base = makeBall(radius, voxel, 3), box = levelset::makeBox(V3d(4), V3d(0), 0.1);
  const Patch patch = mapping::makePatch(base, cap(0.4, radius), height).patch;
  const auto volume = [&](TextureMap map, double sink) {
    const mapping::TextureOptions options = {
        .merge = TextureMerge::Alone, .map = map, .embedDepth = sink, .voxelSize = 0.1};
    return levelset::measure(mapTexture(base, box, patch, options).band).volume;
  };
  const auto cubes = [&](double sink) {
    return std::pow(radius + height - sink, 3) - std::pow(radius - sink, 3);
  };
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism}) {
    const double flush = volume(map, 0);
    for (const double sink : {0.5, 1.5, 2.0})
      EXPECT_NEAR(volume(map, sink) / flush, cubes(sink) / cubes(0), support::measured(4.6e-4))
          << static_cast<int>(map) << " sunk by " << sink;
    // Lifted, without any part of the map below.
    EXPECT_NEAR(volume(map, -1) / flush, cubes(-1) / cubes(0), support::measured(3.97e-4))
        << static_cast<int>(map);
  }
}

TEST(GeometricTexture, CarvedWithoutEmbeddingItLeavesNoSkins) {
  // The texture ends in the base's surface, up to the error of the map.
  const NarrowBand ball = makeBall(8, 0.25, 3), box = levelset::makeBox(V3d(4), V3d(0), 0.1);
  const Patch patch = mapping::makePatch(ball, cap(0.6, 8), 2).patch;
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism}) {
    const TextureResult result =
        mapTexture(ball, box, patch,
                   {.merge = TextureMerge::Carve, .map = map, .embedDepth = 2, .voxelSize = 0.1});
    const levelset::Measurement after = levelset::measure(result.band);
    EXPECT_EQ(after.components, 1u) << static_cast<int>(map);
    const double removed = 4 * std::numbers::pi / 3 * 512 - after.volume;
    const levelset::Measurement alone = levelset::measure(
        mapTexture(ball, box, patch,
                   {.merge = TextureMerge::Alone, .map = map, .embedDepth = 2, .voxelSize = 0.1})
            .band);
    // The skins are a fifth of a voxel thick.
    EXPECT_NEAR(removed, alone.volume, support::measured(0.0103) * alone.volume)
        << static_cast<int>(map);
  }
}

TEST(GeometricTexture, AResultCanBeTheNextBase) {
  // Three layers of recursion: each ball is on the previous one.
  NarrowBand base = makeBall(2, 0.1, 3);
  V3d top(0, 0, 2);
  double volume = levelset::measure(base).volume;
  for (const double size : {1.2, 0.6, 0.3}) {
    const Patch patch =
        mapping::makePatch(base, mapping::cornersAround(base, top, size, size), size).patch;
    base = mapTexture(base, makeBall(1, 0.1), patch, {.embedDepth = 0.1 * size}).band;
    const levelset::Measurement result = levelset::measure(base);
    EXPECT_EQ(result.components, 1u) << size;
    EXPECT_EQ(result.euler, 2) << size;
    // A ball in an offset layer that widens upwards, less the embedded part.
    const double ball = std::numbers::pi / 6 * size * size * size;
    EXPECT_GT(result.volume - volume, 0.9 * ball) << size;
    EXPECT_LT(result.volume - volume, 1.9 * ball) << size;
    volume = result.volume;
    EXPECT_NEAR(result.bounds.max.z, top.z + 0.9 * size, support::measured(0.00107) * size);
    top.z = result.bounds.max.z;
  }
}

TEST(GeometricTexture, SameBitsForAnyNumberOfThreads) {
  const double radius = 2, voxel = 0.1;
  const NarrowBand base = makeBall(radius, voxel, 12), ring = makeRing(1, 0.25, 0.05);
  std::set<std::uint64_t> hashes;
  for (const std::size_t threads : {1, 2, 4, 2}) {
    support::onThreads(threads, [&] {
      const Patch patch =
          mapping::makePatch(base, cap(0.6, radius), 0.5, {.layers = 3, .spacing = 0.2}).patch;
      hashes.insert(
          mapTexture(base, ring, patch, {.merge = TextureMerge::Alone}).band.contentHash());
    });
  }
  EXPECT_EQ(hashes.size(), 1u);
}

TEST(GeometricTexture, RefusesInvalidTexturesAndOptions) {
  const double voxel = 0.1;
  const NarrowBand base = makeSlab(voxel), ball = makeBall(1, voxel, 3);
  const Patch patch = mapping::makePatch(base, square(2), 1, {.layers = 2, .spacing = 0.5}).patch;
  const auto with = [&](const mapping::TextureOptions& options) {
    (void)mapTexture(base, ball, patch, options);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(with({.embedDepth = kNan}), levelset::UsageError);
  EXPECT_THROW(with({.blend = -1}), levelset::UsageError);
  EXPECT_THROW(with({.voxelSize = 0.0}), levelset::UsageError);
  EXPECT_THROW(with({.voxelSize = kNan}), levelset::UsageError);
  EXPECT_THROW(with({.halfWidth = 0.5}), levelset::UsageError);
  EXPECT_THROW(with({.textureBox = Box3d()}), levelset::InvalidInput);
  EXPECT_THROW(with({.textureBox = Box3d(V3d(0), V3d(1, 1, 0))}), levelset::InvalidInput);
  EXPECT_THROW(with({.textureBox = Box3d(V3d(50), V3d(51))}), levelset::InvalidInput);
  EXPECT_THROW(with({.maxMemory = 100000}), levelset::ResourceLimit);
  EXPECT_THROW(with({.voxelSize = 1e-12, .maxMemory = std::size_t{1} << 33}),
               levelset::ResourceLimit);
  EXPECT_THROW(with({.progress = [](double f) { return f < 0.4; }}), levelset::Cancelled);
  EXPECT_THROW((void)mapTexture(NarrowBand(), ball, patch), levelset::InvalidInput);
  EXPECT_THROW((void)mapTexture(base, NarrowBand(), patch), levelset::InvalidInput);
  EXPECT_THROW((void)mapTexture(base, ball, Patch()), levelset::InvalidInput);
  const NarrowBand elsewhere =
      support::sampleBand([](const V3d& p) { return (p - V3d(0, 0, -2)).length() - 1; },
                          {V3d(-1, -1, -3), V3d(1, 1, -1)}, voxel);
  EXPECT_THROW((void)mapTexture(elsewhere, ball, patch), levelset::InvalidInput);
}

}  // namespace geometric_texture_test
