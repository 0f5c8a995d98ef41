#pragma once

#include <Imath/ImathBox.h>

#include <optional>
#include <string>
#include <vector>

#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"

namespace mapping {

/// Placement of a texture: `box` is mapped to the unit cube of u, v, w, then lowered by
/// `embedDepth`.
struct TexturePlacement {
  Imath::Box3d box;
  double embedDepth = 0;  ///< depth of the texture below the surface, in w
  [[nodiscard]] Imath::V3d toTexture(const Imath::V3d& uvw) const {
    return box.min + Imath::V3d(uvw.x, uvw.y, uvw.z + embedDepth) * box.size();
  }
  [[nodiscard]] Imath::V3d toUvw(const Imath::V3d& texture) const {
    return (texture - box.min) / box.size() - Imath::V3d(0, 0, embedDepth);
  }
};

/// Returns the box that is mapped to the unit cube of u, v, w: `given`, or if that is empty, the
/// texture's own box.
/// @throws InvalidInput if the box has no volume or does not meet the texture
[[nodiscard]] Imath::Box3d chooseTextureBox(const Imath::Box3d& own,
                                            const std::optional<Imath::Box3d>& given);

/// True if a texture with box `own` extends beyond `box` by more than a twentieth of a voxel.
[[nodiscard]] bool isBeyond(const Imath::Box3d& own, const Imath::Box3d& box, double voxelSize);

/// Checks a map for folds.
/// @return notes about folds that are allowed, and about a share of the patch's volume without a
///         certificate; often empty
/// @throws InvalidInput for folds that are not allowed, with the position of the worst fold
[[nodiscard]] std::vector<std::string> checkFolds(const Distortion& distortion,
                                                  const FoldCertificate& certificate,
                                                  bool areAllowed);

}  // namespace mapping
