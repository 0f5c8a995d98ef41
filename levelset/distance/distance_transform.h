#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <functional>
#include <optional>

#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Closest point of each grid point of a leaf, index space; valid where the leaf is active.
using ClosestPointLeaf = std::array<openvdb::Vec3d, 512>;

/// Options of distanceTransform(), in voxels. The result is d − shift where |d − shift| <
/// halfWidth.
struct DistanceRequest {
  double halfWidth = 3;
  double shift = 0;  ///< offset of the surface, outwards (> 0) or inwards (< 0)
  std::optional<openvdb::CoordBBox> region = {};
  /// Searches for edges and corners. Pass false for a surface that was smoothed for long: it has
  /// none.
  bool mayHaveEdges = true;
  /// Called for each leaf with active values, from many threads at once and in no fixed order.
  std::function<void(const openvdb::FloatTree::LeafNodeType&, const ClosestPointLeaf&)>
      visitPoints = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes the signed distance to the zero set of `field`, on the same grid.
/// Works in three steps. Surface points are located beside the zero set (surface_points.h). The
/// nearest surface point propagates outwards (propagate.h). Each grid point refines its surface
/// point on the interpolant.
/// @throws InvalidInput without a zero crossing
/// @throws ResourceLimit before it allocates more memory than allowed
[[nodiscard]] openvdb::FloatGrid::Ptr distanceTransform(const openvdb::FloatGrid& field,
                                                        const DistanceRequest& request);

/// Returns true when two neighbouring grid points differ in sign and one of them holds a distance.
[[nodiscard]] bool hasZeroCrossing(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
