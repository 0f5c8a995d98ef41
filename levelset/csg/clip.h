#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathPlane.h>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// The part of a solid inside an axis-aligned world box, closed by the box's faces.
/// @throws InvalidInput when nothing is left
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Box3d& box,
                              const Progress& progress = {});

/// The part of a solid behind a plane (on the side that its normal points away from), closed by it.
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Plane3d& plane,
                              const Progress& progress = {});

}  // namespace levelset
