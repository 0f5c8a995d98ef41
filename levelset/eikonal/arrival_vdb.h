#pragma once

// Arrival times as OpenVDB grids. Internal header of levelset: public headers must not include it.

#include <span>

#include "levelset/eikonal/arrival.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

struct ArrivalRequest {
  double until = 0;  ///< world units of time
  ArrivalOptions options = {};
};

struct ArrivalGrid {
  /// World units; active where reached; elsewhere ± the latest time.
  openvdb::FloatGrid::Ptr times;
  ArrivalFigures figures;
};

/// Computes arrival times from the zero set to both sides; negative inside. At speed 1 the grid has
/// the level-set class.
[[nodiscard]] ArrivalGrid arrivalFromSurface(const openvdb::FloatGrid& field,
                                             const ArrivalRequest& request);

/// Computes arrival times from points (world), on the grid points of `transform`.
[[nodiscard]] ArrivalGrid arrivalFromPoints(std::span<const Imath::V3d> sources,
                                            const openvdb::math::Transform& transform,
                                            const ArrivalRequest& request);

}  // namespace levelset::eikonal
