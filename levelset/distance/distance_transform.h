#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <functional>
#include <optional>

#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// The closest point of each grid point of a leaf, index space; set where the leaf is active.
using ClosestPointLeaf = std::array<openvdb::Vec3d, 512>;

/// Which distances are made, in voxels. The result is d − shift where |d − shift| < halfWidth.
struct DistanceRequest {
  const char* action = "redistance";  ///< for messages
  double halfWidth = 3;
  double shift = 0;  ///< moves the surface outwards (> 0) or inwards
  std::optional<openvdb::CoordBBox> region = {};
  /// Are edges and corners looked for? A surface that has been smoothed for long has none.
  bool mayHaveEdges = true;
  /// Called for each leaf that has active values, from many threads at once, in no fixed order.
  std::function<void(const openvdb::FloatTree::LeafNodeType&, const ClosestPointLeaf&)>
      visitPoints = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// The signed distance to the zero set of `field`, on the same grid points.
/// Points of the zero set are found beside it (surface_points.h), the nearest of them travels
/// outwards (propagate.h), and each grid point polishes the one it got on the interpolant.
/// @throws InvalidInput without a zero crossing; ResourceLimit before too much is allocated
[[nodiscard]] openvdb::FloatGrid::Ptr distanceTransform(const openvdb::FloatGrid& field,
                                                        const DistanceRequest& request);

/// Is there a pair of neighbouring grid points of different sign, one of them with a distance?
[[nodiscard]] bool hasZeroCrossing(const openvdb::FloatTree& field);

}  // namespace levelset::eikonal
