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

/// Distance along each axis, voxels, to the other grid points whose crease points contribute to the
/// distance of a grid point from a moved surface. It follows from the rounds in which grid points
/// take crease points from neighbours, and from the reach of the searches that start again.
inline constexpr int kCreaseReach = 10;

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

}  // namespace levelset::eikonal
