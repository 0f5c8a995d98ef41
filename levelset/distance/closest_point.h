#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/interpolant.h"

namespace levelset::eikonal {

/// Foot point: a point of the zero set and its distance from the query point, in voxels.
struct Foot {
  openvdb::Vec3d point;
  double distance = 0;
  bool converged = false;
  /// The search moved more than two voxels from its start: restart it at `point`, in the block
  /// there.
  bool left = false;
};

/// Finds the point of the interpolant's zero set that is closest to `from`, with Newton's method
/// started at `start`.
/// Solves φ(y) = 0, (from − y) × ∇φ(y) = 0 [Chopp01, Saye14]. Second derivatives keep the
/// convergence quadratic at any distance.
/// Steps are bounded and stay within two voxels of `start`. When the search does not converge, only
/// `left` is meaningful. Positions are in voxels from the block's origin.
[[nodiscard]] Foot closestPoint(const DenseBlock& block, const openvdb::Vec3d& from,
                                const openvdb::Vec3d& start);

/// Finds the closest point in a single Newton step from a point on the zero set, given the
/// derivatives there. `converged` is false when one step does not suffice. Positions may be in any
/// frame.
[[nodiscard]] Foot closestPointByOneStep(const Jet& jet, const openvdb::Vec3d& from,
                                         const openvdb::Vec3d& start);

/// Returns true when the grid points around a point of the zero set change sign. Where values of
/// one sign dip towards zero, an interpolant may cross zero although the field does not.
[[nodiscard]] bool changesSignAround(const DenseBlock& block, const openvdb::Vec3d& point);

}  // namespace levelset::eikonal
