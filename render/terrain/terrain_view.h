#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "render/camera.h"

namespace render {

/// Decides for a camera which boxes of ground are visible, and how wrong heights in them may be.
class TerrainView {
 public:
  /// Set of planes of the frustum that a box may cross; bit n stands for plane n.
  using Planes = unsigned;
  static constexpr Planes kAllPlanes = 63;

  /// @param pixelError  largest distance in the picture between a ground point and the drawn point
  ///                    above or below it, pixels
  /// @pre the camera is valid, and the error is positive and finite
  TerrainView(const Camera& camera, double pixelError);

  /// Tests a box against planes of the frustum [AssarssonMoller00]. The test is conservative: it
  /// may also keep boxes near the frustum's edges.
  /// @param planes  planes that the box around this box crosses
  /// @return the planes that the box crosses; unset: the box is outside or empty
  [[nodiscard]] std::optional<Planes> crossed(const Imath::Box3d& box, Planes planes) const;

  /// Largest vertical error of points in a box that keeps the pixel error, world units. It holds
  /// for all points of the box that are in the picture, if their approximations are in the box.
  [[nodiscard]] double allowedError(const Imath::Box3d& box) const;

 private:
  struct Plane {  // the visible side has normal · p >= offset, relative to the eye
    Imath::V3d normal;
    double offset = 0;
  };
  std::array<Plane, 6> planes_;
  Imath::V3d eye_, axis_;
  bool isPerspective_ = true;
  double pixelError_ = 0, near_ = 0;
  double pixelsPerSlope_ = 0;  // pixels of a unit length at unit depth, or at any in parallel views
  double widestSlope_ = 0;     // largest distance / depth of a point in the picture
};

}  // namespace render
