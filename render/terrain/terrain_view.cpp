#include "render/terrain/terrain_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace render {
namespace {

using Imath::Box3d;
using Imath::V3d;

/// Distances along x and y from the origin to the nearest and to the farthest point of a range.
double nearestOf(double low, double high) {
  return low > 0 ? low : high < 0 ? -high : 0;
}
double farthestOf(double low, double high) {
  return std::max(std::abs(low), std::abs(high));
}

}  // namespace

TerrainView::TerrainView(const Camera& camera, double pixelError)
    : eye_(camera.from),
      axis_(camera.axis()),
      isPerspective_(!camera.orthoHeight),
      pixelError_(pixelError),
      near_(camera.near) {
  const Camera::PixelSteps steps = camera.pixelSteps();
  const double pixelWidth = steps.right.length(), pixelHeight = steps.down.length();
  const V3d right = steps.right / pixelWidth, up = steps.down / -pixelHeight;
  const double left = camera.middleX() * pixelWidth,
               rest = (camera.width - camera.middleX()) * pixelWidth,
               half = 0.5 * camera.height * pixelHeight;
  const auto side = [&](const V3d& inward, double extent) {
    return isPerspective_ ? Plane{inward + axis_ * extent, 0} : Plane{inward, -extent};
  };
  planes_ = {side(right, left),
             side(-right, rest),
             side(up, half),
             side(-up, half),
             Plane{axis_, camera.near},
             Plane{-axis_, camera.far ? -*camera.far : -std::numeric_limits<double>::infinity()}};
  pixelsPerSlope_ = 1 / std::min(pixelWidth, pixelHeight);
  const double widest = std::max(std::abs(left), std::abs(rest));
  widestSlope_ = std::sqrt(1 + widest * widest + half * half);
}

std::optional<TerrainView::Planes> TerrainView::crossed(const Box3d& box, Planes planes) const {
  if (box.isEmpty()) return std::nullopt;
  const Box3d relative(box.min - eye_, box.max - eye_);
  Planes left = 0;
  for (std::size_t n = 0; n < planes_.size(); ++n) {
    if ((planes & 1u << n) == 0) continue;
    const Plane& plane = planes_[n];
    if (extentOf(relative, plane.normal) < plane.offset) return std::nullopt;
    if (-extentOf(relative, -plane.normal) < plane.offset) left |= 1u << n;
  }
  return left;
}

// A point p and a point q above or below it at the distance e, in coordinates of the camera with
// the depth z, have the distance f e |s| / (p.z q.z) in the picture. Here f is the number of pixels
// of a unit length at unit depth, u the vertical, and s the two components of p × u across the
// axis. So |s| is at most |p|, and at most the horizontal distance of p. In the picture |p| <= c
// p.z, with c = widestSlope_.
double TerrainView::allowedError(const Box3d& box) const {
  const Box3d b(box.min - eye_, box.max - eye_);
  if (!isPerspective_) {
    const double seen = pixelsPerSlope_ * std::sqrt(std::max(0.0, 1 - axis_.z * axis_.z));
    return seen > 0 ? pixelError_ / seen : std::numeric_limits<double>::infinity();
  }
  const double distance =
      V3d(nearestOf(b.min.x, b.max.x), nearestOf(b.min.y, b.max.y), nearestOf(b.min.z, b.max.z))
          .length();
  const double across = std::hypot(farthestOf(b.min.x, b.max.x), farthestOf(b.min.y, b.max.y));
  const double leastDepth = -extentOf(b, -axis_);  // of all points of the box
  const double depth = std::max({distance / widestSlope_, near_, leastDepth});
  if (!(depth > 0)) return 0;
  const double slope = pixelsPerSlope_ * std::min(widestSlope_, across / depth);
  // The other point is at least at the depth `leastDepth`, and at least at depth - e |axis.z|.
  const double byStep = pixelError_ * depth / (slope + pixelError_ * std::abs(axis_.z));
  const double byBox = leastDepth > 0 ? pixelError_ * leastDepth / slope : 0;
  return std::max(byStep, byBox);
}

}  // namespace render
