#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/vdb.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Frame in which distances to a surface in a volume are measured. Positions are in voxels of the
/// result, relative to the grid point `base`, so that integers are grid points.
struct VolumeFrame {
  /// @param halfWidth  width of the band around the volume that must have valid grid indices,
  /// voxels
  /// @throws ResourceLimit
  VolumeFrame(const VolumeGrid& grid, double voxelSize, double halfWidth);

  [[nodiscard]] openvdb::Vec3d place(const openvdb::Vec3d& index) const {
    return origin + index * axes;
  }
  [[nodiscard]] openvdb::Vec3d index(const openvdb::Vec3d& position) const {
    return (position - origin) * toIndex;
  }

  openvdb::Coord base;
  openvdb::Vec3d origin;         ///< position of index 0
  openvdb::Mat3d axes, toIndex;  ///< rows: edges of a cell; inverse
};

}  // namespace levelset
