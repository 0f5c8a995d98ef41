#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "render/camera.h"

namespace viewer {

/// A camera that is moved by hand: around what it looks at, along the picture, and to and fro.
/// Places in the picture are pixels, (0, 0) the upper left corner, +y down. What would leave the
/// range of numbers is not done.
class OrbitCamera {
 public:
  OrbitCamera() = default;
  /// @param camera  as somebody gave it, to the last bit until it is moved
  explicit OrbitCamera(const render::Camera& camera);

  /// What is seen in a picture of that size, pixels; less than one counts as one.
  [[nodiscard]] render::Camera camera(int width, int height) const;

  /// Turns around the target: to the right, and up as far as the poles; radians.
  void orbit(double right, double up);
  /// What is seen at `from`, at that depth along the view axis (world units), comes to lie at `to`.
  void pan(const Imath::V2d& from, const Imath::V2d& to, double depth, int width, int height);
  /// Comes nearer by a factor below 1, goes away by one above: what is seen at `place`, at that
  /// depth, stays there.
  void zoom(double factor, const Imath::V2d& place, double depth, int width, int height);
  /// Turns around this point from now on, which moves into the middle of the picture.
  void centreOn(const Imath::V3d& point);

  /// All of the box is seen, from the same direction.
  void frame(const Imath::Box3d& bounds, int width, int height);
  /// Looks against a direction (x, y or z, or back), at the same target and distance.
  void lookAgainst(const Imath::V3d& direction);
  /// Changes between perspective and orthographic; the size of the target stays.
  void toggleOrtho();
  [[nodiscard]] bool isOrtho() const { return camera_.orthoHeight.has_value(); }

  /// Of the target, along the view axis, world units.
  [[nodiscard]] double targetDepth() const { return (camera_.to - camera_.from).length(); }

 private:
  void setDirection(const Imath::V3d& toEye, const Imath::V3d& up);
  /// Keeps the change if it can be seen through.
  void take(const render::Camera& changed);

  render::Camera camera_;
  Imath::V3d vertical_{0, 1, 0};  // unit; what orbit() turns about
};

}  // namespace viewer
