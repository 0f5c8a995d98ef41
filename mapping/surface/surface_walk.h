#pragma once

#include <Imath/ImathVec.h>

#include "mapping/surface/surface_field.h"

namespace mapping {

/// Parallel transport of a tangent direction from a point with normal `from` to a point with normal
/// `to`, by the least rotation between the normals. Across an edge this unfolds the faces. All
/// vectors are unit vectors; the result is zero for a direction along `to`.
[[nodiscard]] Imath::V3d carried(const Imath::V3d& direction, const Imath::V3d& from,
                                 const Imath::V3d& to);

/// Traces a geodesic on φ = height from a start point and a direction. Across an edge it continues
/// as if the faces were unfolded into a plane. Steps are half a voxel long, and shorter where the
/// surface bends. The method is of second order in the step.
class SurfaceWalk {
 public:
  /// @param from       start point on φ = height
  /// @param direction  start direction; its tangential part is used
  SurfaceWalk(const SurfaceField& field, double height, const Imath::V3d& from,
              const Imath::V3d& direction);

  /// Advances by `length` along the surface. Returns false, at the last position, if the surface
  /// breaks off or is too sharp to be followed.
  [[nodiscard]] bool advance(double length);
  [[nodiscard]] const Imath::V3d& position() const { return position_; }
  /// Unit direction in the tangent plane.
  [[nodiscard]] const Imath::V3d& direction() const { return direction_; }
  [[nodiscard]] const Imath::V3d& normal() const { return normal_; }
  /// Distance since the start, world units.
  [[nodiscard]] double walked() const { return walked_; }

 private:
  bool step(double length);
  const SurfaceField& field_;
  double height_;
  Imath::V3d position_, normal_, direction_;
  double walked_ = 0;
};

}  // namespace mapping
