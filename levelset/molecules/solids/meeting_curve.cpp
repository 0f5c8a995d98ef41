#include "levelset/molecules/solids/meeting_curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "levelset/geometry/perpendicular.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr double kPi = std::numbers::pi;
constexpr double kParallelRods = 1e-12;  // square of the sine between parallel axes

/// A line along a cylinder, at a position q and along w, meets a shape where
/// squared t² − 2 linear t + constant = 0.
struct LineMeeting {
  double squared = 0, linear = 0, constant = 0;
};

LineMeeting meetingOf(const V3d& q, const V3d& w, const RodShape& shape) {
  const V3d to = shape.from - q;
  if (shape.isBall()) return {1, w.dot(to), to.length2() - shape.radius * shape.radius};
  const V3d axis = (shape.to - shape.from).normalized();
  const V3d across = w - axis * axis.dot(w), off = to - axis * axis.dot(to);
  return {across.length2(), across.dot(off), off.length2() - shape.radius * shape.radius};
}

/// Angles around the cylinder at which lines meet the other shape, as middle and half width. They
/// are split where both points of a line coincide.
std::vector<std::array<double, 2>> anglesOf(const MeetingCurve& curve, const RodShape& other) {
  std::vector<std::array<double, 2>> ranges;
  const auto add = [&](double centre, double begin, double end) {
    if (end - begin > 1e-9) ranges.push_back({centre + (begin + end) / 2, (end - begin) / 2});
  };
  if (other.isBall()) {
    const V3d to = other.from - curve.origin;
    const double x = to.dot(curve.u), y = to.dot(curve.v), apart = std::hypot(x, y);
    // Squared distance of a line from the centre: r² + apart² − 2 r apart cos(angle).
    const double excess = curve.radius * curve.radius + apart * apart - other.radius * other.radius;
    const double most = 2 * curve.radius * apart;
    if (excess >= most) return ranges;
    const double half = excess <= -most ? kPi : std::acos(excess / most);
    add(std::atan2(y, x), -half, half);
    return ranges;
  }
  const V3d axis = (other.to - other.from).normalized();
  const V3d normal = curve.w.cross(axis).normalized();
  const double height = (curve.origin - other.from).dot(normal);
  const double centre = std::atan2(normal.dot(curve.v), normal.dot(curve.u));
  // Lines at the angle a from the normal are at height + r cos a from the axis of the other shape.
  const double low = (-other.radius - height) / curve.radius,
               high = (other.radius - height) / curve.radius;
  if (low >= 1 || high <= -1) return ranges;
  const double from = high >= 1 ? 0 : std::acos(high), to = low <= -1 ? kPi : std::acos(low);
  add(centre, from, to);
  add(centre, -to, -from);
  return ranges;
}

}  // namespace

V3d RodShape::onAxis(const V3d& point) const {
  const V3d along = to - from;
  const double squared = along.length2();
  if (squared == 0) return from;
  return from + along * std::clamp((point - from).dot(along) / squared, 0.0, 1.0);
}

V3d MeetingCurve::at(double number, const RodShape& a, const RodShape& b, bool& isOnBoth) const {
  const double angle = middle + half * std::sin(number);
  const V3d q = origin + (u * std::cos(angle) + v * std::sin(angle)) * radius;
  isOnBoth = true;
  if (isCircle) return q;
  const LineMeeting line = meetingOf(q, w, b);
  const double root =
      std::sqrt(std::max(0.0, line.linear * line.linear - line.squared * line.constant));
  const double t = (line.linear + sign * root) / line.squared;
  const V3d point = q + w * t;
  constexpr double kBeyond = 1e-9;
  isOnBoth = t >= -kBeyond && t <= (a.to - a.from).length() + kBeyond;
  if (!b.isBall()) {
    const V3d along = b.to - b.from;
    const double length = along.length(), s = (point - b.from).dot(along) / length;
    isOnBoth = isOnBoth && s >= -kBeyond && s <= length + kBeyond;
  }
  return point;
}

void addMeetingCurves(const std::vector<RodShape>& shapes, std::uint32_t first,
                      std::uint32_t second, std::vector<MeetingCurve>& curves) {
  if (shapes[first].isBall()) std::swap(first, second);
  const RodShape &a = shapes[first], &b = shapes[second];
  MeetingCurve curve{.first = first, .second = second};
  if (a.isBall()) {
    const V3d between = b.from - a.from;
    const double apart = between.length();
    if (!(apart > 0)) return;
    const double plane =
        (apart * apart + (a.radius - b.radius) * (a.radius + b.radius)) / (2 * apart);
    const double squared = (a.radius - plane) * (a.radius + plane);
    if (!(squared > 0)) return;
    curve.isCircle = true;
    curve.w = between / apart;
    curve.origin = a.from + curve.w * plane;
    curve.radius = std::sqrt(squared);
    curve.half = kPi;
    curve.u = anyPerpendicular(curve.w);
    curve.v = curve.w.cross(curve.u);
    curves.push_back(curve);
    return;
  }
  curve.w = (a.to - a.from).normalized();
  if (!b.isBall() && curve.w.cross((b.to - b.from).normalized()).length2() < kParallelRods) return;
  curve.origin = a.from;
  curve.radius = a.radius;
  curve.u = anyPerpendicular(curve.w);
  curve.v = curve.w.cross(curve.u);
  for (const auto& [middle, half] : anglesOf(curve, b))
    for (const double sign : {-1.0, 1.0}) {
      curve.middle = middle;
      curve.half = half;
      curve.sign = sign;
      curves.push_back(curve);
    }
}

}  // namespace levelset
