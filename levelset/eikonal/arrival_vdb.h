#pragma once

// Arrival times as OpenVDB grids. Internal header of levelset: public headers must not include it.

#include <span>

#include "levelset/eikonal/arrival.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

struct ArrivalRequest {
  /// Latest time, in the unit of time of the speed; at speed 1 a distance in world units.
  double until = 0;
  ArrivalOptions options = {};
};

struct ArrivalGrid {
  /// Arrival times in the unit of ArrivalRequest::until. Active where the front arrived; elsewhere
  /// the latest time, negated inside the solid.
  openvdb::FloatGrid::Ptr times;
  ArrivalFigures figures;
};

/// Computes arrival times from the zero set to both sides; negative inside. At speed 1 the grid has
/// the level-set class.
[[nodiscard]] ArrivalGrid arrivalFromSurface(const openvdb::FloatGrid& field,
                                             const ArrivalRequest& request);

/// Computes arrival times from source points (world units), on the grid points of `transform`.
[[nodiscard]] ArrivalGrid arrivalFromPoints(std::span<const Imath::V3d> sources,
                                            const openvdb::math::Transform& transform,
                                            const ArrivalRequest& request);

}  // namespace levelset::eikonal
