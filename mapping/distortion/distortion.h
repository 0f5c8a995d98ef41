#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// Least and largest of a set of values, and their 1 %, 50 % and 99 % quantiles.
struct Spread {
  double least = 0, percent1 = 0, median = 0, percent99 = 0, most = 0;
};

/// Distortion of lengths and volumes by a map.
struct Distortion {
  /// Number of samples, and of samples where the map is inverted.
  std::size_t samples = 0, folded = 0;
  /// Jacobian determinant of patch → texture, times the median of its positive reciprocals; 1
  /// everywhere if the patch is a box, ≤ 0 at folds.
  Spread jacobian;
  /// Sample with the least Jacobian, in world and texture coordinates.
  Imath::V3d foldPoint{0}, foldUvw{0};
  /// Stretch: least and largest singular value of texture → patch at each sample, both lengths in
  /// world units.
  Spread stretch;
  /// Least stretch at and above the surface, where the texture is visible after a union.
  double leastAbove = 0;
  double meanStretch = 0;  ///< cube root of the median volume ratio, patch to texture
};

/// Texture coordinates of sample points: the particles, the middles of their cells, points between
/// the layers, and points below the surface.
/// @param embedDepth  depth of the points below the surface, in w; negative: height above w = 1
[[nodiscard]] std::vector<Imath::V3d> samplePoints(const Patch& patch, double embedDepth);

/// Evaluates a map at samplePoints.
[[nodiscard]] std::vector<MapSample> sampleMap(const PatchMap& map, const Patch& patch,
                                               double embedDepth);

/// Computes the distortion of a map from its samples.
/// @param textureSize  size of the texture's box, world units; the box maps to the unit cube of u,
///         v and w
/// @param isMirrored   true if the patch mirrors the texture on purpose
/// @pre samples is not empty
[[nodiscard]] Distortion surveyDistortion(std::span<const MapSample> samples,
                                          const Imath::V3d& textureSize, bool isMirrored = false);

/// Combines the distortion of several maps. Counts are summed; extremes and the 1 % and 99 %
/// quantiles are the worst over all maps; medians and the mean stretch are the median over the
/// maps.
/// @pre maps is not empty
[[nodiscard]] Distortion worstOf(std::span<const Distortion> maps);

}  // namespace mapping
