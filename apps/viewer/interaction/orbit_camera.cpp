#include "apps/viewer/interaction/orbit_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"

namespace viewer {
namespace {

using Imath::V2d;
using Imath::V3d;

// Angle, radians. If the view direction is closer to ±vertical_, the picture's up direction
// determines the azimuth.
constexpr double kNearestPole = 1e-9;

constexpr double kFramed = 0.94;  // share of the picture that a framed box fills

/// World position of the point that appears at the picture position `place` (pixels) and has the
/// given depth along the view axis, world units.
V3d worldAt(const render::Camera& camera, const V2d& place, double depth) {
  const render::Camera::Ray ray = camera.ray(place.x, place.y);
  return ray.origin + ray.direction * (depth / ray.direction.dot(camera.axis()));
}

}  // namespace

OrbitCamera::OrbitCamera(const render::Camera& camera)
    : camera_(camera), vertical_(camera.up.normalized()) {}

render::Camera OrbitCamera::camera(int width, int height) const {
  render::Camera camera = camera_;
  camera.width = std::max(width, 1);
  camera.height = std::max(height, 1);
  return camera;
}

void OrbitCamera::take(const render::Camera& changed) {
  try {
    render::validate(changed);
  } catch (const levelset::Error&) {
    return;  // the change overflowed: keep the present camera
  }
  camera_ = changed;
}

void OrbitCamera::setDirection(const V3d& toEye, const V3d& up) {
  render::Camera changed = camera_;
  changed.from = camera_.to + toEye * targetDepth();
  changed.up = up;
  take(changed);
}

void OrbitCamera::orbit(double right, double up) {
  const V3d forward = camera_.axis();
  const V3d screenUp = forward.cross(camera_.up).normalized().cross(forward);
  const double sine = std::clamp(-forward.dot(vertical_), -1.0, 1.0);
  // Direction away from the eye, perpendicular to vertical_. If the view direction is ±vertical_,
  // it follows from the picture's up direction.
  V3d ahead = forward + vertical_ * sine;
  if (ahead.length() < kNearestPole) ahead = screenUp * (sine > 0 ? 1 : -1);
  ahead.normalize();
  const V3d side = ahead.cross(vertical_);
  const V3d turned = ahead * std::cos(right) - side * std::sin(right);
  constexpr double kPole = std::numbers::pi / 2;
  const double elevation = std::clamp(std::asin(sine) + up, -kPole, kPole);
  setDirection(vertical_ * std::sin(elevation) - turned * std::cos(elevation),
               vertical_ * std::cos(elevation) + turned * std::sin(elevation));
}

void OrbitCamera::pan(const V2d& from, const V2d& to, double depth, int width, int height) {
  const render::Camera seen = camera(width, height);
  const V3d shift = worldAt(seen, from, depth) - worldAt(seen, to, depth);
  render::Camera changed = camera_;
  changed.from += shift;
  changed.to += shift;
  take(changed);
}

void OrbitCamera::zoom(double factor, const V2d& place, double depth, int width, int height) {
  if (!(factor > 0)) return;
  const V3d fixed = worldAt(camera(width, height), place, depth);
  render::Camera changed = camera_;
  if (!changed.orthoHeight) {
    changed.from = fixed + (changed.from - fixed) * factor;
    changed.to = fixed + (changed.to - fixed) * factor;
  } else {
    // In orthographic projection the eye keeps its depth, so that it does not enter the surface.
    const V3d axis = changed.axis();
    V3d shift = (fixed - changed.to) * (1 - factor);
    shift -= axis * shift.dot(axis);
    changed.from += shift;
    changed.to += shift;
    changed.orthoHeight = *changed.orthoHeight * factor;
  }
  take(changed);
}

void OrbitCamera::centreOn(const V3d& point) {
  render::Camera changed = camera_;
  changed.from += point - changed.to;
  changed.to = point;
  take(changed);
}

void OrbitCamera::frame(const Imath::Box3d& bounds, int width, int height) {
  if (bounds.isEmpty()) return;
  const V3d axis = camera_.axis(), right = axis.cross(camera_.up).normalized(),
            up = right.cross(axis), half = 0.5 * bounds.size();
  const double aspect = static_cast<double>(std::max(width, 1)) / std::max(height, 1);
  const double slopeY = kFramed * std::tan(0.5 * camera_.verticalFov), slopeX = slopeY * aspect;
  // Smallest values for which all corners of the box are visible: distance of the eye from the
  // centre of the box, and half height of an orthographic view.
  double distance = 1e-9, extent = 1e-9;
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p(corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y,
                corner & 4 ? half.z : -half.z);
    const double x = std::abs(p.dot(right)), y = std::abs(p.dot(up));
    distance = std::max(distance, std::max(x / slopeX, y / slopeY) - p.dot(axis));
    extent = std::max(extent, std::max(x / aspect, y));
  }
  render::Camera changed = camera_;
  changed.to = bounds.center();
  if (changed.orthoHeight) {
    changed.orthoHeight = 2 * extent / kFramed;
    distance = std::max(distance, half.length());
  }
  changed.from = changed.to - axis * distance;
  take(changed);
}

void OrbitCamera::lookAgainst(const V3d& direction) {
  const V3d toEye = direction.normalized();
  V3d up = vertical_;
  if (std::abs(toEye.dot(vertical_)) > 1 - 1e-9) {
    // View from above or below: the direction that leads away from the eye in a front view becomes
    // the up direction.
    const V3d front = std::abs(vertical_.z) < 0.9 ? V3d(0, 0, -1) : V3d(0, 1, 0);
    up = front - toEye * front.dot(toEye);
  }
  setDirection(toEye, up);
}

void OrbitCamera::toggleOrtho() {
  render::Camera changed = camera_;
  const double slope = std::tan(0.5 * changed.verticalFov);
  if (changed.orthoHeight) {
    const V3d axis = changed.axis();
    changed.from = changed.to - axis * (0.5 * *changed.orthoHeight / slope);
    changed.orthoHeight.reset();
  } else {
    changed.orthoHeight = 2 * targetDepth() * slope;
  }
  take(changed);
}

}  // namespace viewer
