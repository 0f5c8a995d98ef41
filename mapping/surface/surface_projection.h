#pragma once

#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"

namespace mapping {

/// The point of the zero set that is nearest to `point`, however far: from the nearest grid point
/// beside the surface, then along the surface until no step comes nearer.
/// @param action  begins the message
/// @throws InvalidInput when it is further than the diagonal of the zero set's box, or there is no
///         surface; where an open surface breaks off before its nearest point, with that place
[[nodiscard]] Imath::V3d closestSurfacePoint(const levelset::NarrowBand& base,
                                             const Imath::V3d& point, const char* action);

}  // namespace mapping
