#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

/// What the generators of textures share. A pattern without end is cut off by a box: its tile,
/// columns along x and rows along y, so that the solid goes on across the sides of its tile as it
/// begins on the other side.
namespace mapping {

struct Tiling {
  int columns = 1, rows = 1;  ///< at least 1
  double overlap = 0;  ///< how far the pattern goes on beyond each side of its tile, world units
};

/// Where a pattern stands: the middle of its box, which is the tile, the overlap, and all that
/// stands on it.
struct TileBox {
  Imath::Box3d tile;   ///< what repeats along x and y; what a texture maps onto a patch
  Imath::Box3d whole;  ///< with the overlap
};

/// @param period  of one column and row; @param low, high  along z, of the pattern's own frame,
///                whose origin is a corner of the tile
[[nodiscard]] TileBox tileBox(const Tiling& tiling, const Imath::V2d& period, double low,
                              double high, const Imath::V3d& center);

}  // namespace mapping
