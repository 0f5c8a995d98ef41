#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// Texture → patch space straight through the particles: bilinear in u and v within the two layers
/// about w, then linear between them [Brodersen07 §8.4]. Beyond the unit cube the outermost cells
/// go on linearly.
[[nodiscard]] Imath::V3d layerPosition(const Patch& patch, const Imath::V3d& uvw);

/// That map with its derivatives, world units per unit of u, v and w.
struct LayerFrame {
  Imath::V3d position;  ///< to the bit that of layerPosition
  std::array<Imath::V3d, 3> slopes;
};

/// On the border of two cells the slopes are those of the one that begins there, on the last border
/// of the one that ends there.
[[nodiscard]] LayerFrame layerFrame(const Patch& patch, const Imath::V3d& uvw);

/// That map and its inverse's slopes in the middle and close to the corners of every cell, where a
/// bilinear cell turns over first; for layers of unlike counts in those of both.
/// @param sink  how far below w = 0 to look too, or above w = 1 if negative
[[nodiscard]] std::vector<MapSample> sampleLayerMap(const Patch& patch, double embedDepth);

/// The longest edge of any cell of particles, across layers included.
[[nodiscard]] double longestCellEdge(const Patch& patch);

}  // namespace mapping
