#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/shading/surface_shape.h"

namespace render {

/// The kernel's value of 1 / d for a direction component d. For d = 0 it is so large that the ray
/// meets no plane across the component's axis.
inline float rayInverse(float d) {
  return d == 0 ? 1e30f : 1 / d;
}

/// A batch of rays in the table space of a BrickPool. The lengths of the arrays are multiples of
/// kLanes. A ray with start > end hits nothing.
struct RayBlock {
  static constexpr std::size_t kLanes = 16;

  std::size_t size = 0;               ///< length of the arrays
  std::vector<float> ox, oy, oz;      ///< origin: position at t = 0
  std::vector<float> dx, dy, dz;      ///< direction: derivative of the position by t
  std::vector<float> ix, iy, iz;      ///< rayInverse() of the direction's components
  std::vector<float> start, end;      ///< interval of t that is searched
  std::vector<std::int32_t> passing;  ///< for each ray: number of crossings to skip before the hit

  explicit RayBlock(std::size_t count) : size((count + kLanes - 1) / kLanes * kLanes) {
    for (auto* a : {&ox, &oy, &oz}) a->assign(size, 0);
    for (auto* a : {&dx, &dy, &dz, &ix, &iy, &iz}) a->assign(size, 1);
    start.assign(size, 0);
    end.assign(size, -1);
    passing.assign(size, 0);
  }
};

/// A batch of pixel positions of a RayFan: offsets from the centre of the picture to the right (x)
/// and down (y), in pixels. The length is a multiple of RayBlock::kLanes.
struct PixelBlock {
  std::vector<float> x, y;
  std::vector<std::int32_t> passing;  ///< for each ray: number of crossings to skip before the hit

  explicit PixelBlock(std::size_t count)
      : x((count + RayBlock::kLanes - 1) / RayBlock::kLanes * RayBlock::kLanes),
        y(x.size()),
        passing(x.size()) {}
  [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// Hits of a batch of rays or pixels, one entry for each.
struct HitBlock {
  static constexpr std::int32_t kEnters = -1, kLeaves = -2;
  std::vector<std::int32_t>
      found;             ///< direction of the crossing: kEnters, kLeaves, or 0 for no hit
  std::vector<float> t;  ///< parameter of the ray at the hit
  std::vector<std::int32_t> x, y, z;  ///< cell of the hit, table space

  explicit HitBlock(std::size_t size) : found(size), t(size), x(size), y(size), z(size) {}
};

/// Shape of the surface at the hits: the members of struct Shape in render/shaders/shape.glsl, in
/// their order. Derivatives are per voxel, along the axes of table space.
struct ShapeBlock {
  static constexpr std::size_t kParts = 16;
  std::array<std::vector<float>, kParts> part;

  explicit ShapeBlock(std::size_t size) {
    for (std::vector<float>& p : part) p.resize(size);
  }
  [[nodiscard]] SurfaceShape at(std::size_t i) const;
  /// Gradient of the drawn surface, as in SurfaceShape.
  [[nodiscard]] Imath::V3d drawnGradient(std::size_t i) const { return threeFrom(3, i); }
  /// Position of the hit in its cell, from 0 to 1 on each axis.
  [[nodiscard]] Imath::V3d placeInCell(std::size_t i) const { return threeFrom(13, i); }
  /// Moves the gradients of entry i to a position nearby, by the Hessian.
  /// @param by  difference of the positions, voxels along the axes of table space
  /// @param isDrawn  true: the Hessian is that of the drawn surface, whose gradient moves, too
  void move(std::size_t i, const Imath::V3d& by, bool isDrawn);
  /// Sets numbers of entry i that are too small for single precision (denormal), and negative
  /// zeros, to 0. Some GPUs compute 0 in their place.
  void flush(std::size_t i);
  /// Copies entry i of `from` to entry `to`.
  void take(std::size_t to, const ShapeBlock& from, std::size_t i) {
    for (std::size_t p = 0; p < kParts; ++p) part[p][to] = from.part[p][i];
  }

 private:
  [[nodiscard]] Imath::V3d threeFrom(std::size_t p, std::size_t i) const {
    return {static_cast<double>(part[p][i]), static_cast<double>(part[p + 1][i]),
            static_cast<double>(part[p + 2][i])};
  }
};

}  // namespace render
