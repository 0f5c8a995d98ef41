#pragma once

// Grounds and rays for tests and benchmarks of terrains.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "levelset/terrain/height_field.h"
#include "render/camera.h"
#include "tests/support/quadric_scenes.h"
#include "tests/support/terrains.h"

namespace terrain_rays {

using Imath::V3d;
using quadric_scenes::Numbers;

inline std::shared_ptr<const levelset::HeightField> shared(levelset::HeightField field) {
  return std::make_shared<const levelset::HeightField>(std::move(field));
}

/// Hills with valleys between them, with a height of about a tenth of the width. All samples are
/// known.
inline levelset::HeightField hills(int columns, int rows, double spacing) {
  const double width = (columns - 1) * spacing;
  return support::terrainOf(columns, rows, {spacing, spacing}, [&](double x, double y) {
    const double u = x / width * 20, v = y / width * 20;
    return width * (0.04 * std::sin(u) * std::cos(0.7 * v) + 0.02 * std::sin(1.9 * u + 2.3 * v) +
                    0.004 * std::sin(11 * u) * std::sin(13 * v));
  });
}

/// Rough ground with details of all sizes, as real terrain has them.
inline levelset::HeightField roughGround(int columns, int rows, double spacing) {
  const auto noise = [](int octave, double x, double y) {
    const auto value = [&](double i, double j) {
      auto z =
          static_cast<std::uint64_t>(static_cast<std::int64_t>(i) * 73856093 ^
                                     static_cast<std::int64_t>(j) * 19349663 ^ octave * 83492791);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
      return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    };
    const double i = std::floor(x), j = std::floor(y);
    const auto ease = [](double t) { return t * t * (3 - 2 * t); };
    const double u = ease(x - i), v = ease(y - j);
    return (value(i, j) * (1 - u) + value(i + 1, j) * u) * (1 - v) +
           (value(i, j + 1) * (1 - u) + value(i + 1, j + 1) * u) * v;
  };
  const double width = (columns - 1) * spacing;
  return support::terrainOf(columns, rows, {spacing, spacing}, [&](double x, double y) {
    double height = 0;
    double scale = 4 / width, share = 0.2 * width;
    for (int octave = 0; octave < 12 && scale * spacing < 1; ++octave) {
      height += share * noise(octave, x * scale, y * scale);
      scale *= 2;
      share *= 0.5;
    }
    return height;
  });
}

/// A camera at a share of the half diagonal of a box from its middle.
inline render::Camera cameraAt(const Imath::Box3d& box, const V3d& away, double distance,
                               int size) {
  render::Camera camera;
  camera.to = box.center();
  camera.from = camera.to + away.normalized() * (0.5 * box.size().length() * distance);
  camera.up = {0, 0, 1};
  camera.width = camera.height = size;
  return camera;
}

}  // namespace terrain_rays
