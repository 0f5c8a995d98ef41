#pragma once

#include <Imath/ImathVec.h>

#include "levelset/memory_limit.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "render/images/image.h"

namespace render {

/// A plane through a solid.
struct SliceOptions {
  Imath::V3d point{0}, normal{0, 0, 1};  ///< seen from where the normal, of any length, points
  int width = 1024, height = 768;        ///< pixels
  double step = 0;  ///< world units from one contour line to the next; 0: a voxel
  std::size_t maxBytes = levelset::kNoMemoryLimit;  ///< for the image
  levelset::Progress progress = {};
};

/// The distance φ in a plane: by colour, blue inside and brown outside, with contour lines, the
/// zero one black; even tones where the band does not reach. Upwards is z, or y where the normal is
/// along z; the picture frames the solid's bounds.
/// @return layers R G B A, and phi (trilinear, ± the background outside the band), P.X P.Y P.Z,
///         from the pixels' middles, world units
/// @throws levelset::UsageError for a plane without direction, a size or step that is not positive;
///         levelset::InvalidInput for a solid without surface; levelset::Cancelled
[[nodiscard]] Image drawSlice(const levelset::NarrowBand& band, const SliceOptions& options);

}  // namespace render
