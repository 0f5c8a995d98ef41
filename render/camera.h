#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <optional>

namespace render {

/// Looks from a point to a point; perspective with a vertical field of view, or orthographic.
struct Camera {
  Imath::V3d from{0, -5, 0}, to{0, 0, 0}, up{0, 1, 0};
  double verticalFov = 0.6108652381980153;  ///< radians, (0, π)
  std::optional<double> orthoHeight = {};   ///< world units; set: orthographic
  int width = 1024, height = 1024;          ///< pixels

  struct Ray {
    Imath::V3d origin, direction;  ///< direction of unit length
  };
  /// Through image position (x, y) in pixels, (0, 0) the upper left corner, +y down.
  [[nodiscard]] Ray ray(double x, double y) const;
  /// Unit view axis, towards `to`.
  [[nodiscard]] Imath::V3d axis() const;
  [[nodiscard]] Imath::M44d worldToCamera() const;
  [[nodiscard]] Imath::M44d worldToNdc() const;
};

/// @throws levelset::UsageError when from equals to, up is parallel to the view, or a size is not positive
void validate(const Camera& camera);

/// A three-quarter view that frames the box, width × height pixels.
[[nodiscard]] Camera framingCamera(const Imath::Box3d& bounds, int width, int height,
                                   double verticalFov = 0.6108652381980153);

}  // namespace render
