#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace regress {

/// Where an answer must have values: at the grid points at which a known function lies between two
/// values.
struct Region {
  Distance value;
  double low = 0, high = 0;
  double steepest = 1;                                   ///< slope of `value`
  Imath::V3d centre = {};                                ///< of a ball that holds the region …
  double extent = 0;                                     ///< … and its radius
  std::function<bool(const Imath::V3d&)> compared = {};  ///< as in Truth
};

/// The share of the region's grid points that a grid does not hold as active ones: what is not
/// there has no error. 0 where the region has no grid point.
[[nodiscard]] double missingShare(const Region& region, const openvdb::FloatGrid& grid);
[[nodiscard]] double missingShare(const Region& region, const openvdb::Vec3SGrid& grid);

/// The exact band to a voxel within the end of that of `halfWidth` voxels, half of it where it is
/// narrower than two: at the end itself, rounding and the error of φ decide what is in.
[[nodiscard]] Region bandRegion(const Truth& truth, double halfWidth, double voxelSize);

}  // namespace regress
