#pragma once

// Private to geometric textures: checks of the arguments, and the parts of a texture for each
// patch.

#include <Imath/ImathBox.h>

#include <functional>
#include <map>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/shared_sides.h"

namespace mapping {

/// Checks the arguments of mapTexture() and placeTexture().
/// @throws as mapTexture()
void requireTextureArguments(const levelset::NarrowBand& base, const levelset::NarrowBand& texture,
                             std::span<const Patch> patches, const TextureOptions& options);

/// Parts of the texture that are mapped onto each patch. A prism map ends a little outside the unit
/// cube. So for a prism map, a texture that extends beyond the texture box is clipped at the box,
/// not at the end of the map. At sides that two patches share it is clipped kBeyond voxels further
/// out, so that neighbouring tiles overlap. If they met face to face, the grid would show a gap. A
/// texture that only touches the box is not clipped.
class TextureParts {
 public:
  /// Voxels of the result by which clipped parts overlap their neighbours.
  static constexpr double kBeyond = 2;
  /// @param voxelSize  of the result, world units
  /// @param isCut  the texture extends beyond the box and is clipped
  /// @param fit  adapts a part to the result
  TextureParts(const levelset::NarrowBand& texture, const Imath::Box3d& box,
               std::span<const Patch> patches, double voxelSize, bool isCut,
               const std::function<levelset::NarrowBand(const levelset::NarrowBand&)>& fit);
  /// Sides beyond which the part of a patch reaches. Patches with equal sides have one part.
  [[nodiscard]] const SharedSides& sidesOf(std::size_t patch) const { return ofPatch_[patch]; }
  [[nodiscard]] const levelset::NarrowBand& of(std::size_t patch) const {
    return parts_.at(ofPatch_[patch]);
  }

 private:
  std::map<SharedSides, levelset::NarrowBand> parts_;
  std::vector<SharedSides> ofPatch_;
};

}  // namespace mapping
