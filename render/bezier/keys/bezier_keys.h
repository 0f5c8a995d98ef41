#pragma once

#include <vector>

#include "levelset/deform/keys/key_weights.h"
#include "render/bezier/bezier_volume.h"

namespace render {

/// Checks that Bézier volumes can be interpolated: they must have the same isovalue and expression,
/// and patches with the same degrees and numbers of attributes, all or none of them with weights.
/// @throws levelset::InvalidInput with the number of the first volume that differs; the first has
///         number 1
void requireSameVolumes(const std::vector<BezierVolume>& keys);

/// Volume between keys. Control points, attributes and weights are interpolated. The result may
/// fold, as Bézier volumes may.
/// @pre requireSameVolumes() accepts the keys
/// @throws levelset::InvalidInput as requireBezierVolume()
[[nodiscard]] BezierVolume volumeBetween(const std::vector<BezierVolume>& keys,
                                         const std::vector<levelset::KeyWeight>& weights);

}  // namespace render
