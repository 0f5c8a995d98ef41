#pragma once

#include <Imath/ImathVec.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/surface/surface_field.h"

/// Curves on a layer φ = height of a base.
namespace mapping {

/// The shortest way from a to b, points about a voxel apart and closer where the surface turns: a
/// path is found by walking towards b on the surface, or by A* over grid points near it where
/// walking gets stuck; then it is straightened by q_i ← Π((q_{i−1} + q_{i+1}) / 2), coarse to fine
/// [Pedersen96; Brodersen07 §8.2]. Unless it is next to straight in space, other ways that may come
/// out shorter are searched and straightened too, and the shortest is kept. No path jumps through
/// the solid to another side where that is two voxels thick. Lengths are within 1 % where radii of
/// curvature exceed 2 voxels and over edges (`Geodesic.*`).
/// @param a, b  on φ = height
/// @param longest  of a way that is of use, before it is straightened, which may take off an eighth
/// @return empty when the surface does not join a and b, or by a way longer than that
[[nodiscard]] std::vector<Imath::V3d> geodesic(const SurfaceField& field, double height,
                                               const Imath::V3d& a, const Imath::V3d& b,
                                               double longest = HUGE_VAL);

/// The geodesic from a to b that runs as a path nearby does, perhaps one on another layer: its
/// points are moved over, and straightened.
/// @return empty when the path cannot be moved over without breaking
[[nodiscard]] std::vector<Imath::V3d> geodesicLike(const SurfaceField& field, double height,
                                                   const Imath::V3d& a, const Imath::V3d& b,
                                                   const std::vector<Imath::V3d>& path);

/// The geodesic that a path from end to end slips into: only straightened.
[[nodiscard]] std::vector<Imath::V3d> straighten(const SurfaceField& field, double height,
                                                 std::vector<Imath::V3d> path);

/// Where a walk of `length` straight ahead on φ = height ends, see SurfaceWalk; empty when the
/// surface breaks off on the way.
[[nodiscard]] std::optional<Imath::V3d> walkStraight(const SurfaceField& field, double height,
                                                     const Imath::V3d& from,
                                                     const Imath::V3d& direction, double length);

[[nodiscard]] double pathLength(const std::vector<Imath::V3d>& path);

/// `count` points at equal arc lengths along a path, its ends among them. @pre count ≥ 2
[[nodiscard]] std::vector<Imath::V3d> sampleByArcLength(const std::vector<Imath::V3d>& path,
                                                        std::size_t count);

}  // namespace mapping
