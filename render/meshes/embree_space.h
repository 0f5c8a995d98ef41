#pragma once

// Private to the Embree renderer: how its floats see a scene.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <embree3/rtcore.h>

#include <optional>

namespace render {

/// Things scaled to a diagonal of 1 around the origin, and rays that start at their box: then
/// origin, direction and boxes carry errors of some 2^-24 each.
struct EmbreeSpace {
  /// Covers them, in the scaled space.
  static constexpr double kPad = 2e-6;

  Imath::Box3d box;  ///< a little larger than the things: where rays may start
  Imath::V3d centre;
  double scale = 1;

  EmbreeSpace() = default;
  explicit EmbreeSpace(const Imath::Box3d& bounds);
  /// Where the ray enters the box, at least `near`; nothing when it misses it or ends before.
  [[nodiscard]] std::optional<double> entryOf(const Imath::V3d& origin, const Imath::V3d& direction,
                                              double near, double far) const;
  /// @param start  in the world, at the box; `maxDistance` from there
  [[nodiscard]] RTCRay rayFrom(const Imath::V3d& start, const Imath::V3d& direction,
                               double maxDistance) const;
};

/// @throws levelset::ResourceLimit when Embree tells of an error
void requireEmbree(RTCDevice device);

}  // namespace render
