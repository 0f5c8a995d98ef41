#pragma once

// Private to render: the scaled space in which Embree works in single precision.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <embree3/rtcore.h>

#include <cstddef>
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
  /// Bounds of a world-space box in the scaled space, padded by kPad.
  [[nodiscard]] RTCBounds boundsOf(const Imath::Box3d& world) const;
};

/// Checks for an error of Embree. @throws levelset::ResourceLimit when the device reports one
void requireEmbree(RTCDevice device);

/// Embree's device and scene, both released by the destructor.
struct EmbreeTree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;  ///< null: no primitives

  EmbreeTree() = default;
  ~EmbreeTree();
  EmbreeTree(const EmbreeTree&) = delete;
  EmbreeTree& operator=(const EmbreeTree&) = delete;

  /// Creates the device and an empty scene. @throws levelset::ResourceLimit when Embree fails
  void open();
  /// Adds primitives of the program's own kind.
  /// @param data  passed to the functions as geometryUserPtr
  void addPrimitives(std::size_t count, void* data, RTCBoundsFunction bounds,
                     RTCIntersectFunctionN intersect, RTCOccludedFunctionN occluded);
  /// Builds the tree. @throws levelset::ResourceLimit when Embree fails
  void build();
};

}  // namespace render
