#include "levelset/shapes/superquadric.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/shapes/shape_band_vdb.h"
#include "levelset/shapes/spherical_product.h"

namespace levelset {
namespace {

using Imath::V3d;

void requireSuperLength(double length, const char* name) {
  if (length > 0 && std::isfinite(length)) return;
  throw UsageError(fmt::format("{} is {}; give a positive, finite length", name, length));
}

void requireSuperCentre(const V3d& point) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) return;
  throw UsageError(
      fmt::format("the centre is {},{},{}; give finite coordinates", point.x, point.y, point.z));
}

void requireSuperExponent(double exponent, const char* name) {
  if (exponent >= kLeastSuperExponent && exponent <= kMostSuperExponent) return;
  throw UsageError(fmt::format("the {} exponent is {}; give a number from {} to {}", name, exponent,
                               kLeastSuperExponent, kMostSuperExponent));
}

void requireSuperformula(const Superformula& curve, const char* name) {
  if (!(curve.symmetry >= 0 && curve.symmetry <= 64))
    throw UsageError(fmt::format("the symmetry of the {} curve is {}; give a number from 0 to 64",
                                 name, curve.symmetry));
  for (int c = 0; c < 3; ++c)
    if (!(curve.exponents[c] >= 0.1 && curve.exponents[c] <= 100))
      throw UsageError(
          fmt::format("exponent n{} of the {} curve is {}; give a number from 0.1 to "
                      "100",
                      c + 1, name, curve.exponents[c]));
}

/// The curve |x|^(2/e) + |y|^(2/e) = 1.
Superformula superellipse(double exponent) {
  return {4, V3d(2 / exponent)};
}

NarrowBand bandOf(const SphericalProduct& surface, const ShapeExtent& extent, const V3d& center,
                  double voxelSize, const ShapeOptions& options) {
  const double reach = options.halfWidth * voxelSize * (1 + 1e-6);
  return makeShape(extent, voxelSize, options,
                   [&](const V3d& p) { return surface.distance(p - center, reach); });
}

}  // namespace

ShapeExtent superquadricExtent(const V3d& size, const V3d& center) {
  // In an octant, the surface is a monotone graph over each face of the box. So its area is at most
  // that of the box.
  return boxExtent(size, center);
}

double superquadricVolume(const V3d& size, double vertical, double horizontal) {
  return size.x * size.y * size.z / 4 * vertical * horizontal *
         std::beta(vertical / 2 + 1, vertical) * std::beta(horizontal / 2, horizontal / 2);
}

NarrowBand makeSuperquadric(const V3d& size, double vertical, double horizontal, const V3d& center,
                            double voxelSize, const ShapeOptions& options) {
  for (int axis = 0; axis < 3; ++axis) requireSuperLength(size[axis], "an extent of the shape");
  requireSuperExponent(vertical, "vertical");
  requireSuperExponent(horizontal, "horizontal");
  requireSuperCentre(center);
  const ShapeExtent extent = superquadricExtent(size, center);
  checkShape(extent, voxelSize, options);
  return bandOf(SphericalProduct(superellipse(horizontal), superellipse(vertical), size / 2),
                extent, center, voxelSize, options);
}

ShapeExtent supershapeExtent(const Superformula& around, const Superformula& upright, double radius,
                             const V3d& center) {
  requireSuperformula(around, "around");
  requireSuperformula(upright, "upright");
  requireSuperLength(radius, "the radius");
  const SphericalProduct surface(around, upright, V3d(radius));
  // The samples miss tips by less than a spacing.
  const V3d margin(0.01 * std::max({surface.bounds().size().x, surface.bounds().size().y,
                                    surface.bounds().size().z}));
  return {{surface.bounds().min + center - margin, surface.bounds().max + center + margin},
          surface.area()};
}

NarrowBand makeSupershape(const Superformula& around, const Superformula& upright, double radius,
                          const V3d& center, double voxelSize, const ShapeOptions& options) {
  requireSuperCentre(center);
  const ShapeExtent extent = supershapeExtent(around, upright, radius, center);
  checkShape(extent, voxelSize, options);
  return bandOf(SphericalProduct(around, upright, V3d(radius)), extent, center, voxelSize, options);
}

ShapeExtent SuperquadricShape::extent() const {
  requireSuperExponent(vertical, "vertical");
  requireSuperExponent(horizontal, "horizontal");
  return superquadricExtent(size, center);
}
NarrowBand SuperquadricShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeSuperquadric(size, vertical, horizontal, center, voxelSize, options);
}

ShapeExtent SupershapeShape::extent() const {
  return supershapeExtent({around, aroundExponents}, {upright, uprightExponents}, radius, center);
}
NarrowBand SupershapeShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeSupershape({around, aroundExponents}, {upright, uprightExponents}, radius, center,
                        voxelSize, options);
}

const OperatorText SuperquadricOperator::text{
    .name = "superquadric",
    .group = "Shapes",
    .summary = "make a box with round edges, an ellipsoid, an octahedron or a star",
    .details =
        "The superellipsoid (|2x/a|^(2/h) + |2y/b|^(2/h))^(h/v) + |2z/c|^(2/v) <= 1, with the "
        "extents a,b,c and the exponents h (horizontal) and v (vertical). The signed distances are "
        "those of the closest points on both sides, to 1e-8 of the size; with exponents above 2, "
        "to 1e-7.",
    .example =
        "levelsmith superquadric --size 40,40,20 --horizontal 0.3 --vertical 0.5 --voxel 0.5 ! "
        "measure"};

const OperatorText SupershapeOperator::text{
    .name = "supershape",
    .group = "Shapes",
    .summary = "make a solid with lobes, by the superformula",
    .details =
        "Two curves r(a) = (|cos(m a / 4)|^n2 + |sin(m a / 4)|^n3)^(-1 / n1) multiply: one around "
        "the z axis, and one from pole to pole. The signed distances are those of the closest "
        "points on both sides, to 1e-8 of the size; beside cusps, to 1e-7.",
    .example =
        "levelsmith supershape --radius 10 --around 5 --around-exponents 2,3,3 --voxel 0.5 ! "
        "measure"};

}  // namespace levelset
