#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/distance/surface/interpolant.h"

namespace levelset::eikonal {

/// Foot point: the closest point of the zero set to a query point.
struct Foot {
  openvdb::Vec3d point;
  double distance = 0;  ///< distance of `point` from the query point, voxels
  bool converged = false;
  /// The search stopped because it moved more than two voxels from its start. Restart it at
  /// `point`, with the DenseBlock around that point.
  bool left = false;
};

/// Finds the point of the interpolant's zero set that is closest to `from`, with Newton's method
/// started at `start`. Solves φ(y) = 0, (from − y) × ∇φ(y) = 0 [Chopp01, Saye14]. Second
/// derivatives keep the convergence quadratic at any distance. Steps are bounded and stay within
/// two voxels of `start`. When the search does not converge, only `left` is valid, and `point` if
/// `left` is true. Positions are in voxels from the block's origin.
[[nodiscard]] Foot closestPoint(const DenseBlock& block, const openvdb::Vec3d& from,
                                const openvdb::Vec3d& start);

/// Query point and start of a search, in voxels from the block's origin.
struct FootSearch {
  openvdb::Vec3d from, start;
};

/// Finds the closest points for several searches on one block, with the same bits as closestPoint()
/// in less time. Resizes `feet`.
void closestPoints(const DenseBlock& block, const std::vector<FootSearch>& searches,
                   std::vector<Foot>& feet);

/// Finds the closest point in a single Newton step from a point on the zero set, given the
/// derivatives there. `converged` is false when the step is longer than `longest`, voxels. The
/// error is of third order in the length of the step.
[[nodiscard]] Foot closestPointByOneStep(const Jet& jet, const openvdb::Vec3d& from,
                                         const openvdb::Vec3d& start, double longest);

/// Search from a point on the zero set, with the derivatives there. Positions are in index space.
struct JetSearch {
  openvdb::Vec3d from, start;
  const CompactJet* jet;
};

/// Finds closest points in at most two Newton steps each. The second step keeps the second
/// derivatives of the first, so it only reads value and gradient. The error is at most 2e-5 voxel
/// in the distance and 1e-3 voxel along the surface. `converged` is false when two steps do not
/// suffice. The result of a search does not depend on the others. Resizes `feet`.
void closestPointsByTwoSteps(DenseBlockCache& blocks, const std::vector<JetSearch>& searches,
                             std::vector<Foot>& feet);

/// Returns true when the grid points around a point of the interpolant's zero set have both signs.
/// Where values of one sign come close to zero, the interpolant may cross zero although the grid
/// values do not.
[[nodiscard]] bool changesSignAround(const DenseBlock& block, const openvdb::Vec3d& point);

}  // namespace levelset::eikonal
