#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace regress {

/// Grid points at which a result must have values: the points at which the function `value` is
/// between `low` and `high`.
struct Region {
  Distance value;
  double low = 0, high = 0;
  double steepest = 1;     ///< largest slope of `value`
  Imath::V3d centre = {};  ///< centre of a ball that holds the region
  double extent = 0;       ///< radius of that ball
  std::function<bool(const Imath::V3d&)> compared =
      {};  ///< true at points that count; empty: all points count
};

/// Number of grid points of a region, and of those that are not active in a grid.
struct GapCount {
  double wanted = 0, missing = 0;

  void add(const GapCount& other) {
    wanted += other.wanted;
    missing += other.missing;
  }
  /// Returns the share of the missing grid points. NaN, which misses every bound, if the region
  /// contains no grid point: 0 would hide all gaps.
  [[nodiscard]] double share() const;
};

/// Counts the grid points of the region in blocks for which the grid has no leaf.
[[nodiscard]] GapCount countWithoutLeaf(const Region& region, const openvdb::FloatGrid& grid);

/// Returns the share of the region's grid points that are not active in the grid. Grid points
/// without a leaf add nothing to the columns of errors, so the share has its own bound. NaN if the
/// region contains no grid point.
[[nodiscard]] double missingShare(const Region& region, const openvdb::FloatGrid& grid);
[[nodiscard]] double missingShare(const Region& region, const openvdb::Vec3SGrid& grid);

/// Returns the region of the exact band without its ends: distances up to the half width minus a
/// voxel, or up to half the half width if that is below two voxels. At the ends of a band, rounding
/// and the error of φ decide which grid points are active.
[[nodiscard]] Region bandRegion(const Truth& truth, double halfWidth, double voxelSize);

}  // namespace regress
