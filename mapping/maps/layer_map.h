#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// Maps texture coordinates to a world position above the patch. The map is piecewise linear
/// through the particles: bilinear in u and v on the two layers next to w, then linear between them
/// [Brodersen07 §8.4]. Beyond the unit cube the outermost cells continue linearly.
[[nodiscard]] Imath::V3d layerPosition(const Patch& patch, const Imath::V3d& uvw);

/// Evaluates the layer map with derivatives. The position equals layerPosition, bit for bit. On the
/// border of two cells the slopes are those of the cell that begins there; on the last border, of
/// the cell that ends there.
[[nodiscard]] ForwardFrame layerFrame(const Patch& patch, const Imath::V3d& uvw);

/// Samples the layer map and the slopes of its inverse in the middle and near the corners of every
/// cell, because a bilinear cell inverts first at a corner. Between layers of different counts, the
/// cells of both layers are sampled.
/// @param embedDepth  also sample this far below w = 0, or above w = 1 if negative; in w
[[nodiscard]] std::vector<MapSample> sampleLayerMap(const Patch& patch, double embedDepth);

/// Longest edge of any cell of particles, including edges between layers, world units.
[[nodiscard]] double longestCellEdge(const Patch& patch);

}  // namespace mapping
