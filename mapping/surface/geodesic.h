#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/surface/surface_field.h"

/// Curves on a level φ = height of a base.
namespace mapping {

/// An approximate geodesic from a to b, points about a voxel apart: a path is found by walking
/// towards b on the surface (so it never jumps through the solid to another side), or by A* over
/// grid points near the surface where walking gets stuck or goes astray; then it is straightened by
/// q_i ← Π((q_{i−1} + q_{i+1}) / 2), coarse to fine [Pedersen96; Brodersen07 §8.2].
/// @param a, b  on φ = height
/// @return empty when the surface does not join a and b
[[nodiscard]] std::vector<Imath::V3d> geodesic(const SurfaceField& field, double height,
                                               const Imath::V3d& a, const Imath::V3d& b);

/// The same from a path that is near already: only straightened.
[[nodiscard]] std::vector<Imath::V3d> straighten(const SurfaceField& field, double height,
                                                 std::vector<Imath::V3d> path);

/// Walks `length` straight ahead on φ = height: the direction turns with the tangent plane only.
/// Empty when the surface breaks off on the way.
[[nodiscard]] std::optional<Imath::V3d> walkStraight(const SurfaceField& field, double height,
                                                     const Imath::V3d& from,
                                                     const Imath::V3d& direction, double length);

[[nodiscard]] double pathLength(const std::vector<Imath::V3d>& path);

/// `count` points at equal arc lengths along a path, its ends among them. @pre count ≥ 2
[[nodiscard]] std::vector<Imath::V3d> sampleByArcLength(const std::vector<Imath::V3d>& path,
                                                        std::size_t count);

}  // namespace mapping
