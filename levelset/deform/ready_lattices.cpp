#include "levelset/deform/ready_lattices.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/geometry/perpendicular.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr int kTrigonometricDegree = 5;
constexpr std::size_t kMostSpans = 512;
constexpr std::size_t kSamples = 64;  ///< test points of each span

/// Coordinates along the directions of a box, from its centre.
V3d boxLocalOf(const OrientedBox& box, const V3d& world) {
  const V3d from = world - box.centre;
  return {from.dot(box.directions[0]), from.dot(box.directions[1]), from.dot(box.directions[2])};
}

V3d worldOf(const OrientedBox& box, const V3d& local) {
  return box.centre + box.directions[0] * local.x + box.directions[1] * local.y +
         box.directions[2] * local.z;
}

Imath::M44d boxFrame(const OrientedBox& box) {
  Imath::M44d frame;
  const V3d origin = worldOf(box, -box.halfSize);
  for (int axis = 0; axis < 3; ++axis) {
    for (int c = 0; c < 3; ++c)
      frame[axis][c] = 2 * box.halfSize[axis] * box.directions[static_cast<std::size_t>(axis)][c];
    frame[3][axis] = origin[axis];
  }
  return frame;
}

void requireDeformationBox(const OrientedBox& box) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(box.halfSize[axis] > 0) || !std::isfinite(box.halfSize[axis]))
      throw InvalidInput("the box of the deformation is empty or flat; give a solid with extent");
}

void requireAngle(double angle, double tolerance) {
  if (!(std::abs(angle) <= 100))
    throw UsageError(
        fmt::format("the angle is {} radians; give an angle of at most 100 radians", angle));
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    throw UsageError(
        fmt::format("the tolerance of the lattice is {}; give a positive length", tolerance));
}

void requireFactor(double factor) {
  if (factor > 0 && std::isfinite(factor)) return;
  throw UsageError(fmt::format("the factor is {}; give a positive factor", factor));
}

/// B-splines for the sine and the cosine of angle × (t − 1/2), t in [0, 1].
struct TrigonometricArc {
  LatticeAxis axis;
  std::vector<double> cosines, sines;  ///< control points
};

TrigonometricArc arcOf(double angle, std::size_t spans) {
  TrigonometricArc arc{uniformAxis(kTrigonometricDegree, spans + kTrigonometricDegree), {}, {}};
  const std::vector<double> nodes = grevilleAbscissae(arc.axis);
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd matrix(count, count);
  Eigen::MatrixXd values(count, 2);
  for (Eigen::Index row = 0; row < count; ++row) {
    const double t = nodes[static_cast<std::size_t>(row)];
    const std::vector<double> basis = basisAt(arc.axis, t);
    for (Eigen::Index column = 0; column < count; ++column)
      matrix(row, column) = basis[static_cast<std::size_t>(column)];
    values(row, 0) = std::cos(angle * (t - 0.5));
    values(row, 1) = std::sin(angle * (t - 0.5));
  }
  const Eigen::MatrixXd solved = matrix.partialPivLu().solve(values);
  for (Eigen::Index row = 0; row < count; ++row) {
    arc.cosines.push_back(solved(row, 0));
    arc.sines.push_back(solved(row, 1));
  }
  return arc;
}

/// Largest error of an arc on the unit circle, at kSamples points of each span.
double arcError(const TrigonometricArc& arc, double angle) {
  const std::size_t spans = spanCount(arc.axis), samples = kSamples * spans;
  double worst = 0;
  for (std::size_t n = 0; n <= samples; ++n) {
    const double t = static_cast<double>(n) / static_cast<double>(samples);
    const std::vector<double> basis = basisAt(arc.axis, t);
    double c = 0, s = 0;
    for (std::size_t i = 0; i < basis.size(); ++i) {
      c += basis[i] * arc.cosines[i];
      s += basis[i] * arc.sines[i];
    }
    worst = std::max(worst,
                     std::hypot(c - std::cos(angle * (t - 0.5)), s - std::sin(angle * (t - 0.5))));
  }
  return worst;
}

/// Finds the arc with the fewest spans, a power of two, that keeps an error at a radius.
TrigonometricArc arcWithin(double angle, double radius, double tolerance) {
  std::size_t spans = 1;
  while (static_cast<double>(spans) < std::abs(angle)) spans *= 2;
  for (; spans <= kMostSpans; spans *= 2) {
    TrigonometricArc arc = arcOf(angle, spans);
    if (arcError(arc, angle) * radius <= tolerance) return arc;
  }
  throw InvalidInput(fmt::format(
      "no lattice of at most {} spans meets the tolerance of {:.3g} at a radius of {:.3g}; use a "
      "larger tolerance",
      kMostSpans, tolerance, radius));
}

/// Builds a lattice of degree 1 along the first two directions.
/// @param place  local position of the control point i along the third direction, for local x and y
ControlLattice latticeOf(const OrientedBox& box, const LatticeAxis& along,
                         const std::function<V3d(double x, double y, std::size_t i)>& place) {
  LatticeData data{.axes = {uniformAxis(1, 2), uniformAxis(1, 2), along},
                   .boxToWorld = boxFrame(box)};
  for (const double x : {-box.halfSize.x, box.halfSize.x})
    for (const double y : {-box.halfSize.y, box.halfSize.y})
      for (std::size_t i = 0; i < along.count(); ++i)
        data.points.push_back(worldOf(box, place(x, y, i)));
  return ControlLattice(std::move(data));
}

/// Largest distance between a lattice and its closed form, at test points on the four edges along
/// the axis. Both are linear across it, so the largest distance is at the edges.
double distanceFrom(const ControlLattice& lattice,
                    const std::function<V3d(const V3d&)>& closedForm) {
  const std::size_t samples = kSamples * spanCount(lattice.data().axes[2]);
  double worst = 0;
  for (std::size_t n = 0; n <= samples; ++n)
    for (const double u : {0.0, 1.0})
      for (const double v : {0.0, 1.0}) {
        const V3d p =
            lattice.worldOf(V3d(u, v, static_cast<double>(n) / static_cast<double>(samples)));
        worst = std::max(worst, (lattice.at(p) - closedForm(p)).length());
      }
  return worst;
}

ReadyLattice checked(ControlLattice lattice, const std::function<V3d(const V3d&)>& closedForm) {
  const double error = distanceFrom(lattice, closedForm);
  return {std::move(lattice), error};
}

ReadyLattice identityOf(const OrientedBox& box) {
  return {identityLattice({uniformAxis(1, 2), uniformAxis(1, 2), uniformAxis(1, 2)}, boxFrame(box)),
          0};
}

}  // namespace

std::array<V3d, 3> directionsAlong(const V3d& axis, const V3d& towards) {
  if (!(axis.length() > 0) || !std::isfinite(axis.length()))
    throw UsageError("the axis of the deformation has no direction; give for example 0,0,1");
  const V3d along = axis.normalized();
  V3d side = towards - along * along.dot(towards);
  if (towards == V3d(0))
    side = anyPerpendicular(along);
  else if (!(side.length() > 1e-6 * towards.length()))
    throw UsageError(
        "the side towards which to bend is parallel to the axis; give a direction across it");
  side.normalize();
  return {side, along.cross(side), along};
}

OrientedBox boxAround(std::span<const V3d> points, const std::array<V3d, 3>& directions,
                      double margin) {
  V3d low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
  for (const V3d& p : points)
    for (int axis = 0; axis < 3; ++axis) {
      const double along = p.dot(directions[static_cast<std::size_t>(axis)]);
      low[axis] = std::min(low[axis], along);
      high[axis] = std::max(high[axis], along);
    }
  const V3d size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  if (points.empty() || !(longest > 0))
    throw InvalidInput("there is nothing with an extent to deform; give a solid with a surface");
  OrientedBox box{V3d(0), directions, V3d(0)};
  for (int axis = 0; axis < 3; ++axis) {
    box.centre += directions[static_cast<std::size_t>(axis)] * (0.5 * (low[axis] + high[axis]));
    // Rounding must not put a point outside.
    box.halfSize[axis] = 0.5 * std::max(size[axis] * (1 + 1e-9), 1e-3 * longest) + margin;
  }
  return box;
}

V3d bent(const OrientedBox& box, double angle, const V3d& world) {
  const V3d p = boxLocalOf(box, world);
  if (angle == 0) return world;
  const double radius = 2 * box.halfSize.z / angle, turn = p.z / radius, half = std::sin(turn / 2);
  return worldOf(
      box, {p.x * std::cos(turn) + 2 * radius * half * half, p.y, (radius - p.x) * std::sin(turn)});
}

V3d twisted(const OrientedBox& box, double angle, const V3d& world) {
  const V3d p = boxLocalOf(box, world);
  const double turn = angle * p.z / (2 * box.halfSize.z), c = std::cos(turn), s = std::sin(turn);
  return worldOf(box, {p.x * c - p.y * s, p.x * s + p.y * c, p.z});
}

V3d tapered(const OrientedBox& box, double factor, const V3d& world) {
  const V3d p = boxLocalOf(box, world);
  const double scale = 1 + (factor - 1) * 0.5 * (1 + p.z / box.halfSize.z);
  return worldOf(box, {p.x * scale, p.y * scale, p.z});
}

V3d stretched(const OrientedBox& box, double factor, const V3d& world) {
  const V3d p = boxLocalOf(box, world);
  return worldOf(box, {p.x, p.y, p.z * factor});
}

ReadyLattice bendLattice(const OrientedBox& box, double angle, double tolerance) {
  requireDeformationBox(box);
  requireAngle(angle, tolerance);
  if (angle == 0) return identityOf(box);
  const double radius = 2 * box.halfSize.z / angle;
  const TrigonometricArc arc = arcWithin(angle, std::abs(radius) + box.halfSize.x, tolerance);
  return checked(latticeOf(box, arc.axis,
                           [&](double x, double y, std::size_t i) {
                             return V3d(radius - (radius - x) * arc.cosines[i], y,
                                        (radius - x) * arc.sines[i]);
                           }),
                 [&](const V3d& p) { return bent(box, angle, p); });
}

ReadyLattice twistLattice(const OrientedBox& box, double angle, double tolerance) {
  requireDeformationBox(box);
  requireAngle(angle, tolerance);
  if (angle == 0) return identityOf(box);
  const TrigonometricArc arc =
      arcWithin(angle, std::hypot(box.halfSize.x, box.halfSize.y), tolerance);
  const std::vector<double> heights = grevilleAbscissae(arc.axis);
  return checked(latticeOf(box, arc.axis,
                           [&](double x, double y, std::size_t i) {
                             const double c = arc.cosines[i], s = arc.sines[i];
                             return V3d(x * c - y * s, x * s + y * c,
                                        (2 * heights[i] - 1) * box.halfSize.z);
                           }),
                 [&](const V3d& p) { return twisted(box, angle, p); });
}

ReadyLattice taperLattice(const OrientedBox& box, double factor) {
  requireDeformationBox(box);
  requireFactor(factor);
  if (factor == 1) return identityOf(box);
  return checked(latticeOf(box, uniformAxis(1, 2),
                           [&](double x, double y, std::size_t i) {
                             const double scale = i == 0 ? 1 : factor;
                             return V3d(x * scale, y * scale,
                                        i == 0 ? -box.halfSize.z : box.halfSize.z);
                           }),
                 [&](const V3d& p) { return tapered(box, factor, p); });
}

ReadyLattice stretchLattice(const OrientedBox& box, double factor) {
  requireDeformationBox(box);
  requireFactor(factor);
  if (factor == 1) return identityOf(box);
  return checked(latticeOf(box, uniformAxis(1, 2),
                           [&](double x, double y, std::size_t i) {
                             return V3d(x, y, (i == 0 ? -box.halfSize.z : box.halfSize.z) * factor);
                           }),
                 [&](const V3d& p) { return stretched(box, factor, p); });
}

}  // namespace levelset
