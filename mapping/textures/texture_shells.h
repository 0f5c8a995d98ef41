#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"
#include "mapping/textures/geometric_texture.h"

/// Textures that stay apart from the base: one grid, and for each patch the map of the space above
/// it [Brodersen07 §9.3].
namespace mapping {

/// The prism map of a patch as plain data: a grid of nodes with a position in the space of the
/// texture and one above the patch. Each cell of the grid is six tetrahedra, in which the map is
/// linear. The corners of a tetrahedron form a path along three edges of its cell, from the first
/// corner of the cell (least u, v, w) to its last.
struct TextureShell {
  std::array<int, 3> cells{};  ///< number of cells along u, v, w
  /// Coordinates of the nodes in the space of the texture, along u, v, w; ascending; world units of
  /// the texture.
  std::array<std::vector<double>, 3> coordinates;
  Imath::V3d centre{0};  ///< origin of `offsets`, world units
  /// Positions of the nodes above the patch, relative to `centre`, u fastest; world units.
  std::vector<Imath::V3f> offsets;
};

/// A grid, and the shells through which it is mapped onto patches.
struct ShellGroup {
  levelset::NarrowBand texture;
  std::vector<TextureShell> shells;
};

struct PlacedTexture {
  /// One group, which has the texture itself. If a texture extends beyond the texture box it is
  /// clipped; then there is one group for each of the different clipped parts.
  std::vector<ShellGroup> groups;
  TextureReport report;
};

/// Places a texture on patches without warping it: checks the maps as mapTexture() does, and
/// returns them as shells. Shells reach beyond the texture by voxels of the texture only. Options
/// that determine the grid of a result are ignored.
/// @throws UsageError also for maps other than TextureMap::Prism, and for other ways of merging
///         than Union and Alone
/// @throws as mapTexture()
[[nodiscard]] PlacedTexture placeTexture(const levelset::NarrowBand& base,
                                         const levelset::NarrowBand& texture,
                                         std::span<const Patch> patches,
                                         const TextureOptions& options = {});

}  // namespace mapping
