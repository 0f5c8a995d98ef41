#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/progress.h"

namespace levelset::points {

/// Connectivity of points on a surface.
struct CoconeGraph {
  std::vector<std::size_t> first;  ///< neighbours of point i: ends[first[i]] to ends[first[i+1]−1]
  std::vector<std::uint32_t> ends;  ///< ascending for each point
  std::vector<Imath::V3d> normals;  ///< unit; the sign is arbitrary

  [[nodiscard]] std::span<const std::uint32_t> neighbours(std::size_t point) const {
    return {ends.data() + first[point], first[point + 1] - first[point]};
  }
};

/// Connects the points of a surface [Amenta00, Kalbe11]. The pole of a point is the farthest corner
/// of its Voronoi cell, and its direction the normal. The co-cone of a point is the part of its
/// cell within π/8 of the plane across the normal. Two points are connected if an edge of the
/// Voronoi diagram between their cells meets both co-cones. Long edges that are steep to the
/// surface are left out: they join the borders of two sheets. For points in a plane it is the
/// Delaunay triangulation of the plane.
/// @param positions  finite and different, at least three
/// @throws InvalidInput if all points lie on a line
/// @throws UsageError if this build has no Delaunay triangulation
[[nodiscard]] CoconeGraph coconeGraph(std::span<const Imath::V3d> positions,
                                      std::size_t maxMemory = kNoMemoryLimit,
                                      const Progress& progress = {});

}  // namespace levelset::points
