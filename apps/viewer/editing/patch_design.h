#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace viewer {

/// Texture of a patch that the user designs: a pattern of the generators with their default
/// proportions, or none.
enum class TextureKind { None, Scales, Knurl, Hexagons };
inline constexpr std::array kTextureKinds = {TextureKind::Scales, TextureKind::Knurl,
                                             TextureKind::Hexagons, TextureKind::None};
[[nodiscard]] const char* textureName(TextureKind kind);

/// Lines of a patch on the surface. Sides are in the order of mapping::PatchOptions::sides: 0 → 1,
/// 1 → 2, 3 → 2 and 0 → 3.
using PatchPaths = std::array<std::vector<Imath::V3d>, 4>;
/// First and last corner of each side.
inline constexpr std::array<std::array<std::size_t, 2>, 4> kSideEnds = {
    {{0, 1}, {1, 2}, {3, 2}, {0, 3}}};

/// A patch that the user makes: its outline and its texture. World units.
struct PatchDesign {
  std::vector<Imath::V3d> corners;               ///< up to four points on the surface
  std::array<std::vector<Imath::V3d>, 4> sides;  ///< points through which the sides pass
  TextureKind texture = TextureKind::Scales;
  int columns = 6;  ///< columns of the pattern along u, at least 1
  /// Height of the patch, relative to the height that keeps the proportions of the texture.
  double relief = 1;
  [[nodiscard]] bool isWhole() const { return corners.size() == 4; }
  bool operator==(const PatchDesign&) const = default;
};

/// Brings four corners into anticlockwise order around their centre, seen from outside. The first
/// corner keeps its place, so a crossed outline becomes a simple one. A design that already has
/// points on its sides keeps its order.
void orderCorners(const levelset::NarrowBand& base, PatchDesign& design);

/// Mean lengths along u and along v of the sides, world units.
[[nodiscard]] Imath::V2d sizeOf(const PatchPaths& sides);

/// Height of the patch, rounded as it is written. It keeps the proportions of the texture, times
/// `relief`. Without a texture it is a seventh of the patch's size.
/// @param size  as sizeOf()
[[nodiscard]] double heightOf(const PatchDesign& design, const Imath::V2d& size);

/// The texture of a design as an action of the command line, and the solid that this action makes.
struct TextureTile {
  std::string action;  ///< for example "scales --length 1 --columns 6 --rows 8 --voxel 0.05"
  levelset::NarrowBand solid;
};
/// Makes the texture of a design, with voxels that the map to the patch turns to about
/// `voxelSize`. It has an even number of rows, so that the proportions are kept as well as
/// possible.
/// @param size  as sizeOf(); @param voxelSize  voxel size on the patch, world units
/// @throws as the generators. @pre design.texture is not None
[[nodiscard]] TextureTile makeTexture(const PatchDesign& design, const Imath::V2d& size,
                                      double voxelSize, const levelset::Progress& progress = {});

/// The `patch` action of a design, without the name of the base: it applies to the newest value.
/// @pre design.isWhole()
[[nodiscard]] std::string patchAction(const PatchDesign& design, double height);

}  // namespace viewer
