#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "mapping/animation/footprint.h"
#include "mapping/surface/surface_field.h"

namespace mapping {

/// A point on the zero set with a tangent direction and the normal.
struct SurfaceFrame {
  Imath::V3d centre, direction, normal;  ///< point; unit direction; unit normal
  /// Part of a vector in the tangent plane.
  [[nodiscard]] Imath::V3d inPlane(const Imath::V3d& offset) const;
  /// The direction rotated about the normal, by radians anticlockwise seen from outside.
  [[nodiscard]] Imath::V3d turned(double angle) const;
};

[[nodiscard]] inline SurfaceFrame frameOf(const Footprint& footprint) {
  return {footprint.centre, footprint.direction, footprint.normal};
}

/// End points of the geodesics from the frame's centre to the four corners; empty if the surface
/// breaks off before a corner.
/// @param reach  geodesic coordinates of the corners along u and v, world units
[[nodiscard]] std::optional<std::array<Imath::V3d, 4>> cornersFrom(
    const SurfaceField& field, const SurfaceFrame& frame, const std::array<Imath::V2d, 4>& reach);

}  // namespace mapping
