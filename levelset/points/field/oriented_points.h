#pragma once

// For the .cpp files of this library only.

#include <Imath/ImathBox.h>

#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/points/point_cloud.h"

namespace levelset::points {

/// Points with unit normals at different positions, prepared for a surface. They are in the order
/// of the search tree, relative to the centre of their box.
struct OrientedPoints {
  Imath::V3d centre = Imath::V3d(0);  ///< world position of the origin
  std::vector<Imath::V3d> positions, normals;
  /// Distance between neighbours about each point, world units, of a regular hexagonal sampling
  /// with as many points per area.
  std::vector<double> spacings;
  double medianSpacing = 0;
  /// Number of points whose normal opposes the mean normal of their neighbours.
  std::size_t opposed = 0;
  PointSearch search;
  Imath::Box3d box;  ///< bounds of the positions

  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Least number of different positions that make a surface.
inline constexpr std::size_t kMinSurfacePoints = 4;

/// Prepares a cloud. Points at equal positions become one, with their mean normal.
/// @throws InvalidInput for a cloud without normals, with a normal of length zero, with fewer than
///         four different positions, or with all positions on a line
/// @throws ResourceLimit
[[nodiscard]] OrientedPoints orient(const PointCloud& cloud,
                                    std::size_t maxMemory = kNoMemoryLimit);

}  // namespace levelset::points
