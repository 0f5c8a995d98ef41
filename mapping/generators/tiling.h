#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

/// Tiling shared by the texture generators. An infinite pattern is clipped by its tile, with
/// columns along x and rows along y, so that the solid is periodic across the sides of the tile.
namespace mapping {

struct Tiling {
  int columns = 1, rows = 1;  ///< at least 1
  double overlap = 0;         ///< extent of the pattern beyond each side of its tile, world units
};

/// Boxes of a pattern. The centre of a generator is the centre of the `whole` box.
struct TileBox {
  Imath::Box3d tile;   ///< the period along x and y; maps onto a patch
  Imath::Box3d whole;  ///< the tile with the overlap and all that stands on it
};

/// Computes the boxes of a pattern.
/// @param period     size of one column and row
/// @param low, high  range along z in the pattern's own frame, whose origin is a corner of the tile
[[nodiscard]] TileBox tileBox(const Tiling& tiling, const Imath::V2d& period, double low,
                              double high, const Imath::V3d& center);

}  // namespace mapping
