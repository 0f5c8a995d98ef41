#pragma once

// Arrival times as OpenVDB grids. Internal header of levelset: public headers must not include it.

#include <span>

#include "levelset/eikonal/arrival.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

struct ArrivalRequest {
  const char* action = "fast-sweeping";
  double until = 0;  ///< world units of time
  ArrivalOptions options = {};
};

struct ArrivalGrid {
  openvdb::FloatGrid::Ptr times;  ///< world; active where reached; elsewhere ± the latest time
  ArrivalFigures figures;
};

/// From the zero set, to both sides; negative inside. Level-set class when the speed is 1.
[[nodiscard]] ArrivalGrid arrivalFromSurface(const openvdb::FloatGrid& field,
                                             const ArrivalRequest& request);

/// From points (world), on grid points of `transform`.
[[nodiscard]] ArrivalGrid arrivalFromPoints(std::span<const Imath::V3d> sources,
                                            const openvdb::math::Transform& transform,
                                            const ArrivalRequest& request);

}  // namespace levelset::eikonal
