#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/interpolant.h"

namespace levelset::eikonal {

/// A point of the zero set and how far it is, in voxels.
struct Foot {
  openvdb::Vec3d point;
  double distance = 0;
  bool converged = false;
  bool left = false;  ///< the search left the reach of the block at `point`: go on from there
};

/// The point of the interpolant's zero set that is closest to `from`, sought from `start`: Newton's
/// method on φ(y) = 0, (from − y) × ∇φ(y) = 0 [Chopp01, Saye14], with the second derivatives, which
/// keeps it quadratic at any distance. Safeguarded: bounded steps, stays within two voxels of
/// `start`; when it does not converge, only `left` says what to do. Positions are in voxels from
/// the block's origin.
[[nodiscard]] Foot closestPoint(const DenseBlock& block, const openvdb::Vec3d& from,
                                const openvdb::Vec3d& start);

/// The same by one step from a point of the zero set, given the derivatives there; not converged
/// when that is not enough. Positions in any frame.
[[nodiscard]] Foot closestPointByOneStep(const Jet& jet, const openvdb::Vec3d& from,
                                         const openvdb::Vec3d& start);

/// Is there a change of sign among the grid points around a point of the zero set? Where values of
/// one sign dip towards zero, an interpolant may pass it though the field does not.
[[nodiscard]] bool changesSignAround(const DenseBlock& block, const openvdb::Vec3d& point);

}  // namespace levelset::eikonal
