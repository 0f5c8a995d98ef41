#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <functional>
#include <optional>

#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Closest point of the surface for each grid point of a leaf, in index space. Valid at active grid
/// points.
using ClosestPointLeaf = std::array<openvdb::Vec3d, 512>;

/// Options of distanceTransform(), in voxels. With the signed distance d, the values of the result
/// are d − shift where |d − shift| < halfWidth.
struct DistanceRequest {
  double halfWidth = 3;
  double shift = 0;  ///< offset of the surface, outwards (> 0) or inwards (< 0)
  std::optional<openvdb::CoordBBox> region = {};  ///< grid points to compute; empty: all
  /// Searches for edges and corners of the surface. Pass false for a surface without any, such as
  /// after a long smoothing.
  bool mayHaveEdges = true;
  /// Makes the values distances to the moved surface everywhere. They differ from d − shift beside
  /// the creases in which parts of the moved surface meet.
  bool ofMovedSurface = false;
  /// Called with each leaf of the result that has active values and with its closest points, from
  /// many threads at once and in no fixed order.
  std::function<void(const openvdb::FloatTree::LeafNodeType&, const ClosestPointLeaf&)>
      visitPoints = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes the signed distance to the zero set of `field`, on the same grid. Works in three steps.
/// First, finds the closest points of the zero set for the grid points beside it
/// (surface_points.h). Second, propagates these surface points outwards, so that each grid point
/// gets the nearest one (propagate.h). Third, refines the surface point of each grid point on the
/// interpolant.
/// @throws InvalidInput if the field has no zero crossing
/// @throws ResourceLimit before it allocates more memory than allowed
[[nodiscard]] openvdb::FloatGrid::Ptr distanceTransform(const openvdb::FloatGrid& field,
                                                        const DistanceRequest& request);

}  // namespace levelset::eikonal
