#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "render/camera.h"

namespace viewer {

/// A camera that the user moves: around its target, parallel to the picture plane, and forwards or
/// backwards. Positions in the picture are in pixels; (0, 0) is the upper left corner, +y points
/// down. A move that makes the camera invalid, as by overflow, is ignored.
class OrbitCamera {
 public:
  OrbitCamera() = default;
  /// @param camera  initial camera; camera() returns its bits unchanged until the first move
  explicit OrbitCamera(const render::Camera& camera);

  /// Present camera for a picture of the given size in pixels. Sizes below 1 count as 1.
  [[nodiscard]] render::Camera camera(int width, int height) const;

  /// Turns the camera around its target by angles in radians, to the right and up. It stops at the
  /// poles, where it looks along the vertical.
  void orbit(double right, double up);
  /// Moves the camera so that the point seen at picture position `from` appears at `to`.
  /// @param depth  depth of the point along the view axis, world units
  void pan(const Imath::V2d& from, const Imath::V2d& to, double depth, int width, int height);
  /// Approaches for a factor below 1, recedes for a factor above 1. The point seen at picture
  /// position `place` stays there. @param depth  depth of the point along the view axis, world
  /// units
  void zoom(double factor, const Imath::V2d& place, double depth, int width, int height);
  /// Makes `point` (world space) the target, so that it moves to the centre of the picture.
  void centreOn(const Imath::V3d& point);

  /// Moves the camera so that the entire box is visible, without a change of the view direction.
  void frame(const Imath::Box3d& bounds, int width, int height);
  /// Turns the camera around its target, at the same distance, so that `direction` points from the
  /// target to the eye. For example, {1, 0, 0} shows the side of the target that faces +x.
  void lookAgainst(const Imath::V3d& direction);
  /// Toggles between perspective and orthographic projection. The target keeps its size in the
  /// picture.
  void toggleOrtho();
  [[nodiscard]] bool isOrtho() const { return camera_.orthoHeight.has_value(); }

  /// Depth of the target along the view axis, world units.
  [[nodiscard]] double targetDepth() const { return (camera_.to - camera_.from).length(); }

 private:
  void setDirection(const Imath::V3d& toEye, const Imath::V3d& up);
  /// Replaces the present camera by `changed` if that is valid.
  void take(const render::Camera& changed);

  render::Camera camera_;
  // Unit vector towards the upper pole of orbit(): up direction of the initial camera.
  Imath::V3d vertical_{0, 1, 0};
};

}  // namespace viewer
