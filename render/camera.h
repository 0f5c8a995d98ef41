#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <optional>

namespace render {

/// Looks from a point to a point; perspective with a vertical field of view, or orthographic.
struct Camera {
  static constexpr double kNoDepth = 1e300;  ///< farther than anything
  Imath::V3d from{0, 0, 5}, to{0, 0, 0}, up{0, 1, 0};
  double verticalFov = 0.6108652381980153;  ///< radians, (0, π)
  std::optional<double> orthoHeight = {};   ///< world units; set: orthographic
  /// World units along the view axis: what is nearer or farther is not seen, but lighted through.
  /// 0 or more, and unset, which is no end, or beyond `near`.
  double near = 0;
  std::optional<double> far = {};
  int width = 1024, height = 1024;  ///< pixels

  struct Ray {
    Imath::V3d origin, direction;     ///< direction of unit length
    double near = 0, far = kNoDepth;  ///< what of it sees, along the direction
  };
  /// Through image position (x, y) in pixels, (0, 0) the upper left corner, +y down.
  [[nodiscard]] Ray ray(double x, double y) const;
  [[nodiscard]] double farthest() const { return far.value_or(kNoDepth); }
  /// Unit view axis, towards `to`.
  [[nodiscard]] Imath::V3d axis() const;
  /// What a pixel to the right and one down are on the plane at unit depth (perspective), or in
  /// world units (orthographic).
  struct PixelSteps {
    Imath::V3d right, down;
  };
  [[nodiscard]] PixelSteps pixelSteps() const;
  /// OpenEXR's camera space: x right, y up, z along the view. Row vectors: `camera = world *
  /// matrix`.
  [[nodiscard]] Imath::M44d worldToCamera() const;
  /// OpenEXR's normalised device space: (0, 0) the upper left corner, (1, 1) the lower right one.
  [[nodiscard]] Imath::M44d worldToNdc() const;
};

/// More pixels than this are refused.
inline constexpr double kMaxPixels = 268435456;  // 2^28

/// @throws levelset::UsageError when a number is not finite, from equals to, up is parallel to the
///         view, the field of view, the height or the depths are out of range, or a size is not
///         positive
/// @throws levelset::ResourceLimit for more than kMaxPixels
void validate(const Camera& camera);

/// A three-quarter view from the right, above and in front of what is up, that just frames the box,
/// at any aspect. @throws levelset::UsageError when the box is empty, and as validate()
[[nodiscard]] Camera framingCamera(const Imath::Box3d& bounds, int width, int height,
                                   double verticalFov = 0.6108652381980153,
                                   const Imath::V3d& up = {0, 1, 0});

}  // namespace render
