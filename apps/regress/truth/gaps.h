#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace regress {

/// Grid points at which an answer must have values: those where a known function lies between two
/// values.
struct Region {
  Distance value;
  double low = 0, high = 0;
  double steepest = 1;                                   ///< slope of `value`
  Imath::V3d centre = {};                                ///< centre of a ball that holds the region
  double extent = 0;                                     ///< radius of that ball
  std::function<bool(const Imath::V3d&)> compared = {};  ///< as in Truth
};

/// Share of the region's grid points that are not active in the grid. Missing grid points have no
/// error, so this share is judged apart. 0 where the region has no grid point.
[[nodiscard]] double missingShare(const Region& region, const openvdb::FloatGrid& grid);
[[nodiscard]] double missingShare(const Region& region, const openvdb::Vec3SGrid& grid);

/// Region of the exact band, up to a voxel below its half width, or to half of it below two voxels.
/// At the end of the band, rounding and the error of φ decide which grid points it holds.
[[nodiscard]] Region bandRegion(const Truth& truth, double halfWidth, double voxelSize);

}  // namespace regress
