#include "render/segmented/slab_renderer.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::V3d;

/// A value between grid points: region index, and distance in levels.
struct Fetched {
  int region = 0;
  double levels = 0;
  bool isFar = false;  // the distance is clamped
  int packed = 0;      // as a byte
};

/// The eight grid points around a position in index space.
struct Taps {
  std::array<int, 8> values;
  std::array<double, 8> weights;

  Taps(const PackedDistances& packed, const V3d& p) {
    const V3d low(std::floor(p.x), std::floor(p.y), std::floor(p.z)), s = p - low;
    for (int c = 0; c < 8; ++c) {
      const auto n = static_cast<std::size_t>(c);
      values[n] =
          packed.at(static_cast<int>(low.x) + (c >> 2), static_cast<int>(low.y) + (c >> 1 & 1),
                    static_cast<int>(low.z) + (c & 1));
      weights[n] = (c & 4 ? s.x : 1 - s.x) * (c & 2 ? s.y : 1 - s.y) * (c & 1 ? s.z : 1 - s.z);
    }
  }
};

Fetched unpacked(int value) {
  const int levels = PackedDistances::levelsOf(value);
  return {PackedDistances::regionOf(value), static_cast<double>(levels),
          levels >= PackedDistances::kFarthest, value};
}

Fetched fetchNearest(const PackedDistances& packed, const V3d& p) {
  return unpacked(packed.at(static_cast<int>(std::floor(p.x + 0.5)),
                            static_cast<int>(std::floor(p.y + 0.5)),
                            static_cast<int>(std::floor(p.z + 0.5))));
}

Fetched fetchLinear(const PackedDistances& packed, const V3d& p) {
  const Taps taps(packed, p);
  double sum = 0;
  for (std::size_t c = 0; c < 8; ++c) sum += taps.weights[c] * taps.values[c];
  return unpacked(static_cast<int>(std::floor(sum + 0.5)));
}

Fetched fetchLabelAware(const PackedDistances& packed, const V3d& p) {
  const Taps taps(packed, p);
  std::array<double, PackedDistances::kMostRegions> depths{};
  for (std::size_t c = 0; c < 8; ++c) {
    const int region = PackedDistances::regionOf(taps.values[c]);
    const double levels = PackedDistances::levelsOf(taps.values[c]);
    for (int r = 0; r < PackedDistances::kMostRegions; ++r)
      depths[static_cast<std::size_t>(r)] += taps.weights[c] * (r == region ? levels : -levels);
  }
  const auto best = std::max_element(depths.begin(), depths.end());
  Fetched found;
  found.region = static_cast<int>(best - depths.begin());
  found.levels = std::max(*best, 0.0);
  found.isFar = found.levels >= PackedDistances::kFarthest - 0.5;
  return found;
}

}  // namespace

SlabPicture renderSlabs(const PackedDistances& packed, const Camera& camera,
                        const SlabOptions& options) {
  validate(camera);
  if (options.slices < 2)
    throw levelset::UsageError(
        fmt::format("{} slices have no slab between them; give at least 2", options.slices));
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  SlabPicture picture{camera.width, camera.height, {}, {}, {}};
  picture.distance.assign(pixels, std::numeric_limits<double>::infinity());
  picture.front.assign(pixels, -1);
  picture.behind.assign(pixels, -1);

  // Slices between the nearest and the farthest corner of the volume, in front of the eye.
  const V3d axis = camera.axis(), extent = V3d(packed.size - Imath::V3i(1)) * packed.spacing;
  double nearest = 1e300, farthest = -1e300;
  for (int c = 0; c < 8; ++c) {
    const V3d corner = packed.origin + V3d(c >> 2, c >> 1 & 1, c & 1) * extent;
    const double depth = (corner - camera.from).dot(axis);
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  nearest = std::max(nearest, camera.near);
  const double step = (farthest - nearest) / (options.slices - 1);
  const CameraRays rays(camera);
  const V3d last = V3d(packed.size - Imath::V3i(1));
  // The diagram is that of the middle ray. Its neighbours in a perspective view have longer steps.
  const double middleWidth = options.width * step * packed.levelsPerLength;
  const VertexDiagram diagram(PackedDistances::kMostRegions, middleWidth, options.tolerance);

  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto n = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                     static_cast<std::size_t>(x);
      const Camera::Ray ray = rays.at(x + 0.5, y + 0.5);
      const double perDepth = 1 / ray.direction.dot(axis);
      const auto distanceOf = [&](int slice) {
        const double depth = nearest + step * slice - (ray.origin - camera.from).dot(axis);
        return depth * perDepth;
      };
      const auto fetch = [&](int slice, bool& isInside) {
        const V3d p =
            (ray.origin + ray.direction * distanceOf(slice) - packed.origin) / packed.spacing;
        isInside =
            p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= last.x && p.y <= last.y && p.z <= last.z;
        if (!isInside) return Fetched{};
        return options.fetch == SlabFetch::Nearest  ? fetchNearest(packed, p)
               : options.fetch == SlabFetch::Linear ? fetchLinear(packed, p)
                                                    : fetchLabelAware(packed, p);
      };
      bool isBehindInside = false;
      Fetched behind = fetch(options.slices - 1, isBehindInside);
      for (int k = options.slices - 2; k >= 0; --k) {
        bool isFrontInside = false;
        const Fetched front = fetch(k, isFrontInside);
        VertexDiagram::Entry entry;
        if (isFrontInside && isBehindInside) {
          if (options.fetch != SlabFetch::LabelAware)
            entry = diagram.at(front.packed, behind.packed);
          else if (front.region != behind.region && !front.isFar && !behind.isFar)
            entry = VertexDiagram::entryOf(front.levels, behind.levels, middleWidth * perDepth,
                                           options.tolerance);
        }
        if (entry.isSurface) {
          const double a = distanceOf(k), b = distanceOf(k + 1);
          picture.distance[n] = a + (b - a) * static_cast<double>(entry.share);
          picture.front[n] = static_cast<std::int8_t>(front.region);
          picture.behind[n] = static_cast<std::int8_t>(behind.region);
        }
        behind = front;
        isBehindInside = isFrontInside;
      }
    }
  });
  return picture;
}

}  // namespace render
