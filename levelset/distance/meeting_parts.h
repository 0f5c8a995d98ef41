#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/propagate.h"
#include "levelset/distance/surface/zero_set.h"

namespace levelset::eikonal {

/// Corrects the distances to a surface minus a shift where they are not the distances to the moved
/// surface. That is on the near side of the moved surface, where the surface itself is, beside the
/// creases in which parts of the moved surface meet. A value φ is correct if the point
/// x − φ ∇φ/|∇φ| lies on the moved surface. MovedSurface computes the other values. Where it fails,
/// the distance to the zero set of `field` is computed.
/// @param field    distances minus the shift, in a band of request.halfWidth around the moved
/// surface
/// @param surface  surface before it moves, and in `nearest` the nearest point of each grid point
void correctMeetingParts(openvdb::FloatGrid& field, const ZeroSet& surface,
                         const NearestPoints& nearest, const DistanceRequest& request);

}  // namespace levelset::eikonal
