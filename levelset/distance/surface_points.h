#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/distance/interpolant.h"
#include "levelset/distance/sharp_patches.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Closest points of the zero set, one for each grid point with a neighbour of the other sign. They
/// are sorted by leaf block in tree order, then by grid point. Points on edges and corners follow.
struct SurfacePoints {
  std::vector<openvdb::Vec3d> positions;  ///< index space
  std::vector<openvdb::Coord>
      gridPoints;                ///< grid point of each closest point; none for edges and corners
  std::vector<CompactJet> jets;  ///< derivatives of the interpolant at the point; zero on patches
  std::vector<char> sharp;       ///< point lies on the patches, not on the interpolant
  /// The interpolant read grid points without a distance: call thicken() on the field.
  bool thin = false;
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Finds the surface points in the leaf blocks that touch `within` (empty: all). A pair of
/// neighbours counts when at least one holds a distance: two opposite backgrounds do not locate a
/// surface.
[[nodiscard]] SurfacePoints findSurfacePoints(const openvdb::FloatTree& field,
                                              const std::optional<openvdb::CoordBBox>& within,
                                              const SharpPatches& patches);

/// Returns the field with two more layers on each side, extrapolated along the axes. The
/// extrapolation is parabolic where the field is smooth, else linear.
[[nodiscard]] openvdb::FloatTree::Ptr thicken(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
