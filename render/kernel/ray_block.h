#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/shading/surface_shape.h"

namespace render {

/// What the kernel takes for 1 / d: a ray that goes nowhere on an axis meets no plane of it.
inline float rayInverse(float d) {
  return d == 0 ? 1e30f : 1 / d;
}

/// Rays in the space of a BrickPool's table, by number; arrays are a multiple of kLanes long. A ray
/// that starts behind its end meets nothing.
struct RayBlock {
  static constexpr std::size_t kLanes = 16;

  std::size_t size = 0;               ///< of the arrays
  std::vector<float> ox, oy, oz;      ///< where t is 0
  std::vector<float> dx, dy, dz;      ///< by t
  std::vector<float> ix, iy, iz;      ///< rayInverse(d)
  std::vector<float> start, end;      ///< of t
  std::vector<std::int32_t> passing;  ///< how many crossings to pass over

  explicit RayBlock(std::size_t count) : size((count + kLanes - 1) / kLanes * kLanes) {
    for (auto* a : {&ox, &oy, &oz}) a->assign(size, 0);
    for (auto* a : {&dx, &dy, &dz, &ix, &iy, &iz}) a->assign(size, 1);
    start.assign(size, 0);
    end.assign(size, -1);
    passing.assign(size, 0);
  }
};

/// Pixels of a RayFan by number: how far right of and below the picture's middle they are, in
/// pixels. As many as a multiple of RayBlock::kLanes.
struct PixelBlock {
  std::vector<float> x, y;
  std::vector<std::int32_t> passing;  ///< how many crossings to pass over

  explicit PixelBlock(std::size_t count)
      : x((count + RayBlock::kLanes - 1) / RayBlock::kLanes * RayBlock::kLanes),
        y(x.size()),
        passing(x.size()) {}
  [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// What they meet.
struct HitBlock {
  static constexpr std::int32_t kEnters = -1, kLeaves = -2;
  std::vector<std::int32_t> found;  ///< kEnters or kLeaves, or 0
  std::vector<float> t;
  std::vector<std::int32_t> x, y, z;  ///< cell, in the table's space

  explicit HitBlock(std::size_t size) : found(size), t(size), x(size), y(size), z(size) {}
};

/// What the surface is like where they meet it: the parts of the kernel's Shape in their order, per
/// grid point and in the table's axes.
struct ShapeBlock {
  static constexpr std::size_t kParts = 13;
  std::array<std::vector<float>, kParts> part;

  explicit ShapeBlock(std::size_t size) {
    for (std::vector<float>& p : part) p.resize(size);
  }
  [[nodiscard]] SurfaceShape at(std::size_t i) const;
  /// Number i of the other becomes number `to`.
  void take(std::size_t to, const ShapeBlock& from, std::size_t i) {
    for (std::size_t p = 0; p < kParts; ++p) part[p][to] = from.part[p][i];
  }
};

}  // namespace render
