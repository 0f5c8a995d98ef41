#pragma once

// What the sources of the generators share.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/solids/shape_band_vdb.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// @throws UsageError unless the length is positive and finite
inline void requirePositive(double length, const char* action, const char* name) {
  if (length > 0 && std::isfinite(length)) return;
  throw levelset::UsageError(
      fmt::format("{}: {} is {}; give a positive, finite length", action, name, length));
}

inline void requireNonNegative(double length, const char* action, const char* name) {
  if (length >= 0 && std::isfinite(length)) return;
  throw levelset::UsageError(
      fmt::format("{}: {} is {}; give a finite length of at least 0", action, name, length));
}

inline void requireFinite(const Imath::V3d& point, const char* action, const char* name) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) return;
  throw levelset::UsageError(fmt::format("{}: {} is {},{},{}; its coordinates must be finite",
                                         action, name, point.x, point.y, point.z));
}

/// An open range, radians in, degrees told.
inline void requireAngle(double angle, double above, double below, const char* action,
                         const char* name) {
  if (angle > above && angle < below) return;
  constexpr double kDegrees = 180 / 3.14159265358979323846;
  throw levelset::UsageError(
      fmt::format("{}: {} is {:.6g} degrees; give more than {:.6g} and less "
                  "than {:.6g}",
                  action, name, angle * kDegrees, above * kDegrees, below * kDegrees));
}

inline void requireTiling(const Tiling& tiling, const char* action) {
  constexpr int kMost = 1'000'000;
  if (tiling.columns < 1 || tiling.rows < 1 || tiling.columns > kMost || tiling.rows > kMost) {
    throw levelset::UsageError(fmt::format("{}: {} columns and {} rows; give 1 to {} of each",
                                           action, tiling.columns, tiling.rows, kMost));
  }
  requireNonNegative(tiling.overlap, action, "the overlap");
}

/// @throws InvalidInput for what a grid cannot show
inline void requireResolved(double length, double voxelSize, const char* action, const char* name) {
  constexpr double kFewestVoxels = 2;
  if (length >= kFewestVoxels * voxelSize * (1 - 1e-9)) return;
  throw levelset::InvalidInput(
      fmt::format("{}: {} is {:.6g}, under two voxels of {:.6g}; use smaller voxels", action, name,
                  length, voxelSize));
}

/// Distance to the quadrant u < 0, v < 0, negative inside.
inline double convexEdge(double u, double v) {
  const double a = std::max(u, 0.0), b = std::max(v, 0.0);
  return std::min(std::max(u, v), 0.0) + std::sqrt(a * a + b * b);
}

/// Distance to what is left of the plane when the quadrant u > 0, v > 0 is taken away.
inline double concaveEdge(double u, double v) {
  return -convexEdge(-u, -v);
}

/// Distance to a box from outside, less in magnitude than the depth inside.
inline double boxDistance(const Imath::V3d& p, const Imath::Box3d& box) {
  double depth = -HUGE_VAL, squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double beyond = std::max(box.min[axis] - p[axis], p[axis] - box.max[axis]);
    depth = std::max(depth, beyond);
    if (beyond > 0) squared += beyond * beyond;
  }
  return squared > 0 ? std::sqrt(squared) : depth;
}

/// Gradient of a distance by central differences.
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

/// The nearest point to p of a solid's surface within faces of a box: coordinates along `fixed`
/// axes are given, the others follow from the planes that touch the solid. A plane needs one step.
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

/// Exact distance to what a box leaves of a solid. Inside it is that to the nearer of the two;
/// outside, the nearest point lies on the solid, on the box, or where the solid meets faces of the
/// box. @param distance  exact beside the solid's surface, nowhere more in magnitude than it is
/// @param exact  up to where the result has to be exact: beyond, it may be less
template <typename Distance>
double clippedDistance(const Distance& distance, const Imath::V3d& p, const Imath::Box3d& box,
                       double exact, double voxelSize) {
  const double outside = boxDistance(p, box);
  const double toSolid = distance(p), least = std::max(outside, toSolid);
  // A ball of this size about p is inside, far away, or does not touch the box's faces.
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

/// A band from a function with the right sign and the right zero set whose values beside it are
/// those of unit slope, and which nowhere passes the distance: sampled, and made a distance again
/// by closest points.
template <typename Field>
levelset::NarrowBand makeFromField(const levelset::ShapeExtent& extent, double voxelSize,
                                   const levelset::ShapeOptions& options, const char* action,
                                   const Field& field) {
  levelset::checkShape(extent, voxelSize, options, action);
  // What the tricubic interpolant beside the zero set reads.
  constexpr double kSampledHalfWidth = 4;
  levelset::NarrowBand sampled =
      levelset::makeShape(extent, voxelSize,
                          {.halfWidth = kSampledHalfWidth,
                           .maxMemory = options.maxMemory,
                           .progress = levelset::subProgress(options.progress, 0, 0.5)},
                          action, field);
  return levelset::redistance(std::move(sampled),
                              {.halfWidth = options.halfWidth,
                               .maxMemory = options.maxMemory,
                               .progress = levelset::subProgress(options.progress, 0.5, 1)});
}

}  // namespace mapping
