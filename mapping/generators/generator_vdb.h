#pragma once

// Checks and distance functions that the .cpp files of the texture generators share.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/shapes/shape_band_vdb.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// Checks that a length is positive and finite.
/// @throws UsageError otherwise
inline void requirePositive(double length, const char* name) {
  if (length > 0 && std::isfinite(length)) return;
  throw levelset::UsageError(fmt::format("{} is {}; give a positive, finite length", name, length));
}

inline void requireNonNegative(double length, const char* name) {
  if (length >= 0 && std::isfinite(length)) return;
  throw levelset::UsageError(
      fmt::format("{} is {}; give a finite length of at least 0", name, length));
}

inline void requireFinite(const Imath::V3d& point, const char* name) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) return;
  throw levelset::UsageError(fmt::format("{} is {},{},{}; its coordinates must be finite", name,
                                         point.x, point.y, point.z));
}

/// Checks that an angle lies in an open range; radians in the arguments, degrees in the message.
/// @throws UsageError otherwise
inline void requireAngle(double angle, double above, double below, const char* name) {
  if (angle > above && angle < below) return;
  constexpr double kDegrees = 180 / 3.14159265358979323846;
  throw levelset::UsageError(
      fmt::format("{} is {:.6g} degrees; give more than {:.6g} and less than {:.6g}", name,
                  angle * kDegrees, above * kDegrees, below * kDegrees));
}

inline void requireTiling(const Tiling& tiling) {
  constexpr int kMost = 1'000'000;
  if (tiling.columns < 1 || tiling.rows < 1 || tiling.columns > kMost || tiling.rows > kMost) {
    throw levelset::UsageError(
        fmt::format("the tiling has {} columns and {} rows; give 1 to {} of each", tiling.columns,
                    tiling.rows, kMost));
  }
  requireNonNegative(tiling.overlap, "the overlap");
}

/// Checks that a length is at least two voxels.
/// @throws InvalidInput otherwise
inline void requireResolved(double length, double voxelSize, const char* name) {
  constexpr double kFewestVoxels = 2;
  if (length >= kFewestVoxels * voxelSize * (1 - 1e-9)) return;
  throw levelset::InvalidInput(fmt::format(
      "{} is {:.6g}, under two voxels of {:.6g}; use smaller voxels", name, length, voxelSize));
}

/// Signed distance to the quadrant u < 0, v < 0; negative inside it.
inline double convexEdge(double u, double v) {
  const double a = std::max(u, 0.0), b = std::max(v, 0.0);
  return std::min(std::max(u, v), 0.0) + std::sqrt(a * a + b * b);
}

/// Signed distance to the plane without the quadrant u > 0, v > 0; positive inside that quadrant.
inline double concaveEdge(double u, double v) {
  return -convexEdge(-u, -v);
}

/// Signed distance to a box, exact inside and outside.
inline double boxDistance(const Imath::V3d& p, const Imath::Box3d& box) {
  double depth = -HUGE_VAL, squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double beyond = std::max(box.min[axis] - p[axis], p[axis] - box.max[axis]);
    depth = std::max(depth, beyond);
    if (beyond > 0) squared += beyond * beyond;
  }
  return squared > 0 ? std::sqrt(squared) : depth;
}

/// Gradient of a distance by central differences over ±`step`, world units.
template <typename Distance>
Imath::V3d slopeOf(const Distance& distance, const Imath::V3d& p, double step) {
  Imath::V3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    Imath::V3d low = p, high = p;
    low[axis] -= step;
    high[axis] += step;
    slope[axis] = (distance(high) - distance(low)) / (2 * step);
  }
  return slope;
}

/// Finds the point nearest to p on the part of a solid's surface that lies in a face or edge of a
/// box, by Newton steps. Along the axes that are `fixed`, the point has the coordinates of
/// `corner`; its other coordinates follow from tangent planes of the solid. For a plane one step
/// suffices. `step` is the step of slopeOf().
template <typename Distance>
Imath::V3d footWithin(const Distance& distance, const Imath::V3d& p, const Imath::V3d& corner,
                      const std::array<bool, 3>& fixed, double step) {
  Imath::V3d start = p;
  for (int axis = 0; axis < 3; ++axis)
    if (fixed[static_cast<std::size_t>(axis)]) start[axis] = corner[axis];
  Imath::V3d foot = start;
  constexpr int kMostSteps = 40;
  for (int i = 0; i < kMostSteps; ++i) {
    const Imath::V3d slope = slopeOf(distance, foot, step);
    Imath::V3d within = slope;
    for (int axis = 0; axis < 3; ++axis)
      if (fixed[static_cast<std::size_t>(axis)]) within[axis] = 0;
    const double squared = within.length2();
    if (!(squared > 1e-6)) break;
    const Imath::V3d next =
        start - within * ((distance(foot) + (slope ^ (start - foot))) / squared);
    const double moved = (next - foot).length();
    foot = next;
    if (moved < 1e-3 * step) break;
  }
  return foot;
}

/// Exact signed distance to the intersection of a solid and a box. Inside the intersection, it is
/// the distance to the nearer of both surfaces. Outside, the nearest point lies on the solid, on
/// the box, or where the solid meets faces of the box.
/// @param distance  signed distance to the solid, exact near its surface; its magnitude nowhere
///         exceeds the exact distance
/// @param exact     distance, world units, up to which the result is exact; further away the result
///         may be smaller
template <typename Distance>
double clippedDistance(const Distance& distance, const Imath::V3d& p, const Imath::Box3d& box,
                       double exact, double voxelSize) {
  const double outside = boxDistance(p, box);
  const double toSolid = distance(p), least = std::max(outside, toSolid);
  // `least` is the result if p is inside, or further away than `exact`. It is also the result if p
  // lies deeper in the solid than its distance to the box. Then the nearest point of the box is
  // inside the solid.
  if (least <= 0 || least > exact || outside < -toSolid) return least;
  const double step = 1e-3 * voxelSize;
  std::array<bool, 3> fixed = {};
  Imath::V3d corner = p;
  const auto fixBeyond = [&](const Imath::V3d& x) {
    bool isMore = false;
    for (int axis = 0; axis < 3; ++axis) {
      bool& isFixed = fixed[static_cast<std::size_t>(axis)];
      if (isFixed || (x[axis] >= box.min[axis] - step && x[axis] <= box.max[axis] + step)) continue;
      isFixed = isMore = true;
      corner[axis] = std::clamp(x[axis], box.min[axis], box.max[axis]);
    }
    return isMore;
  };
  fixBeyond(p);
  if (distance(corner) <= 0) return least;
  for (int round = 0; round < 3; ++round) {
    const Imath::V3d foot = footWithin(distance, p, corner, fixed, step);
    if (!fixBeyond(foot)) return std::max(least, std::min((foot - p).length(), 2 * least + step));
  }
  return std::max(least, std::min((corner - p).length(), 2 * least + step));
}

/// Builds a band from a field with the right sign and zero set, unit slope beside the zero set, and
/// magnitudes that nowhere exceed the distance. The field is sampled at the grid points, and the
/// distances are then computed by closest points.
template <typename Field>
levelset::NarrowBand makeFromField(const levelset::ShapeExtent& extent, double voxelSize,
                                   const levelset::ShapeOptions& options, const Field& field) {
  levelset::checkShape(extent, voxelSize, options);
  // Half width of the sampled band, voxels: the tricubic interpolant at the zero set reads values
  // up to this distance.
  constexpr double kSampledHalfWidth = 4;
  levelset::NarrowBand sampled =
      levelset::makeShape(extent, voxelSize,
                          {.halfWidth = kSampledHalfWidth,
                           .maxMemory = options.maxMemory,
                           .progress = levelset::subProgress(options.progress, 0, 0.5)},
                          field);
  return levelset::redistance(std::move(sampled),
                              {.halfWidth = options.halfWidth,
                               .maxMemory = options.maxMemory,
                               .progress = levelset::subProgress(options.progress, 0.5, 1)});
}

}  // namespace mapping
