#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/distance/surface/interpolant.h"
#include "levelset/distance/surface/page_array.h"
#include "levelset/distance/surface/sharp_patches.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Closest points of the zero set, one for each grid point with a neighbour of the opposite sign.
/// They are sorted by leaf block in tree order, then by grid point. The points on sharp edges and
/// corners of the solid follow.
struct SurfacePoints {
  PageArray<openvdb::Vec3d> positions;  ///< index space
  /// Derivatives of the interpolant at each point; zero on sharp patches (triangles near edges).
  PageArray<CompactJet> jets;
  /// Nonzero: the point lies on the sharp patches, not on the interpolant.
  PageArray<char> sharp;
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Search for surface points in the leaf blocks `within`, block by block. The number of each point
/// is known before the search.
/// At least one of two neighbours of opposite sign must have a distance: two opposite backgrounds
/// do not locate a surface.
class SurfacePointSearch {
 public:
  /// Counts the points. Keeps references to all parameters.
  SurfacePointSearch(const openvdb::FloatTree& field, const BlockSelection& within,
                     const SharpPatches& patches);

  /// Origins of the leaves in which the interpolant beside the zero set reads grid points without a
  /// distance. Unless empty, call thicken() on the field around them and begin a new search.
  [[nodiscard]] const std::vector<openvdb::Coord>& thin() const { return thin_; }
  /// Number of points that belong to a grid point. Points on edges and corners follow.
  [[nodiscard]] std::size_t countOfGridPoints() const { return first_.back(); }
  /// Number of all points.
  [[nodiscard]] std::size_t size() const { return first_.back() + features_.size(); }
  /// Points on edges and corners.
  [[nodiscard]] const std::vector<openvdb::Vec3d>& features() const { return features_; }
  /// Box of the grid points that have a surface point.
  [[nodiscard]] const openvdb::CoordBBox& bounds() const { return bounds_; }

  /// Number of leaf blocks, in tree order.
  [[nodiscard]] std::size_t blockCount() const { return origins_.size(); }
  [[nodiscard]] const openvdb::Coord& origin(std::size_t block) const { return origins_[block]; }
  /// Number of the first point of a block; that of the block after it ends the block.
  [[nodiscard]] std::size_t first(std::size_t block) const { return first_[block]; }

  /// Returns an array for all points, with those on edges and corners.
  [[nodiscard]] SurfacePoints reserve() const;
  /// Finds the points of some blocks. Returns the grid points of each block.
  [[nodiscard]] std::vector<std::vector<openvdb::Coord>> find(
      const std::vector<std::size_t>& blocks, SurfacePoints& points) const;

 private:
  const openvdb::FloatTree& field_;
  const BlockSelection& within_;
  const SharpPatches& patches_;
  std::vector<openvdb::Coord> origins_, thin_;
  std::vector<std::uint32_t> first_;
  std::vector<openvdb::Vec3d> features_;
  openvdb::CoordBBox bounds_;
};

/// Finds all surface points.
/// @param thin  unless null: SurfacePointSearch::thin(). If not empty, no points are searched.
[[nodiscard]] SurfacePoints findSurfacePoints(const openvdb::FloatTree& field,
                                              const BlockSelection& within,
                                              const SharpPatches& patches,
                                              std::vector<openvdb::Coord>* thin = nullptr,
                                              std::vector<openvdb::Coord>* gridPoints = nullptr);

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
