#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/surface/surface_points.h"

namespace levelset::eikonal {

/// The zero set of a field.
struct ZeroSet {
  openvdb::FloatTree::ConstPtr interpolated;  ///< the field, thickened if its band is too thin
  SharpPatches patches;
  SurfacePoints points;
  /// Grid point of each surface point that has one, in the same order.
  std::vector<openvdb::Coord> gridPoints = {};
};

/// Reads the zero set of a field in the leaf blocks `within`.
/// @param edgesWithin  blocks in which edges and corners are searched; null: nowhere
/// @throws ResourceLimit if there are more than 2^32 surface points
[[nodiscard]] ZeroSet readZeroSet(const openvdb::FloatGrid& field, const BlockSelection& within,
                                  const BlockSelection* edgesWithin, const Progress& progress);

}  // namespace levelset::eikonal
