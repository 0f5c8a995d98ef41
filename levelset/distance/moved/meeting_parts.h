#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/nearest/distance_request.h"
#include "levelset/distance/nearest/propagate.h"
#include "levelset/distance/surface/zero_set.h"

namespace levelset::eikonal {

/// Corrects the distances to a surface minus a shift, so that they are the distances to the moved
/// surface. Wrong values lie on the side of the moved surface on which the old surface is, beside
/// creases in which moved parts meet. A value φ is correct if the point x − φ ∇φ/|∇φ| lies on the
/// moved surface. MovedSurface computes the other values. Where it fails, the distance to the zero
/// set of `field` is computed.
/// @param field    distances minus the shift, in a band of request.halfWidth around the moved
///                 surface. Stays as it is if it has no zero crossing.
/// @param surface  surface before it moves; `nearest` has its nearest point for each grid point
void correctMeetingParts(openvdb::FloatGrid& field, const ZeroSet& surface,
                         const NearestPoints& nearest, const DistanceRequest& request,
                         const Progress& progress);

}  // namespace levelset::eikonal
