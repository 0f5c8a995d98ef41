// The published table of interfaces between packed distances, and slices drawn with it.

#include "render/segmented/vertex_diagram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "render/segmented/interface_caster.h"
#include "render/segmented/slab_renderer.h"
#include "tests/support/measured.h"
#include "tests/support/segmented_scenes.h"

namespace vertex_diagram_test {

using Imath::V3d;
using Imath::V3i;
using support::measured;
using namespace render;

TEST(VertexDiagram, HasInterfacesForSixOrderedPairsOfThreeRegions) {
  constexpr double kWidth = 20;
  const VertexDiagram diagram(3, kWidth);
  int pairs = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      int entries = 0;
      for (int u = 0; u < 64; ++u)
        for (int v = 0; v < 64; ++v) {
          const VertexDiagram::Entry& entry = diagram.at(64 * i + u, 64 * j + v);
          if (!entry.isSurface) continue;
          ++entries;
          EXPECT_LT(u + v, kWidth + 1);
          EXPECT_FLOAT_EQ(entry.share + diagram.at(64 * j + v, 64 * i + u).share, 1);
          if (u + v > 0) {
            EXPECT_FLOAT_EQ(entry.share, static_cast<float>(u) / static_cast<float>(u + v));
          }
        }
      const bool isPair = i != j && i < 3 && j < 3;
      EXPECT_EQ(entries, isPair ? 21 * 22 / 2 : 0) << i << ' ' << j;  // u + v ≤ 20
      pairs += entries > 0;
    }
  EXPECT_EQ(pairs, 6);
  EXPECT_EQ(diagram.at(0, 64).share, 0.5f);
}

TEST(VertexDiagram, NeverTakesClampedDistances) {
  const VertexDiagram diagram(4, 200);
  EXPECT_FALSE(diagram.at(63, 64).isSurface);
  EXPECT_FALSE(diagram.at(0, 127).isSurface);
  EXPECT_TRUE(diagram.at(62, 126).isSurface);
}

TEST(VertexDiagram, KeepsPlanesAcrossTheLineOfTheSamples) {
  // Share of the planes that the published test loses by quantisation, for distances up to 2, 4 and
  // 8 voxels.
  const double lost[] = {0.492, 0.746, 0.873};
  int number = 0;
  for (const int voxels : {2, 4, 8}) {
    const double width = 63.0 / voxels;
    const VertexDiagram published(2, width, 0), corrected(2, width, 1);
    constexpr int kPlanes = 20000;
    int losses = 0, left = 0;
    for (int n = 0; n < kPlanes; ++n) {
      const double share = (n + 0.5) / kPlanes;
      const int u = static_cast<int>(std::lround(share * width)),
                v = static_cast<int>(std::lround((1 - share) * width));
      losses += !published.at(u, 64 + v).isSurface;
      left += !corrected.at(u, 64 + v).isSurface;
    }
    EXPECT_NEAR(losses / static_cast<double>(kPlanes), lost[number++], 0.001) << voxels;
    EXPECT_EQ(left, 0) << voxels;
  }
}

TEST(VertexDiagram, RefusesRegionsThatAByteDoesNotHold) {
  const auto pack = [](int region) {
    return packDistances(V3i(2), V3d(0), 1, 4, [&](const V3d&) { return RegionSample{region, 0}; });
  };
  EXPECT_EQ(pack(3).values[0], 192);
  EXPECT_THROW((void)pack(4), levelset::InvalidInput);
  EXPECT_THROW((void)pack(-1), levelset::InvalidInput);
  EXPECT_THROW((void)packDistances(V3i(0), V3d(0), 1, 4, {}), levelset::UsageError);
}

constexpr int kPoints = 65;
constexpr double kSpacing = 2.6 / (kPoints - 1);

/// Packs a partition of the cube [−1.3, 1.3]³.
PackedDistances packed(const std::function<RegionSample(const V3d&)>& sample) {
  return packDistances(V3i(kPoints), V3d(-1.3), kSpacing, 4, sample);
}

/// A ball of region 2 without region 1 between it and the void.
RegionSample ballOfSecondRegion(const V3d& p) {
  return {p.length() < 1 ? 2 : 0, std::abs(p.length() - 1)};
}

Camera viewOf(int pixels) {
  return {.from = {2.6, 1.7, 3.1}, .orthoHeight = 2.4, .width = pixels, .height = pixels};
}

struct Artefacts {
  std::size_t hits = 0, missed = 0, films = 0;
  double median = 0, largest = 0;  // error of depth, voxels
};

/// Compares a picture of ballOfSecondRegion() with the ball, at pixels of which the ray makes at
/// least 30° with it.
Artefacts artefactsOf(const SlabPicture& picture, const Camera& camera) {
  Artefacts found;
  std::vector<double> errors;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
      const double middle = -ray.origin.dot(ray.direction),
                   off = (ray.origin + ray.direction * middle).length();
      if (off > std::sqrt(0.75)) continue;
      const auto n = static_cast<std::size_t>(y * camera.width + x);
      ++found.hits;
      if (picture.front[n] < 0) {
        ++found.missed;
        continue;
      }
      found.films += picture.front[n] == 1 || picture.behind[n] == 1;
      const double exact = middle - std::sqrt(1 - off * off);
      errors.push_back(std::abs(picture.distance[n] - exact) / kSpacing);
    }
  std::sort(errors.begin(), errors.end());
  found.median = errors.empty() ? 0 : errors[errors.size() / 2];
  found.largest = errors.empty() ? 0 : errors.back();
  return found;
}

TEST(SlabRenderer, ShowsAFilmThatDoesNotExistWithLinearFetchOnly) {
  const PackedDistances volume = packed(ballOfSecondRegion);
  const Camera camera = viewOf(48);
  const auto with = [&](SlabFetch fetch, double width) {
    return artefactsOf(renderSlabs(volume, camera, {.slices = 96, .fetch = fetch, .width = width}),
                       camera);
  };
  // Nearest samples are up to √3 voxels farther from each other than the slices.
  const double far = 1 + std::sqrt(3.0) * kSpacing / (4.5 / 95);
  const Artefacts nearest = with(SlabFetch::Nearest, far), linear = with(SlabFetch::Linear, far),
                  aware = with(SlabFetch::LabelAware, 1);
  EXPECT_GT(nearest.hits, 800u);
  EXPECT_EQ(nearest.films, 0u);
  EXPECT_EQ(aware.films, 0u);
  EXPECT_GT(linear.films, 300u);  // 449 of 936
  EXPECT_EQ(aware.missed, 0u);
  EXPECT_LT(aware.median, measured(0.0133));
  EXPECT_LT(aware.largest, measured(0.054));
  EXPECT_LT(nearest.median, measured(0.213, 0.5));
  EXPECT_GT(nearest.median, 10 * aware.median);
}

TEST(SlabRenderer, EndsASheetAtItsRim) {
  // A disc of radius 0.8 in the plane z = 0.01, region 0 above and 1 below.
  const PackedDistances volume = packed([](const V3d& p) {
    const double z = p.z - 0.01, beyond = std::max(0.0, std::hypot(p.x, p.y) - 0.8);
    return RegionSample{z < 0 ? 1 : 0, std::hypot(beyond, z)};
  });
  const Camera camera{.from = {0, 0, 4}, .orthoHeight = 2.4, .width = 64, .height = 64};
  const SlabPicture picture = renderSlabs(volume, camera, {.slices = kPoints});
  // A rim grows by √(w τ / 2), with a tolerance τ of a level and a width w of 63 / 4 levels.
  const double growth = std::sqrt(63.0 / 4 / 2) / (63.0 / 4) * kSpacing;
  std::size_t holes = 0, beyond = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const V3d p = camera.ray(x + 0.5, y + 0.5).origin;
      const double radius = std::hypot(p.x, p.y);
      const bool isHit = picture.front[static_cast<std::size_t>(64 * y + x)] >= 0;
      holes += !isHit && radius < 0.8 - kSpacing;
      beyond += isHit && radius > 0.8 + growth + kSpacing;
      if (isHit) {
        EXPECT_EQ(picture.front[static_cast<std::size_t>(64 * y + x)], 0);
      }
    }
  EXPECT_EQ(holes, 0u);
  EXPECT_EQ(beyond, 0u);
}

TEST(SlabRenderer, SeesTheFieldAsTheExactRaysDo) {
  // A third arm: distances of the segmented field itself, at its grid points.
  const double voxel = 0.05;
  const levelset::SegmentedField field = support::nestedBalls(1, 0.62, voxel);
  const auto sample = [&](const V3d& p) {
    const levelset::SegmentedSampler own(field);
    return RegionSample{own.label(p), own.distance(p)};
  };
  const int half = 24;
  const PackedDistances volume =
      packDistances(V3i(2 * half + 1), V3d(-half * voxel), voxel, field.halfWidth(), sample);
  const InterfaceCaster caster(field);
  const Camera camera = viewOf(40);
  const SlabPicture picture =
      renderSlabs(volume, camera, {.slices = 128, .fetch = SlabFetch::LabelAware});
  std::size_t hits = 0, unlike = 0, relabelled = 0;
  std::vector<double> errors;
  const std::vector<InterfaceRay> rays = support::raysOf(camera);
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const InterfaceHit exact = caster.firstHit(rays[n]);
    unlike += exact.found != (picture.front[n] >= 0);
    if (!exact.found || picture.front[n] < 0) continue;
    ++hits;
    relabelled += exact.behind != picture.behind[n] || exact.front != picture.front[n];
    if (std::abs(exact.facetNormal.dot(rays[n].direction)) > 0.5)
      errors.push_back(std::abs(exact.distance - picture.distance[n]) / voxel);
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_GT(hits, 700u);
  EXPECT_EQ(unlike, 0u);
  EXPECT_EQ(relabelled, 0u);
  EXPECT_LT(errors[errors.size() / 2], measured(0.0042));
  EXPECT_LT(errors.back(), measured(0.0225));
}

TEST(SlabRenderer, RefusesASingleSlice) {
  EXPECT_THROW((void)renderSlabs(packed(ballOfSecondRegion), viewOf(8), {.slices = 1}),
               levelset::UsageError);
}

}  // namespace vertex_diagram_test
