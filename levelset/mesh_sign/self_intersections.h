#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/mesh_sign/mesh_topology.h"
#include "levelset/progress.h"

namespace levelset::convert {

using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

/// Finds the pairs of triangles that meet outside their shared vertices and edges. Each pair
/// appears once, in ascending order of indices. Triangles without area meet nothing. Exact.
[[nodiscard]] std::vector<TrianglePair> findSelfIntersections(
    const std::vector<Triangle>& triangles, const std::vector<Imath::V3d>& positions,
    const Progress& progress);

}  // namespace levelset::convert
