#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/distance/surface/interpolant.h"
#include "levelset/distance/surface/sharp_patches.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Closest points of the zero set, one for each grid point with a neighbour of the opposite sign.
/// They are sorted by leaf block in tree order, then by grid point. The points on sharp edges and
/// corners of the solid follow.
struct SurfacePoints {
  std::vector<openvdb::Vec3d> positions;  ///< index space
  /// Grid point of each closest point. Shorter than `positions`: points on edges and corners have
  /// none.
  std::vector<openvdb::Coord> gridPoints;
  /// Derivatives of the interpolant at each point; zero on sharp patches (triangles near edges).
  std::vector<CompactJet> jets;
  /// Nonzero: the point lies on the sharp patches, not on the interpolant.
  std::vector<char> sharp;
  /// Origins of the leaves in which the interpolant beside the zero set reads grid points without a
  /// distance. Call thicken() on the field around them and search again.
  std::vector<openvdb::Coord> thin;
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Finds the surface points in the leaf blocks `within`.
/// At least one of two neighbours of opposite sign must have a distance: two opposite backgrounds
/// do not locate a surface.
[[nodiscard]] SurfacePoints findSurfacePoints(const openvdb::FloatTree& field,
                                              const BlockSelection& within,
                                              const SharpPatches& patches);

/// Returns the field with its band extended by two grid points on each side, by extrapolation along
/// the axes. The extrapolation is parabolic where the field is smooth, else linear.
[[nodiscard]] openvdb::FloatTree::Ptr thicken(const openvdb::FloatTree& field);

/// Returns the field with the bands of some leaves, and of the 26 leaves around each, extended by
/// two grid points. All other values keep their bits, so the end of a band at the cut of a region
/// of interest has no effect far from the cut.
[[nodiscard]] openvdb::FloatTree::Ptr thicken(const openvdb::FloatTree& field,
                                              const std::vector<openvdb::Coord>& leaves);

/// Returns true when two neighbouring grid points differ in sign and one of them has a distance,
/// which means a magnitude below the background.
[[nodiscard]] bool hasZeroCrossing(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
