#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace levelset {

/// Triangulates a closed loop of edges with the least sum of areas [Barequet95]. Long sides count a
/// little. Triangles against the mean normal of their vertices are not allowed. Triangles that lean
/// away from the normal of a vertex count many times.
/// @param loop  vertices; the hole lies to the left of each edge
/// @param isUsed  (a, b): a triangle has this directed edge already
/// @param longest  diagonals are no longer
/// @return triangles in counter-clockwise order; empty if there is no triangulation, or for a loop
///         of more than 200 edges
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> fillLoop(
    const std::vector<std::uint32_t>& loop, const std::vector<Imath::V3d>& positions,
    const std::vector<Imath::V3d>& normals,
    const std::function<bool(std::uint32_t, std::uint32_t)>& isUsed, double longest);

}  // namespace levelset
