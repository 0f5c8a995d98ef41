#pragma once

#include <Imath/ImathVec.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/surface/surface_field.h"

/// Curves on an iso-surface φ = height of a base.
namespace mapping {

/// Computes the shortest path from a to b, with points about a voxel apart and closer where the
/// surface bends. The first path results from walking towards b on the surface, or from A* over
/// grid points near the surface where walking gets stuck. It is then straightened by q_i ←
/// Π((q_{i−1} + q_{i+1}) / 2), coarse to fine, where Π projects onto φ = height [Pedersen96;
/// Brodersen07 §8.2]. Unless the result is nearly straight in space, other paths that may be
/// shorter are found and straightened too, and the shortest one is returned. No path jumps through
/// the solid to another side if the solid is two voxels thick there. Lengths are within 1 % where
/// radii of curvature exceed 2 voxels and over edges (tests `Geodesic.*`).
/// @param a, b  ends of the path, on φ = height
/// @param longest  upper bound for the length of the path before it is straightened, which may
///         shorten a path by an eighth
/// @return empty if the surface does not connect a and b by a path within `longest`
[[nodiscard]] std::vector<Imath::V3d> geodesic(const SurfaceField& field, double height,
                                               const Imath::V3d& a, const Imath::V3d& b,
                                               double longest = HUGE_VAL);

/// Computes the geodesic from a to b that follows a nearby path, possibly one on another layer. The
/// points of that path are projected and straightened.
/// @return empty if the path cannot be projected onto φ = height, or breaks up into distant points
///         there
[[nodiscard]] std::vector<Imath::V3d> geodesicLike(const SurfaceField& field, double height,
                                                   const Imath::V3d& a, const Imath::V3d& b,
                                                   const std::vector<Imath::V3d>& path);

/// Straightens a path into a geodesic without searching for other paths. The ends stay.
[[nodiscard]] std::vector<Imath::V3d> straighten(const SurfaceField& field, double height,
                                                 std::vector<Imath::V3d> path);

/// End point of a geodesic of the given length and start direction on φ = height, see SurfaceWalk;
/// empty if the surface breaks off on the path.
[[nodiscard]] std::optional<Imath::V3d> walkStraight(const SurfaceField& field, double height,
                                                     const Imath::V3d& from,
                                                     const Imath::V3d& direction, double length);

[[nodiscard]] double pathLength(const std::vector<Imath::V3d>& path);

/// Samples `count` points at equal arc lengths along a path, including its ends.
/// @pre count ≥ 2
[[nodiscard]] std::vector<Imath::V3d> sampleByArcLength(const std::vector<Imath::V3d>& path,
                                                        std::size_t count);

}  // namespace mapping
