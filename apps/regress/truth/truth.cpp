#include "apps/regress/truth/truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace regress {

using Imath::M44d;
using Imath::V3d;
using levelset::CsgOperation;

namespace {

constexpr double kPi = std::numbers::pi;

double capVolume(double radius, double height) {
  return kPi * height * height * (3 * radius - height) / 3;
}

/// Signed distance to the corner of a rectangle, the profile of a cylinder, from the signed
/// distances x and y to its two sides.
double cornerDistance(double x, double y) {
  return std::hypot(std::max(x, 0.0), std::max(y, 0.0)) + std::min(0.0, std::max(x, y));
}

}  // namespace

Truth ball(const V3d& centre, double radius) {
  return {.distance = [=](const V3d& p) { return (p - centre).length() - radius; },
          .volume = 4 * kPi / 3 * radius * radius * radius,
          .area = 4 * kPi * radius * radius,
          .centre = centre,
          .reach = radius};
}

Truth box(const V3d& centre, const V3d& size, double rounding) {
  const V3d half = size / 2;
  const double edges = size.x + size.y + size.z,
               faces = 2 * (size.x * size.y + size.y * size.z + size.z * size.x), r = rounding;
  return {.distance =
              [=](const V3d& p) {
                const V3d r0 = p - centre;
                const V3d q(std::abs(r0.x) - half.x, std::abs(r0.y) - half.y,
                            std::abs(r0.z) - half.z);
                const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
                return out.length() + std::min(0.0, std::max({q.x, q.y, q.z})) - rounding;
              },
          // Steiner's formula for the volume and area of a box that is offset by `rounding`.
          .volume =
              size.x * size.y * size.z + faces * r + kPi * r * r * edges + 4 * kPi / 3 * r * r * r,
          .area = faces + 2 * kPi * r * edges + 4 * kPi * r * r,
          .centre = centre,
          .reach = half.length() + rounding};
}

Truth torus(const V3d& centre, const V3d& axis, double radius, double tube) {
  const V3d n = axis.normalized();
  return {.distance =
              [=](const V3d& p) {
                const double along = (p - centre).dot(n);
                const double away = (p - centre - along * n).length();
                return std::hypot(away - radius, along) - tube;
              },
          .volume = 2 * kPi * kPi * radius * tube * tube,
          .area = 4 * kPi * kPi * radius * tube,
          .centre = centre,
          .reach = radius + tube};
}

Truth cylinder(const V3d& centre, const V3d& axis, double radius, double height) {
  const V3d n = axis.normalized();
  return {.distance =
              [=](const V3d& p) {
                const double along = (p - centre).dot(n);
                const double away = (p - centre - along * n).length();
                return cornerDistance(away - radius, std::abs(along) - height / 2);
              },
          .volume = kPi * radius * radius * height,
          .area = 2 * kPi * radius * (radius + height),
          .centre = centre,
          .reach = std::hypot(radius, height / 2)};
}

Truth capsule(const V3d& from, const V3d& to, double radius) {
  const V3d along = to - from;
  const double length = along.length();
  return {.distance =
              [=](const V3d& p) {
                const double t = std::clamp((p - from).dot(along) / along.length2(), 0.0, 1.0);
                return (p - from - t * along).length() - radius;
              },
          .volume = kPi * radius * radius * (length + 4 * radius / 3),
          .area = 2 * kPi * radius * (length + 2 * radius),
          .centre = (from + to) / 2.0,
          .reach = length / 2 + radius};
}

Truth moved(const Truth& solid, const M44d& matrix) {
  const M44d back = matrix.inverse();
  Truth result = solid;
  result.distance = [=, distance = solid.distance](const V3d& p) { return distance(p * back); };
  result.centre = solid.centre * matrix;
  if (solid.compared)
    result.compared = [=, compared = solid.compared](const V3d& p) { return compared(p * back); };
  return result;
}

Truth twoBalls(CsgOperation operation, const V3d& centreA, double radiusA, const V3d& centreB,
               double radiusB) {
  const V3d axis = (centreB - centreA).normalized();
  const double gap = (centreB - centreA).length();
  // Position along the axis of the plane in which the spheres meet, and radius of the circle in
  // which they meet.
  const double plane = (gap * gap + radiusA * radiusA - radiusB * radiusB) / (2 * gap);
  const double ring = std::sqrt(radiusA * radiusA - plane * plane);
  const double heightA = radiusA - plane, heightB = radiusB - (gap - plane);
  const bool insideA = operation == CsgOperation::Intersection;
  const bool insideB = operation != CsgOperation::Union;

  const Distance distance = [=](const V3d& p) {
    const V3d a = p - centreA, b = p - centreB;
    const double fromA = a.length() - radiusA, fromB = b.length() - radiusB;
    const bool inside = operation == CsgOperation::Union          ? fromA < 0 || fromB < 0
                        : operation == CsgOperation::Intersection ? fromA < 0 && fromB < 0
                                                                  : fromA < 0 && fromB >= 0;
    // Distance to the nearest point of the circle where the spheres meet, and of the parts of both
    // spheres that bound the solid.
    const double along = a.dot(axis);
    double nearest = std::hypot((a - along * axis).length() - ring, along - plane);
    const V3d footA = a.normalized() * radiusA, footB = b.normalized() * radiusB;
    const bool footAInB = footA.dot(axis) > plane, footBInA = gap + footB.dot(axis) < plane;
    // Intersection keeps the points of A in B. Union and difference keep the points of A outside B.
    if (footAInB == insideA) nearest = std::min(nearest, std::abs(fromA));
    if (footBInA == insideB) nearest = std::min(nearest, std::abs(fromB));
    return inside ? -nearest : nearest;
  };

  const double lens = capVolume(radiusA, heightA) + capVolume(radiusB, heightB);
  const double volumeA = 4 * kPi / 3 * std::pow(radiusA, 3),
               volumeB = 4 * kPi / 3 * std::pow(radiusB, 3);
  const double capA = 2 * kPi * radiusA * heightA, capB = 2 * kPi * radiusB * heightB;
  const double restA = 4 * kPi * radiusA * radiusA - capA,
               restB = 4 * kPi * radiusB * radiusB - capB;
  Truth truth{.distance = distance,
              .centre = (centreA + centreB) / 2.0,
              .reach = gap / 2 + std::max(radiusA, radiusB)};
  switch (operation) {
    case CsgOperation::Union:
      truth.volume = volumeA + volumeB - lens;
      truth.area = restA + restB;
      break;
    case CsgOperation::Intersection:
      truth.volume = lens;
      truth.area = capA + capB;
      break;
    case CsgOperation::Difference:
      truth.volume = volumeA - lens;
      truth.area = restA + capB;
      break;
  }
  return truth;
}

// The solid is one of revolution. Its profile in the half plane (x along the axis, y from it) has
// the arcs of both balls and the arc of the fillet between them. The distance of the fillet's
// centre from the circles of both balls is the fillet's radius.
Truth filletedBalls(const V3d& centreA, double radiusA, const V3d& centreB, double radiusB,
                    double fillet) {
  const V3d axis = (centreB - centreA).normalized();
  const double gap = (centreB - centreA).length();
  const double sumA = radiusA + fillet, sumB = radiusB + fillet;
  const double x = (gap * gap + sumA * sumA - sumB * sumB) / (2 * gap),
               y = std::sqrt(sumA * sumA - x * x);
  const Distance distance = [=](const V3d& p) {
    const V3d a = p - centreA;
    const double along = a.dot(axis), off = (a - along * axis).length();
    // Inside the triangle of the centres of both balls and of the fillet, the fillet is the nearest
    // surface.
    const bool isBetween = along * y >= off * x && (gap - along) * y >= off * (gap - x);
    if (isBetween) return fillet - std::hypot(along - x, off - y);
    return std::min(a.length() - radiusA, (p - centreB).length() - radiusB);
  };

  Truth truth{.distance = distance,
              .centre = (centreA + centreB) / 2.0,
              .reach = gap / 2 + std::max(radiusA, radiusB)};
  // Volume and area of both balls without the caps beyond the planes where the fillet touches the
  // balls. Simpson's rule adds the part between these planes.
  const double touchA = x * radiusA / sumA, touchB = gap - (gap - x) * radiusB / sumB;
  const double heightA = radiusA - touchA, heightB = radiusB - (gap - touchB);
  double volume = 4 * kPi / 3 * (std::pow(radiusA, 3) + std::pow(radiusB, 3)) -
                  capVolume(radiusA, heightA) - capVolume(radiusB, heightB);
  double area = 2 * kPi * (radiusA * (2 * radiusA - heightA) + radiusB * (2 * radiusB - heightB));
  constexpr int kParts = 20000;
  const double step = (touchB - touchA) / kParts;
  for (int i = 0; i <= kParts; ++i) {
    const double weight = (i == 0 || i == kParts ? 1 : i % 2 ? 4 : 2) * step / 3;
    const double down = std::sqrt(fillet * fillet - std::pow(touchA + i * step - x, 2));
    const double radius = y - down;
    volume += weight * kPi * radius * radius;
    area += weight * 2 * kPi * radius * fillet / down;
  }
  truth.volume = volume;
  truth.area = area;
  return truth;
}

Truth apart(const Truth& a, const Truth& b) {
  const double gap = (b.centre - a.centre).length();
  return {.distance = [first = a.distance,
                       second = b.distance](const V3d& p) { return std::min(first(p), second(p)); },
          .volume = *a.volume + *b.volume,
          .area = *a.area + *b.area,
          .centre = (a.centre + b.centre) / 2.0,
          .reach = gap / 2 + std::max(a.reach, b.reach)};
}

M44d skewRotation() {
  M44d matrix;
  matrix.setAxisAngle(V3d(0.267, 0.535, 0.802).normalized(), 0.61);
  return matrix;
}

}  // namespace regress
