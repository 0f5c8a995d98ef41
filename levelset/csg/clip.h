#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathPlane.h>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// Cuts a solid to the inside of an axis-aligned box in world units. The faces of the box close the
/// cut.
/// @throws UsageError if the box is empty
/// @throws InvalidInput if the result is empty
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Box3d& box,
                              const Progress& progress = {});

/// Cuts a solid to one side of a plane, the side that its normal points away from. The plane closes
/// the cut.
/// @throws UsageError if the normal or the distance is not finite, or the normal is zero
/// @throws InvalidInput if the result is empty
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Plane3d& plane,
                              const Progress& progress = {});

}  // namespace levelset
