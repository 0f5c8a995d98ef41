#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// Least, most, and what one in a hundred, half and all but one in a hundred stay below.
struct Spread {
  double least = 0, percent1 = 0, median = 0, percent99 = 0, most = 0;
};

/// What a map does to lengths and volumes.
struct Distortion {
  std::size_t samples = 0, folded = 0;  ///< places looked at, and where the map turns over
  Spread jacobian;  ///< det ∇Φ × median of its reciprocals; 1 for a box, ≤ 0 folds
  Imath::V3d foldPoint{0}, foldUvw{0};  ///< of the least, in world and texture coordinates
  Spread stretch;  ///< least and largest singular value of texture → patch, world per world; median
                   ///< and percentiles over both
  double leastAbove = 0;   ///< least stretch at and above the surface; below it, a union shows none
  double meanStretch = 0;  ///< third root of the median volume ratio
};

/// Texture coordinates of the particles, of the middles of their cells, between the layers, and of
/// places below the surface. @param sink  how deep to look there, in w
[[nodiscard]] std::vector<Imath::V3d> samplePlaces(const Patch& patch, double embedDepth);

/// A map at all of them.
[[nodiscard]] std::vector<MapSample> sampleMap(const PatchMap& map, const Patch& patch,
                                               double embedDepth);

/// @param textureSize  of the box that is the unit cube, world units
/// @param isMirrored   does the patch turn the texture over on purpose?
/// @pre samples is not empty
[[nodiscard]] Distortion surveyDistortion(std::span<const MapSample> samples,
                                          const Imath::V3d& textureSize, bool isMirrored = false);

/// Of several maps: counts are added up; the least, the percentiles and the most are those of the
/// map where they are worst, medians and the mean stretch are the median map's.
/// @pre maps is not empty
[[nodiscard]] Distortion worstOf(std::span<const Distortion> maps);

}  // namespace mapping
