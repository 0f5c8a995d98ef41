#include "render/camera.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::V3d;

/// Right-handed axes of the image plane: right, up, and forward into the scene.
struct CameraAxes {
  V3d right, up, forward;
};

CameraAxes axesOf(const Camera& camera) {
  CameraAxes axes;
  axes.forward = (camera.to - camera.from).normalized();
  axes.right = axes.forward.cross(camera.up).normalized();
  axes.up = axes.right.cross(axes.forward);
  return axes;
}

/// Half extents of the picture: on the plane at unit depth (perspective), or in world units
/// (orthographic).
struct HalfExtent {
  double x, y;
};

HalfExtent halfExtentOf(const Camera& camera) {
  const double y =
      camera.orthoHeight ? 0.5 * *camera.orthoHeight : std::tan(0.5 * camera.verticalFov);
  return {y * camera.width / camera.height, y};
}

bool isFinite(const V3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

std::string text(const V3d& v) {
  return fmt::format("{},{},{}", v.x, v.y, v.z);
}

}  // namespace

Camera::Ray Camera::ray(double x, double y) const {
  return CameraRays(*this).at(x, y);
}

CameraRays::CameraRays(const Camera& camera) : camera_(camera) {
  const CameraAxes axes = axesOf(camera);
  const HalfExtent half = halfExtentOf(camera);
  right_ = axes.right;
  up_ = axes.up;
  forward_ = axes.forward;
  halfWidth_ = half.x;
  halfHeight_ = half.y;
}

Camera::Ray CameraRays::at(double x, double y) const {
  const V3d shift = right_ * ((2 * (x - camera_.axisShift) / camera_.width - 1) * halfWidth_) +
                    up_ * ((1 - 2 * y / camera_.height) * halfHeight_);
  const double end = camera_.farthest();
  if (camera_.orthoHeight) return {camera_.from + shift, forward_, camera_.near, end};
  const V3d along = forward_ + shift;  // its component along the view axis is 1
  const double length = along.length();
  return {camera_.from, along.normalized(), camera_.near * length,
          camera_.far ? end * length : end};
}

Camera::PixelSteps Camera::pixelSteps() const {
  const CameraAxes axes = axesOf(*this);
  const HalfExtent half = halfExtentOf(*this);
  return {axes.right * (2 * half.x / width), axes.up * (-2 * half.y / height)};
}

V3d Camera::axis() const {
  return (to - from).normalized();
}

Imath::M44d Camera::worldToCamera() const {
  const CameraAxes axes = axesOf(*this);
  const V3d columns[3] = {axes.right, axes.up, axes.forward};
  Imath::M44d m;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) m[i][j] = columns[j][i];
    m[3][j] = -from.dot(columns[j]);
  }
  return m;
}

Imath::M44d Camera::worldToNdc() const {
  const HalfExtent half = halfExtentOf(*this);
  const double sx = 0.5 / half.x, sy = -0.5 / half.y;
  // Programs that read the matrix discard the third coordinate; the third row and column only keep
  // the matrix invertible.
  const Imath::M44d perspective(sx, 0, 0, 0, 0, sy, 0, 0, 0.5 + axisShift / width, 0.5, 1, 1, 0, 0,
                                -1, 0);
  const Imath::M44d orthographic(sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 0, 1);
  return worldToCamera() * (orthoHeight ? orthographic : perspective);
}

void validate(const Camera& camera) {
  using levelset::UsageError;
  if (camera.width <= 0 || camera.height <= 0) {
    throw UsageError(
        fmt::format("camera: an image of {}x{} pixels is empty; give "
                    "a positive width and height",
                    camera.width, camera.height));
  }
  if (static_cast<double>(camera.width) * camera.height > kMaxPixels) {
    throw levelset::ResourceLimit(
        fmt::format("camera: an image of {}x{} pixels exceeds the limit of "
                    "{:.0f} pixels; choose a smaller size",
                    camera.width, camera.height, kMaxPixels));
  }
  if (!isFinite(camera.from) || !isFinite(camera.to) || !isFinite(camera.up)) {
    throw UsageError(
        fmt::format("camera: from {}, to {}, up {} must be finite; give finite "
                    "points",
                    text(camera.from), text(camera.to), text(camera.up)));
  }
  const V3d view = camera.to - camera.from;
  if (!(view.length() > 0)) {
    throw UsageError(fmt::format("camera: the points from and to are both {}; move one of them",
                                 text(camera.to)));
  }
  const V3d across = view.normalized().cross(camera.up);
  if (!(across.length() > 1e-9 * camera.up.length())) {
    throw UsageError(
        fmt::format("camera: the vector up, {}, is parallel to the view from {} to {}; choose "
                    "another up",
                    text(camera.up), text(camera.from), text(camera.to)));
  }
  if (!std::isfinite(camera.axisShift) || (camera.orthoHeight && camera.axisShift != 0))
    throw UsageError(fmt::format(
        "camera: a shift of the view axis by {} pixels needs a view in perspective, and "
        "a finite number",
        camera.axisShift));
  if (camera.orthoHeight) {
    if (!(*camera.orthoHeight > 0) || !std::isfinite(*camera.orthoHeight)) {
      throw UsageError(fmt::format("camera: the orthographic height {} must be a positive length",
                                   *camera.orthoHeight));
    }
  } else if (!(camera.verticalFov > 0 && camera.verticalFov < std::numbers::pi)) {
    throw UsageError(
        fmt::format("camera: the field of view of {} degrees must lie between 0 and 180",
                    camera.verticalFov * 180 / std::numbers::pi));
  }
  if (!(camera.near >= 0) || !(camera.farthest() > camera.near) ||
      !std::isfinite(camera.farthest())) {
    throw UsageError(
        fmt::format("camera: the depth range from {} to {} is empty; give a "
                    "near plane at 0 or more, and a far plane behind it",
                    camera.near, camera.farthest()));
  }
}

std::array<Camera, 2> stereoCameras(const Camera& camera, double eyeDistance, double screenDepth) {
  if (camera.orthoHeight)
    throw levelset::UsageError(
        "a stereo picture needs a view in perspective, but the view is orthographic; leave --ortho "
        "out");
  for (const auto& [name, length] :
       {std::pair("eye-distance", eyeDistance), {"screen-depth", screenDepth}})
    if (!(length > 0) || !std::isfinite(length))
      throw levelset::UsageError(
          fmt::format("--{} {} is not a positive length; give one in world units", name, length));
  const Camera::PixelSteps step = camera.pixelSteps();
  const double width = step.right.length();  // width of a pixel at unit depth
  const V3d right = step.right / width;
  std::array<Camera, 2> eyes{camera, camera};
  for (int n = 0; n < 2; ++n) {
    const double offset = (n == 0 ? -0.5 : 0.5) * eyeDistance;
    Camera& eye = eyes[static_cast<std::size_t>(n)];
    eye.from += right * offset;
    eye.to += right * offset;
    eye.axisShift += offset / (screenDepth * width);
    constexpr double kMostShift = 64;  // widths of the picture, where single precision suffices
    if (!(std::abs(eye.axisShift) <= kMostShift * camera.width))
      throw levelset::UsageError(
          fmt::format("--eye-distance {} at --screen-depth {} shifts the views by more than {} "
                      "widths of the picture; give a smaller distance or a larger depth",
                      eyeDistance, screenDepth, kMostShift));
  }
  return eyes;
}

namespace {

/// Direction from the target to the camera in the default view, rotated from the up vector y to
/// `up`.
V3d viewFrom(const V3d& up) {
  const V3d view(0.45, 0.35, 1);
  const double length = up.length();
  if (!(length > 0) || !std::isfinite(length))
    throw levelset::UsageError(
        "camera: the vector up is zero or not finite; give for example 0,1,0");
  const V3d y = up / length;
  if (y == V3d(0, 1, 0)) return view;
  // The front of the scene, which the camera sees, faces z, made perpendicular to `up`. If `up` is
  // close to z, the front faces -y; if close to -z, y.
  const V3d front = std::abs(y.z) < 0.9 ? V3d(0, 0, 1) : V3d(0, y.z > 0 ? -1 : 1, 0);
  const V3d x = y.cross(front).normalized();
  return x * view.x + y * view.y + x.cross(y) * view.z;
}

/// Position of a camera from which points fit between two slopes ±k on an image axis.
struct Fit {
  double back;   ///< distance from the target, world units
  double shift;  ///< of the target along the image axis, world units
};

/// Fits points between several pairs of slopes. Consider a camera at distance `back` from the
/// target, shifted by s along the axis. It sees a point with coordinate x on that axis, `depth`
/// behind the target, at a slope within ±k when |x − s| <= k (back + depth). This is linear in s
/// and back, so both have a closed form.
std::vector<Fit> fits(const Extents& extents, const V3d& target, const V3d& along,
                      const V3d& forward, const std::vector<double>& slopes) {
  std::vector<V3d> directions;
  for (const double k : slopes)
    for (const double side : {1.0, -1.0}) directions.push_back(along * side - forward * k);
  const std::vector<double> extent = extents(directions);
  std::vector<Fit> found;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const double upper = extent[2 * i] - target.dot(directions[2 * i]),
                 lower = extent[2 * i + 1] - target.dot(directions[2 * i + 1]);
    found.push_back({0.5 * (upper + lower) / slopes[i], 0.5 * (upper - lower)});
  }
  return found;
}

/// Camera that frames points, see framingCamera(). @param isCentred  centre the points also on the
/// axis on which they do not fill the picture
Camera framing(const Imath::Box3d& bounds, const Extents& extents, int width, int height,
               double verticalFov, const V3d& up, bool isCentred) {
  if (bounds.isEmpty() || !isFinite(bounds.min) || !isFinite(bounds.max)) {
    throw levelset::UsageError(
        "camera: the scene has no surface to frame; give the view with --from");
  }
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.verticalFov = verticalFov;
  camera.to = bounds.center();
  camera.up = up;
  camera.from = camera.to + viewFrom(up);
  validate(camera);

  const CameraAxes axes = axesOf(camera);
  const HalfExtent half = halfExtentOf(camera);
  constexpr double kMargin = 0.94;  // share of the picture that the points fill
  const V3d along[2] = {axes.right, axes.up};
  const double widest[2] = {kMargin * half.x, kMargin * half.y};
  // On each axis the points fit at some distance. The larger distance counts. On the other axis the
  // points then fill a smaller share of the picture, whose middle they must be in.
  double back = 0, shift[2];
  std::size_t binding = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Fit fit = fits(extents, camera.to, along[axis], axes.forward, {widest[axis]})[0];
    shift[axis] = fit.shift;
    if (fit.back > back) binding = axis;
    back = std::max(back, fit.back);
  }
  const std::size_t other = 1 - binding;
  double low = 0, high = widest[other];
  constexpr int kRounds = 3, kSlopes = 8;
  for (int round = 0; isCentred && round < kRounds && back > 0; ++round) {
    std::vector<double> slopes;
    for (int n = 1; n <= kSlopes; ++n) slopes.push_back(low + (high - low) * n / kSlopes);
    const std::vector<Fit> found = fits(extents, camera.to, along[other], axes.forward, slopes);
    std::size_t n = 0;
    while (n + 1 < found.size() && found[n].back > back) ++n;
    shift[other] = found[n].shift;
    high = slopes[n];
    low = n > 0 ? slopes[n - 1] : low;
  }
  const double size = bounds.size().length();
  if (!(back > 0)) back = size > 0 ? size : 1;
  camera.to += axes.right * shift[0] + axes.up * shift[1];
  camera.from = camera.to - axes.forward * back;
  validate(camera);
  return camera;
}

}  // namespace

double extentOf(const Imath::Box3d& box, const V3d& direction) {
  double extent = 0;
  for (int a = 0; a < 3; ++a) extent += direction[a] * (direction[a] > 0 ? box.max[a] : box.min[a]);
  return extent;
}

Camera framingCamera(const Imath::Box3d& bounds, int width, int height, double verticalFov,
                     const V3d& up) {
  const Extents extents = [&](const std::vector<V3d>& directions) {
    std::vector<double> all;
    for (const V3d& d : directions) all.push_back(extentOf(bounds, d));
    return all;
  };
  return framing(bounds, extents, width, height, verticalFov, up, false);
}

Camera framingCamera(const Imath::Box3d& bounds, const Extents& extents, int width, int height,
                     double verticalFov, const V3d& up) {
  return framing(bounds, extents, width, height, verticalFov, up, true);
}

}  // namespace render
