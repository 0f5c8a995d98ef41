#pragma once

#include <Imath/ImathVec.h>

#include "render/camera.h"

namespace render {

/// Camera in the form that the subdivision tree reads: an orthonormal frame, and screen positions
/// (x, y). In perspective a screen position is the tangent of the ray to the right and downwards,
/// otherwise an offset in world units. A point p of depth d = (p − eye)·axis is seen at
/// ((p − eye)·right / d, (p − eye)·down / d) in perspective, otherwise without the divisions.
struct BezierView {
  Imath::V3d eye{0}, right{1, 0, 0}, down{0, 1, 0}, axis{0, 0, 1};
  bool isPerspective = false;
  double near = -Camera::kNoDepth, far = Camera::kNoDepth;  ///< visible depths
  Imath::V2d step{1, 1};    ///< screen distance of neighbouring pixels
  Imath::V2d middle{0, 0};  ///< image position of the view axis, pixels
  Imath::V2d reach{0, 0};   ///< farthest distances of the picture's edges from `middle`, pixels

  /// World space: along z, with all depths.
  BezierView() = default;
  explicit BezierView(const Camera& camera);
  /// View along one ray, whose screen position is (0, 0). Depths are distances along the ray.
  explicit BezierView(const Camera::Ray& ray);

  /// Screen position of an image position in pixels.
  [[nodiscard]] Imath::V2d at(double x, double y) const {
    return {(x - middle.x) * step.x, (y - middle.y) * step.y};
  }
  /// Vector from the eye (perspective) or the plane of the eye to the point of depth 1.
  [[nodiscard]] Imath::V3d along(const Imath::V2d& screen) const {
    return isPerspective ? axis + right * screen.x + down * screen.y : axis;
  }
};

}  // namespace render
