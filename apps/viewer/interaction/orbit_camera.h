#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "render/camera.h"

namespace viewer {

/// A camera that the user moves: around its target, parallel to the picture, and forwards or
/// backwards. Picture positions are pixels, (0, 0) is the upper left corner, +y points down. Moves
/// that would overflow are ignored.
class OrbitCamera {
 public:
  OrbitCamera() = default;
  /// @param camera  initial camera; unchanged to the last bit until it is moved
  explicit OrbitCamera(const render::Camera& camera);

  /// Camera for a picture of that size, pixels; sizes below 1 count as 1.
  [[nodiscard]] render::Camera camera(int width, int height) const;

  /// Turns around the target: to the right, and up at most to the poles; radians.
  void orbit(double right, double up);
  /// Moves so that the point seen at `from`, at that depth along the view axis (world units),
  /// appears at `to`.
  void pan(const Imath::V2d& from, const Imath::V2d& to, double depth, int width, int height);
  /// Approaches for a factor below 1, recedes for a factor above 1. The point seen at `place`, at
  /// that depth, stays at its position in the picture.
  void zoom(double factor, const Imath::V2d& place, double depth, int width, int height);
  /// Makes this point the target, which moves to the centre of the picture.
  void centreOn(const Imath::V3d& point);

  /// Frames the entire box from the present direction.
  void frame(const Imath::Box3d& bounds, int width, int height);
  /// Looks along the negative direction (± x, y or z) at the same target, from the same distance.
  void lookAgainst(const Imath::V3d& direction);
  /// Toggles between perspective and orthographic projection; the size of the target stays.
  void toggleOrtho();
  [[nodiscard]] bool isOrtho() const { return camera_.orthoHeight.has_value(); }

  /// Depth of the target along the view axis, world units.
  [[nodiscard]] double targetDepth() const { return (camera_.to - camera_.from).length(); }

 private:
  void setDirection(const Imath::V3d& toEye, const Imath::V3d& up);
  /// Accepts the change if the camera is valid.
  void take(const render::Camera& changed);

  render::Camera camera_;
  Imath::V3d vertical_{0, 1, 0};  // unit axis of orbit()
};

}  // namespace viewer
