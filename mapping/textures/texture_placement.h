#pragma once

#include <Imath/ImathBox.h>

#include <optional>
#include <string>
#include <vector>

#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"

namespace mapping {

/// Where a texture lies in texture space: the unit cube is `box`, pushed inwards by `sink`.
struct TexturePlacement {
  Imath::Box3d box;
  double embedDepth = 0;  ///< in w
  [[nodiscard]] Imath::V3d toTexture(const Imath::V3d& uvw) const {
    return box.min + Imath::V3d(uvw.x, uvw.y, uvw.z + embedDepth) * box.size();
  }
  [[nodiscard]] Imath::V3d toUvw(const Imath::V3d& texture) const {
    return (texture - box.min) / box.size() - Imath::V3d(0, 0, embedDepth);
  }
};

/// The box that becomes the unit cube: the one that is given, else the texture's own.
/// @throws InvalidInput when it has no volume or holds nothing of the texture
[[nodiscard]] Imath::Box3d chooseTextureBox(const Imath::Box3d& own,
                                            const std::optional<Imath::Box3d>& given);

/// Does a texture of this box stick out of the other, by more than a small part of its voxels?
[[nodiscard]] bool isBeyond(const Imath::Box3d& own, const Imath::Box3d& box, double voxelSize);

/// @return what to note of folds that are allowed, and of parts that are not certified; empty
///         without any
/// @throws InvalidInput for folds that are not, telling where the worst is
[[nodiscard]] std::vector<std::string> checkFolds(const Distortion& distortion,
                                                  const FoldCertificate& certificate,
                                                  bool areAllowed);

}  // namespace mapping
