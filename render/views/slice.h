#pragma once

#include <Imath/ImathVec.h>

#include "levelset/memory/memory_limit.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "render/images/image.h"

namespace render {

/// A plane through a solid, and the size of the picture of that plane.
struct SliceOptions {
  /// A point of the plane, world units; normal of the plane, of any length, towards the viewer.
  Imath::V3d point{0}, normal{0, 0, 1};
  int width = 1024, height = 768;  ///< pixels
  double step = 0;  ///< difference of φ between contour lines, world units; 0: one voxel
  std::size_t maxBytes = levelset::kNoMemoryLimit;  ///< memory limit of the image, bytes
  levelset::Progress progress = {};
};

/// Draws the signed distance φ to a solid in a plane: blue inside and brown outside, with contour
/// lines; the contour φ = 0 is black. Areas outside the band have a uniform colour. The up
/// direction is z, or y for a normal along z. The picture frames the bounds of the zero set.
/// @return layers R G B A; phi (trilinear, ± the background outside the band) and P.X P.Y P.Z at
///         the pixel centres, world units
/// @throws levelset::UsageError for a plane that is not finite or has a zero normal, a size that is
/// not positive, or a step below 0
/// @throws levelset::ResourceLimit for more than kMaxPixels pixels, or memory above maxBytes
/// @throws levelset::InvalidInput for a solid without surface
/// @throws levelset::Cancelled when progress asks to stop
[[nodiscard]] Image drawSlice(const levelset::NarrowBand& band, const SliceOptions& options);

}  // namespace render
