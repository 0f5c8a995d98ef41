#include "levelset/shapes/shapes.h"

#include <Imath/ImathBox.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/shapes/shape_band_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

void requireLength(double length, const char* name) {
  if (length > 0 && std::isfinite(length)) return;
  throw UsageError(fmt::format("{} is {}; give a positive, finite length", name, length));
}

void requirePoint(const V3d& point, const char* name) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) return;
  throw UsageError(
      fmt::format("{} is {},{},{}; give finite coordinates", name, point.x, point.y, point.z));
}

V3d requireAxis(const V3d& axis) {
  requirePoint(axis, "the axis");
  const V3d unit = axis.normalized();
  if (unit.length2() > 0.5) return unit;
  throw UsageError("the axis is 0,0,0; give it a direction");
}

void requireFits(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options) {
  if (!std::isfinite(extent.area)) {
    throw InvalidInput("the surface area overflows double precision; change the unit of length");
  }
  const V3d size = extent.bounds.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (voxelSize > longest) {
    throw InvalidInput(
        fmt::format("the voxel size {} is larger than the longest side of the shape, {}; "
                    "use smaller voxels",
                    voxelSize, longest));
  }
  double farthest = 0;
  for (int axis = 0; axis < 3; ++axis)
    farthest =
        std::max({farthest, std::abs(extent.bounds.min[axis]), std::abs(extent.bounds.max[axis])});
  const double index = farthest / voxelSize + options.halfWidth;
  if (!(index < kIndexLimit)) {
    throw ResourceLimit(
        fmt::format("at voxel size {} the grid index {:.3g} of the shape exceeds 32 bits; use "
                    "larger voxels "
                    "or move it towards the origin",
                    voxelSize, index));
  }
  // The band around a piece of the surface of the size of a leaf face (8² voxels) overlaps about (2
  // · half width) / 8 leaves along its normal, and about two leaves more.
  double leaves = extent.area / (64 * voxelSize * voxelSize) * (2 * options.halfWidth + 15) / 8;
  if (!isEverywhere(options.region)) {
    const V3d blocks = options.region.size() / (8 * voxelSize) + V3d(2);
    leaves = std::min(leaves, blocks.x * blocks.y * blocks.z);
  }
  requireMemory(leaves * 2300 + 1e5, options.maxMemory);
}

Imath::Box3d around(const V3d& center, const V3d& half) {
  return {center - half, center + half};
}

/// Half extents of a disc of `radius` perpendicular to a unit axis.
V3d discExtent(double radius, const V3d& axis) {
  V3d half;
  for (int i = 0; i < 3; ++i) half[i] = radius * std::sqrt(std::max(0.0, 1 - axis[i] * axis[i]));
  return half;
}

/// Length of (u, v). std::hypot would guard against overflow, but takes ten times as long.
double length2d(double u, double v) {
  return std::sqrt(u * u + v * v);
}

/// Distance from (u, v) to the quadrant u < 0, v < 0, negative inside.
double quadrantDistance(double u, double v) {
  return std::min(std::max(u, v), 0.0) + length2d(std::max(u, 0.0), std::max(v, 0.0));
}

/// Distance to the profile of a torus in the half plane r ≥ 0, with r the distance from the axis
/// and z along it. The profile is a disc of radius `tube` around (radius, 0). If `tube` exceeds
/// `radius`, the axis cuts the disc, and the part of the disc with r < 0 is left out. A point whose
/// nearest point of the disc's border has r < 0 is then nearest to the cusp, where the border meets
/// the axis.
double ringDistance(double r, double z, double radius, double tube) {
  const double toCenter = length2d(r - radius, z);
  if (tube > radius && tube * (radius - r) > radius * toCenter) {
    const double cusp = std::sqrt((tube - radius) * (tube + radius));
    return std::copysign(length2d(r, std::abs(z) - cusp), toCenter - tube);
  }
  return toCenter - tube;
}

}  // namespace

void checkShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options) {
  requireLength(voxelSize, "the voxel size");
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth)) {
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
  }
  requireFits(extent, voxelSize, options);
}

ShapeExtent sphereExtent(double radius, const V3d& center) {
  return {around(center, V3d(radius)), 4 * std::numbers::pi * radius * radius};
}

ShapeExtent boxExtent(const V3d& size, const V3d& center) {
  return {around(center, size / 2), 2 * (size.x * size.y + size.y * size.z + size.z * size.x)};
}

ShapeExtent torusExtent(double radius, double tube, const V3d& center, const V3d& axis) {
  return {around(center, discExtent(radius, axis.normalized()) + V3d(tube)),
          4 * std::numbers::pi * std::numbers::pi * radius * tube};
}

ShapeExtent cylinderExtent(double radius, double height, const V3d& center, const V3d& axis) {
  const V3d n = axis.normalized(), cap(std::abs(n.x), std::abs(n.y), std::abs(n.z));
  return {around(center, discExtent(radius, n) + cap * (height / 2)),
          2 * std::numbers::pi * radius * (radius + height)};
}

ShapeExtent capsuleExtent(const V3d& from, const V3d& to, double radius) {
  Imath::Box3d bounds(from);
  bounds.extendBy(to);
  bounds.min -= V3d(radius);
  bounds.max += V3d(radius);
  return {bounds, 2 * std::numbers::pi * radius * (2 * radius + (to - from).length())};
}

NarrowBand makeSphere(double radius, const V3d& center, double voxelSize,
                      const ShapeOptions& options) {
  requireLength(radius, "the radius");
  requirePoint(center, "the centre");
  return makeShape(sphereExtent(radius, center), voxelSize, options,
                   [=](const V3d& p) { return (p - center).length() - radius; });
}

NarrowBand makeBox(const V3d& size, const V3d& center, double voxelSize,
                   const ShapeOptions& options) {
  for (int axis = 0; axis < 3; ++axis) requireLength(size[axis], "a side of the box");
  requirePoint(center, "the centre");
  const V3d half = size / 2;
  return makeShape(boxExtent(size, center), voxelSize, options, [=](const V3d& p) {
    const V3d q(std::abs(p.x - center.x) - half.x, std::abs(p.y - center.y) - half.y,
                std::abs(p.z - center.z) - half.z);
    const V3d outside(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return outside.length() + std::min(std::max({q.x, q.y, q.z}), 0.0);
  });
}

NarrowBand makeTorus(double radius, double tube, const V3d& center, const V3d& axis,
                     double voxelSize, const ShapeOptions& options) {
  requireLength(radius, "the radius");
  requireLength(tube, "the tube radius");
  requirePoint(center, "the centre");
  const V3d n = requireAxis(axis);
  return makeShape(torusExtent(radius, tube, center, n), voxelSize, options, [=](const V3d& p) {
    const double z = (p - center) ^ n;
    const double r = (p - center - n * z).length();
    return ringDistance(r, z, radius, tube);
  });
}

NarrowBand makeCylinder(double radius, double height, const V3d& center, const V3d& axis,
                        double voxelSize, const ShapeOptions& options) {
  requireLength(radius, "the radius");
  requireLength(height, "the height");
  requirePoint(center, "the centre");
  const V3d n = requireAxis(axis);
  return makeShape(cylinderExtent(radius, height, center, n), voxelSize, options,
                   [=](const V3d& p) {
                     const double z = (p - center) ^ n;
                     const double r = (p - center - n * z).length();
                     return quadrantDistance(r - radius, std::abs(z) - height / 2);
                   });
}

NarrowBand makeCapsule(const V3d& from, const V3d& to, double radius, double voxelSize,
                       const ShapeOptions& options) {
  requireLength(radius, "the radius");
  requirePoint(from, "the first end");
  requirePoint(to, "the second end");
  const V3d along = to - from;
  const double squaredLength = along.length2();
  return makeShape(capsuleExtent(from, to, radius), voxelSize, options, [=](const V3d& p) {
    // If both ends coincide, the capsule is a sphere.
    const double t =
        squaredLength > 0 ? std::clamp(((p - from) ^ along) / squaredLength, 0.0, 1.0) : 0.0;
    return (p - from - along * t).length() - radius;
  });
}

}  // namespace levelset
