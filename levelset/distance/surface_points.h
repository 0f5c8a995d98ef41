#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/distance/interpolant.h"
#include "levelset/distance/sharp_patches.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// The closest points of the zero set, one for each grid point that has a neighbour of other sign,
/// sorted by leaf block in tree order, then by grid point; then the points on edges and corners.
struct SurfacePoints {
  std::vector<openvdb::Vec3d> positions;   ///< index space
  std::vector<openvdb::Coord> gridPoints;  ///< whose closest point it is; not of edges and corners
  std::vector<CompactJet> jets;            ///< of the interpolant there; zero where it has none
  std::vector<char> sharp;                 ///< lies on the patches, not on the interpolant
  bool thin = false;  ///< the interpolant saw grid points without a distance: thicken() the field
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Finds them among the leaf blocks that touch `within` (all if empty). A pair of neighbours counts
/// when at least one of them holds a distance: two opposite backgrounds say nothing of a surface.
[[nodiscard]] SurfacePoints findSurfacePoints(const openvdb::FloatTree& field,
                                              const std::optional<openvdb::CoordBBox>& within,
                                              const SharpPatches& patches);

/// The field with two layers more on each side, extrapolated along the axes: by a parabola where
/// the field is smooth, else straight.
[[nodiscard]] openvdb::FloatTree::Ptr thicken(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
