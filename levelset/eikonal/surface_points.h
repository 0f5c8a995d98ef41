#pragma once

// For the .cpp files of levelset/eikonal only.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// The closest points of the zero set, one for each grid point that has a neighbour of other sign.
/// Sorted by leaf block in tree order, then by grid point.
struct SurfacePoints {
  std::vector<openvdb::Vec3d> positions;   ///< index space
  std::vector<openvdb::Coord> gridPoints;  ///< whose closest point it is
  bool thin = false;  ///< the interpolant saw grid points without a distance: thicken() the field
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Finds them among the leaf blocks that touch `within` (all if empty). A pair of neighbours counts
/// when at least one of them holds a distance: two opposite backgrounds say nothing of a surface.
[[nodiscard]] SurfacePoints findSurfacePoints(const openvdb::FloatTree& field,
                                              const std::optional<openvdb::CoordBBox>& within);

/// The field with two layers more on each side, extrapolated linearly along the axes.
[[nodiscard]] openvdb::FloatTree::Ptr thicken(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
