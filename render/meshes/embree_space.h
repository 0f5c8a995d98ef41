#pragma once

// Private to render: the scaled space in which Embree works in single precision.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <embree3/rtcore.h>

#include <optional>

namespace render {

/// A translation and uniform scaling that map a box of the scene to a box around the origin with
/// diagonal 1. Rays start at the box. So ray origins, ray directions and the boxes of primitives
/// have rounding errors of about 2^-24 each in the scaled space.
struct EmbreeSpace {
  /// Padding of boxes of primitives and of ray ends that covers the rounding errors, a length in
  /// the scaled space.
  static constexpr double kPad = 2e-6;

  Imath::Box3d box;   ///< slightly larger than the given bounds, world space; rays may start on it
  Imath::V3d centre;  ///< point that is mapped to the origin, world space
  double scale = 1;   ///< scaled length of one world unit

  EmbreeSpace() = default;
  explicit EmbreeSpace(const Imath::Box3d& bounds);
  /// Distance from `origin` at which the ray enters the box, at least `near`, world units. Empty
  /// when the ray misses the box or ends before it.
  [[nodiscard]] std::optional<double> entryOf(const Imath::V3d& origin, const Imath::V3d& direction,
                                              double near, double far) const;
  /// Builds Embree's ray in the scaled space.
  /// @param start  start of the ray, world space, on or in the box
  /// @param maxDistance  length of the ray, world units
  [[nodiscard]] RTCRay rayFrom(const Imath::V3d& start, const Imath::V3d& direction,
                               double maxDistance) const;
};

/// Checks for an error of Embree. @throws levelset::ResourceLimit when the device reports one
void requireEmbree(RTCDevice device);

}  // namespace render
