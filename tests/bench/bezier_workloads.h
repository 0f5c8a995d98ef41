#pragma once

// Workloads and cameras of the benchmarks of Bézier volumes.

#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/teapot.h"

namespace bezier_workloads {

using bezier_scenes::teapot;
using bezier_scenes::V3d;
using render::BezierPicture;
using render::BezierVolume;
using render::Camera;
using render::TreeOptions;

/// CPU seconds of the process, with all of its threads.
inline double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
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
