#pragma once

#include <Imath/ImathVec.h>

#include "mapping/surface/surface_field.h"

namespace mapping {

/// A tangent direction at a place with normal `from`, at a place with normal `to`: turned by the
/// least rotation between the normals, which over an edge unfolds it. Unit vectors; zero for a
/// direction that has no part in the plane of `to`.
[[nodiscard]] Imath::V3d carried(const Imath::V3d& direction, const Imath::V3d& from,
                                 const Imath::V3d& to);

/// Walks straight ahead on φ = height: the geodesic that a start and a direction determine. Over an
/// edge it goes on as if the faces were unfolded. Steps are half a voxel long, less where the
/// surface turns; second order in them.
class SurfaceWalk {
 public:
  /// @param from       on φ = height
  /// @param direction  its part in the tangent plane counts
  SurfaceWalk(const SurfaceField& field, double height, const Imath::V3d& from,
              const Imath::V3d& direction);

  /// Goes on by `length` along the surface. False, and standing where it stopped, when the surface
  /// breaks off on the way or is too sharp to be followed.
  [[nodiscard]] bool advance(double length);
  [[nodiscard]] const Imath::V3d& position() const { return position_; }
  /// Unit, in the tangent plane.
  [[nodiscard]] const Imath::V3d& direction() const { return direction_; }
  [[nodiscard]] const Imath::V3d& normal() const { return normal_; }
  /// World units since the start.
  [[nodiscard]] double walked() const { return walked_; }

 private:
  bool step(double length);
  const SurfaceField& field_;
  double height_;
  Imath::V3d position_, normal_, direction_;
  double walked_ = 0;
};

}  // namespace mapping
