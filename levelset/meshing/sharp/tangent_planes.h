#pragma once

// Tangent planes of the surface, estimated from the field values at grid points. Internal header of
// levelset: public headers must not include it.

#include <Eigen/Dense>
#include <vector>

#include "levelset/vdb.h"

namespace levelset {

/// Second difference, in voxels, up to which the field counts as smooth at a grid point. An edge
/// has a larger one at a corner of each cell that it crosses.
inline constexpr double kSmoothBend = 0.15;
/// Up to this second difference, voxels, central differences alone give the tangent plane of a grid
/// point. Above it, the values of one of its eight cells may give a better plane beside an edge.
inline constexpr double kSurelySmooth = 0.02;

/// Tangent plane of the surface, estimated at one grid point.
struct TangentPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d gradient =
      Eigen::Vector3d::Zero();  ///< gradient of the field, by central differences
  double distance = 0;          ///< distance of the grid point from the plane, voxels
  double error = 0;             ///< deviation of the neighbouring values from the plane, voxels
  /// Bend of the field at the grid point, voxels: the largest second difference along an axis, or
  /// the sum of all three if it is larger. The sum is invariant under rotation.
  double bend = 0;
  bool isSmooth = false;
  bool isKnown = false;  ///< false: no plane could be estimated
};

/// Field values, in voxels, of a block and its surroundings: one grid point more on the low side of
/// each axis than there are planes, and one more on the high side. Also estimates the tangent
/// planes from them.
class TangentPlanes {
 public:
  /// @param margin  number of grid points around the cells of the block that have a plane, too
  TangentPlanes(const openvdb::FloatGrid& grid, const openvdb::Coord& origin, int margin = 0);

  [[nodiscard]] double value(int x, int y, int z) const {
    const int before = 1 + margin_, side = kSide + 2 * before;
    return values_[static_cast<std::size_t>(((x + before) * side + y + before) * side + z +
                                            before)];
  }
  /// Interpolates the field trilinearly, at a point of the block or at most one voxel outside it.
  [[nodiscard]] double interpolated(const Eigen::Vector3d& p) const;
  /// Interpolates the field trilinearly, corrected by second differences: third order on a smooth
  /// field. The coordinates of `p` lie in [0, 8].
  [[nodiscard]] double curved(const Eigen::Vector3d& p) const;
  /// Returns the plane of a grid point, with each coordinate in [−margin, 8 + margin].
  [[nodiscard]] const TangentPlane& plane(int x, int y, int z);

 private:
  static constexpr int kSide = 9;  ///< grid points of the block's cells along an axis

  [[nodiscard]] TangentPlane makePlane(int x, int y, int z) const;
  void chooseOctant(int x, int y, int z, double limit, TangentPlane& plane) const;

  int margin_;
  std::vector<double> values_;
  std::vector<TangentPlane> planes_;
  std::vector<bool> made_;
};

}  // namespace levelset
