#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/progress.h"

namespace levelset::points {

/// Delaunay tetrahedra of a set of points.
struct Tetrahedra {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  std::vector<std::array<std::uint32_t, 4>> corners;  ///< numbers of points
  /// Tetrahedron opposite each corner; kNone beyond a face of the convex hull.
  std::vector<std::array<std::uint32_t, 4>> neighbours;
};

/// Returns true if this build has the triangulation (CGAL was found).
[[nodiscard]] bool hasDelaunay();

/// Computes the Delaunay tetrahedra. Their order is not specified. There are none if all points lie
/// in a plane.
/// @param positions  finite and different, fewer than 2²⁹
/// @throws UsageError if this build has no triangulation
/// @throws ResourceLimit, Cancelled
[[nodiscard]] Tetrahedra delaunayTetrahedra(std::span<const Imath::V3d> positions,
                                            std::size_t maxMemory = kNoMemoryLimit,
                                            const Progress& progress = {});

}  // namespace levelset::points
