#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/nearest/distance_request.h"

namespace levelset::eikonal {

/// Computes the signed distance to the zero set of `field`, on the same grid. Works in three steps.
/// First, finds the closest points of the zero set for the grid points beside it
/// (surface_points.h). Second, propagates these surface points outwards, so that each grid point
/// gets the nearest one (propagate.h). Third, refines the surface point of each grid point on the
/// interpolant. The steps follow each other through the grid, so that only a part of their state is
/// in memory at once.
/// @throws InvalidInput if the field has no zero crossing
/// @throws ResourceLimit before it allocates more memory than allowed
[[nodiscard]] openvdb::FloatGrid::Ptr distanceTransform(const openvdb::FloatGrid& field,
                                                        const DistanceRequest& request);

/// As above, and deletes the leaves of the field as soon as no step reads them any more, unless the
/// grid or its tree is shared.
[[nodiscard]] openvdb::FloatGrid::Ptr distanceTransform(openvdb::FloatGrid::Ptr&& field,
                                                        const DistanceRequest& request);

}  // namespace levelset::eikonal
