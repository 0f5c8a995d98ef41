#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace render {

/// A camera that looks from one point at another, in perspective or orthographic projection.
struct Camera {
  static constexpr double kNoDepth =
      1e300;  ///< stands for an unlimited depth; larger than every depth of a surface
  Imath::V3d from{0, 0, 5}, to{0, 0, 0}, up{0, 1, 0};
  double verticalFov = 0.6108652381980153;  ///< vertical field of view, radians, in (0, π)
  std::optional<double> orthoHeight =
      {};  ///< height of an orthographic view, world units; unset: perspective
  /// Visible depth range, world units along the view axis. `near` is at least 0, `far`
  /// is above `near` or unset (no end). Surfaces outside the range are invisible but still cast
  /// shadows.
  double near = 0;
  std::optional<double> far = {};
  int width = 1024, height = 1024;  ///< size of the picture, pixels
  /// Distance of the view axis to the right of the middle of the picture, pixels. Other than 0 for
  /// the eyes of a stereo picture, whose frusta are asymmetric. Not in an orthographic view.
  double axisShift = 0;
  /// Horizontal position of the view axis in the picture, pixels.
  [[nodiscard]] double middleX() const { return 0.5 * width + axisShift; }

  struct Ray {
    Imath::V3d origin, direction;  ///< direction of unit length
    /// Visible interval: distances along the direction, world units.
    double near = 0, far = kNoDepth;
  };
  /// Ray through the image position (x, y) in pixels; (0, 0) is the upper left corner of the image,
  /// +y points down.
  [[nodiscard]] Ray ray(double x, double y) const;
  [[nodiscard]] double farthest() const { return far.value_or(kNoDepth); }
  /// Unit view axis, towards `to`.
  [[nodiscard]] Imath::V3d axis() const;
  /// World-space vectors from one pixel to the next pixel to the right and to the next pixel below.
  /// In perspective they are measured on the plane at unit depth, otherwise in world units.
  struct PixelSteps {
    Imath::V3d right, down;
  };
  [[nodiscard]] PixelSteps pixelSteps() const;
  /// Matrix to OpenEXR's camera space: x right, y up, z along the view. Vectors are rows: `camera =
  /// world * matrix`.
  [[nodiscard]] Imath::M44d worldToCamera() const;
  /// Matrix to OpenEXR's normalised device space: (0, 0) is the upper left corner, (1, 1) the lower
  /// right one.
  [[nodiscard]] Imath::M44d worldToNdc() const;
};

/// Rays of a camera. Its axes are computed once, and the rays have the bits of Camera::ray().
/// @pre the camera outlives the object
class CameraRays {
 public:
  explicit CameraRays(const Camera& camera);
  [[nodiscard]] Camera::Ray at(double x, double y) const;
  /// As Camera::axis().
  [[nodiscard]] const Imath::V3d& axis() const { return forward_; }

 private:
  const Camera& camera_;
  Imath::V3d right_, up_, forward_;
  double halfWidth_, halfHeight_;
};

/// Cameras of the left and the right eye, with parallel axes. A point at the depth `screenDepth`
/// has the same position in both pictures. A point at depth Z is further to the right in the left
/// one, by eyeDistance (1/Z − 1/screenDepth) over the width of a pixel at unit depth.
/// @param camera  between the eyes
/// @param eyeDistance, screenDepth  world units, positive
/// @throws levelset::UsageError for an orthographic camera, and lengths that are not positive
[[nodiscard]] std::array<Camera, 2> stereoCameras(const Camera& camera, double eyeDistance,
                                                  double screenDepth);

/// Largest number of pixels of an image; larger images are refused.
inline constexpr double kMaxPixels = 268435456;  // 2^28

/// Checks a camera.
/// @throws levelset::UsageError when a number is not finite, `from` equals `to`, or `up` is
///         parallel to the view. Also when the field of view, the height or the depths are out of
///         range, or a size is not positive.
/// @throws levelset::ResourceLimit for more than kMaxPixels pixels
void validate(const Camera& camera);

/// Camera that frames the box, for any ratio of width to height. It looks from the upper right
/// front; `up` is the upward direction.
/// @throws levelset::UsageError when the box is empty, and for the reasons of validate()
[[nodiscard]] Camera framingCamera(const Imath::Box3d& bounds, int width, int height,
                                   double verticalFov = 0.6108652381980153,
                                   const Imath::V3d& up = {0, 1, 0});

/// Extent of a box: the largest p·direction over its points p. @pre the box is not empty
[[nodiscard]] double extentOf(const Imath::Box3d& box, const Imath::V3d& direction);

/// Extents of a set of points: returns for each direction d the largest p·d over its points p.
using Extents = std::function<std::vector<double>(const std::vector<Imath::V3d>& directions)>;

/// Camera that frames a set of points, seen from the same direction. Unlike the corners of a box,
/// the points are in the middle of the picture on both axes.
/// @param bounds  box of the points; @param extents  extents of the points, world units
/// @throws as framingCamera() for a box
[[nodiscard]] Camera framingCamera(const Imath::Box3d& bounds, const Extents& extents, int width,
                                   int height, double verticalFov, const Imath::V3d& up);

}  // namespace render
