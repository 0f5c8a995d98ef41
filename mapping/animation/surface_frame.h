#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "mapping/animation/footprint.h"
#include "mapping/surface/surface_field.h"

namespace mapping {

/// A place on the zero set with a direction in it.
struct SurfaceFrame {
  Imath::V3d centre, direction, normal;  ///< both unit
  [[nodiscard]] Imath::V3d inPlane(const Imath::V3d& way) const;
  /// The direction, turned about the normal; radians, anticlockwise seen from outside.
  [[nodiscard]] Imath::V3d turned(double angle) const;
};

[[nodiscard]] inline SurfaceFrame frameOf(const Footprint& footprint) {
  return {footprint.centre, footprint.direction, footprint.normal};
}

/// Where the straight ways end; empty where the surface breaks off before.
[[nodiscard]] std::optional<std::array<Imath::V3d, 4>> cornersFrom(
    const SurfaceField& field, const SurfaceFrame& frame, const std::array<Imath::V2d, 4>& reach);

}  // namespace mapping
