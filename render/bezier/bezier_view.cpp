#include "render/bezier/bezier_view.h"

#include <algorithm>
#include <cmath>

namespace render {

using Imath::V3d;

BezierView::BezierView(const Camera& camera)
    : eye(camera.from),
      axis(camera.axis()),
      isPerspective(!camera.orthoHeight),
      near(camera.near),
      far(camera.farthest()),
      middle(camera.middleX(), 0.5 * camera.height),
      reach(std::max(middle.x, camera.width - middle.x), middle.y) {
  const Camera::PixelSteps steps = camera.pixelSteps();
  step = {steps.right.length(), steps.down.length()};
  right = steps.right / step.x;
  down = steps.down / step.y;
}

BezierView::BezierView(const Camera::Ray& ray)
    : eye(ray.origin), axis(ray.direction), near(ray.near), far(ray.far) {
  // The coordinate axis that is farthest from the ray gives a well conditioned frame.
  int least = 0;
  for (int c = 1; c < 3; ++c)
    if (std::abs(axis[c]) < std::abs(axis[least])) least = c;
  V3d other(0);
  other[least] = 1;
  right = axis.cross(other).normalized();
  down = axis.cross(right);
}

}  // namespace render
