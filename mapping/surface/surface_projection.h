#pragma once

#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"

namespace mapping {

/// Finds the point of the zero set nearest to `point`, at any distance. It starts at the nearest
/// grid point beside the surface and moves along the surface until no step comes nearer.
/// @throws UsageError if a coordinate of the point is not finite
/// @throws InvalidInput if the base has no surface, or its values near the surface are no
///         distances. Also if the point is further away than the diagonal of the zero set's box, or
///         if an open surface breaks off before the nearest point. The message gives the position.
[[nodiscard]] Imath::V3d closestSurfacePoint(const levelset::NarrowBand& base,
                                             const Imath::V3d& point);

}  // namespace mapping
