#pragma once

// Workloads and cameras of the benchmarks of Bézier volumes.

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "tests/support/bezier_scenes.h"

namespace bezier_workloads {

using bezier_scenes::V3d;
using render::BezierPicture;
using render::BezierVolume;
using render::Camera;
using render::TreeOptions;

/// CPU seconds of the process, with all of its threads.
inline double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// The 32 patches of the teapot in data/models; none if the file is missing.
inline BezierVolume teapot() {
  std::ifstream stream(LEVELSMITH_DATA_DIR "/models/TeapotBufferGeometry.js");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto numbersAfter = [&](const char* name) {
    std::vector<double> numbers;
    const std::size_t begin = text.find(name);
    if (begin == std::string::npos) return numbers;
    const std::size_t end = text.find("];", begin);
    std::string list = text.substr(text.find('[', begin) + 1, end - text.find('[', begin) - 1);
    for (std::size_t at = list.find("/*"); at != std::string::npos; at = list.find("/*"))
      list.erase(at, list.find("*/", at) + 2 - at);
    for (std::size_t at = list.find("- "); at != std::string::npos; at = list.find("- "))
      list.erase(at + 1, 1);
    std::size_t at = 0;
    while (at < list.size()) {
      const char* start = list.c_str() + at;
      char* stop = nullptr;
      const double value = std::strtod(start, &stop);
      if (stop == start) {
        ++at;
        continue;
      }
      numbers.push_back(value);
      at += static_cast<std::size_t>(stop - start);
    }
    return numbers;
  };
  const std::vector<double> patches = numbersAfter("teapotPatches"),
                            vertices = numbersAfter("teapotVertices");
  BezierVolume volume;
  for (std::size_t first = 0; first + 16 <= patches.size(); first += 16) {
    std::vector<V3d> points;
    for (std::size_t n = 0; n < 16; ++n) {
      const auto v = static_cast<std::size_t>(patches[first + n]);
      points.emplace_back(vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]);
    }
    volume.patches.push_back(render::surfacePatch(3, 3, points));
  }
  return volume;
}

struct Timed {
  double seconds;
  BezierPicture picture;
};

inline Timed timed(const BezierVolume& volume, const Camera& camera, const TreeOptions& options) {
  const double start = cpuSeconds();
  BezierPicture picture = castBezier(volume, camera, options);
  return {cpuSeconds() - start, std::move(picture)};
}

// A tree for each ray, and one tree for all.
inline const TreeOptions kBasic{.tile = 1, .sharedLevels = 0};
inline const TreeOptions kShared{};

inline Camera cameraOf(const BezierVolume& volume, int width, int height, double distance) {
  Camera camera;
  const Imath::Box3d box = volume.bounds();
  camera.to = box.center();
  camera.from = camera.to + V3d(1, -1.6, 0.9).normalized() * box.size().length() * distance;
  camera.up = V3d(0, 0, 1);
  camera.width = width;
  camera.height = height;
  return camera;
}

/// Camera that shows the surface on about the published share of the picture.
inline Camera fittedCamera(const BezierVolume& volume, int width, int height, double share) {
  double low = 0.1, high = 3;
  for (int step = 0; step < 12; ++step) {
    const double middle = 0.5 * (low + high);
    const BezierPicture picture = castBezier(volume, cameraOf(volume, 64, 64, middle));
    const double covered = static_cast<double>(picture.roots.size()) / 4096;
    (covered > share ? low : high) = middle;
  }
  return cameraOf(volume, width, height, high);
}

inline double coverOf(const BezierPicture& picture) {
  return 100.0 * static_cast<double>(picture.roots.size()) /
         (static_cast<double>(picture.width) * picture.height);
}

}  // namespace bezier_workloads
