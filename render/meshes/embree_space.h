#pragma once

// Private to render: the scaled space in which Embree works in single precision.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <embree3/rtcore.h>

#include <optional>

namespace render {

/// A uniform scaling that maps a box to a diagonal of 1 about the origin. Rays start at that box,
/// so origin, direction and boxes have errors of about 2^-24 each.
struct EmbreeSpace {
  /// Padding that covers these errors, in the scaled space.
  static constexpr double kPad = 2e-6;

  Imath::Box3d box;  ///< slightly larger than the given bounds; rays may start on it
  Imath::V3d centre;
  double scale = 1;

  EmbreeSpace() = default;
  explicit EmbreeSpace(const Imath::Box3d& bounds);
  /// Distance at which the ray enters the box, at least `near`; empty when the ray misses the box
  /// or ends before it.
  [[nodiscard]] std::optional<double> entryOf(const Imath::V3d& origin, const Imath::V3d& direction,
                                              double near, double far) const;
  /// @param start  world position, at the box; `maxDistance` is measured from it
  [[nodiscard]] RTCRay rayFrom(const Imath::V3d& start, const Imath::V3d& direction,
                               double maxDistance) const;
};

/// Checks the device. @throws levelset::ResourceLimit when Embree reports an error
void requireEmbree(RTCDevice device);

}  // namespace render
