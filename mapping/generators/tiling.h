#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

/// Tiling shared by the texture generators. An infinite pattern is clipped by its tile, with
/// columns along x and rows along y, so that the solid is periodic across the sides of the tile.
namespace mapping {

struct Tiling {
  int columns = 1, rows = 1;  ///< columns along x and rows along y of a tile, each at least 1
  double overlap = 0;         ///< width of the pattern beyond each side of its tile, world units
};

/// Boxes of a pattern. The argument `center` of a generator is the centre of the box `whole`.
struct TileBox {
  Imath::Box3d tile;  ///< period of the pattern along x and y; a patch gets the texture of one tile
  Imath::Box3d whole;  ///< box of the solid: the tile, its overlap, and parts that project from it
};

/// Computes the boxes of a pattern.
/// @param period     width of a column along x and of a row along y, world units
/// @param low, high  range along z, world units, in the pattern's own frame, whose origin is a
///         corner of the tile
[[nodiscard]] TileBox tileBox(const Tiling& tiling, const Imath::V2d& period, double low,
                              double high, const Imath::V3d& center);

}  // namespace mapping
