#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/bands.h"

/// Scenes of soft CSG and of morphs, and their comparison with the judge.
namespace support::fields {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

inline const RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

inline Scene blended(const std::vector<NarrowBand>& bands, const std::string& csg, double softness,
                     int width = 320, int height = 240) {
  Scene scene;
  std::vector<std::string> names;
  for (const NarrowBand& band : bands) {
    names.emplace_back(1, static_cast<char>('a' + names.size()));
    scene.solids.push_back(
        {.band = band,
         .colour = names.size() == 1 ? Imath::C3f(0.6f, 0, 0) : Imath::C3f(0, 0.6f, 0),
         .id = static_cast<std::uint32_t>(names.size()),
         .name = names.back()});
  }
  if (!csg.empty()) scene.csg = CsgExpression(csg, names);
  scene.softness = softness;
  scene.camera = framingCamera(scene.bounds(), width, height);
  return scene;
}

inline Scene morphed(const NarrowBand& a, const NarrowBand& b, double share, int width = 160,
                     int height = 120) {
  Scene scene = blended({a, b}, "", 0, width, height);
  scene.morph = share;
  return scene;
}

/// Ball sampled from a formula, in a wide band.
inline NarrowBand exactBall(const V3d& centre, double radius, double voxel, double halfWidth = 6) {
  const V3d reach(radius + halfWidth * voxel);
  return support::sampleBand([&](const V3d& p) { return (p - centre).length() - radius; },
                             Imath::Box3d(centre - reach, centre + reach), voxel, halfWidth);
}

struct Pixel {
  V3d place, normal;
};

inline std::optional<Pixel> pixelOf(const Image& image, std::size_t i) {
  if (!std::isfinite(image.channels.at("Z")[i])) return std::nullopt;
  const auto read = [&](const char* layer) {
    const auto at = [&](const char* axis) {
      return static_cast<double>(image.channels.at(std::string(layer) + axis)[i]);
    };
    return V3d(at(".X"), at(".Y"), at(".Z"));
  };
  return Pixel{read("P"), read("N")};
}

/// Compares kernel and judge with the bounds of Agreement.*, in voxels of the finest grid.
inline void expectJudged(const Scene& scene, const std::string& what) {
  const Image ours = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
  const ImageComparison found = compareImages(ours, judge);
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
  EXPECT_GT(found.bothHit, found.pixels / 50) << what;
  EXPECT_EQ(found.unlikeElsewhere, 0u) << what;
  EXPECT_LE(static_cast<double>(found.unlikeAtOutline), 1e-5 * static_cast<double>(found.pixels))
      << what;
  double voxel = HUGE_VAL;
  for (const Solid& solid : scene.solids) voxel = std::min(voxel, solid.band.voxelSize());
  std::size_t compared = 0, beyond = 0, turned = 0;
  for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
    const auto a = pixelOf(ours, i), b = pixelOf(judge, i);
    if (!a || !b) continue;
    ++compared;
    // Positions are single precision.
    beyond += (a->place - b->place).length() > 1e-3 * voxel + 1e-6 * a->place.length();
    turned += 2 * std::asin(std::min(1.0, (a->normal - b->normal).length() / 2)) >
              0.1 * std::numbers::pi / 180;
  }
  EXPECT_LE(static_cast<double>(beyond), 1e-4 * static_cast<double>(compared)) << what;
  EXPECT_LE(static_cast<double>(turned), 1e-4 * static_cast<double>(compared)) << what;
}

}  // namespace support::fields
