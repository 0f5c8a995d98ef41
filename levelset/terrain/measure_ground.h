#pragma once

#include <cstddef>

#include "levelset/terrain/height_field.h"

/// Area and volume of a ground.
namespace levelset {

/// Plane z = height + slope · (x, y).
struct GroundPlane {
  double height = 0;                 ///< height at the origin, world units
  Imath::V2d slope = Imath::V2d(0);  ///< derivatives of the height along x and y
};

struct GroundMeasures {
  double area = 0;           ///< area of the triangles, world units²
  double projectedArea = 0;  ///< area of their projections along z, world units²
  double volumeAbove = 0;    ///< volume between ground and plane where the ground is above it
  double volumeBelow = 0;  ///< volume between ground and plane where the ground is below it, ≥ 0
  double meanHeight = 0;   ///< mean of z over the projected area; 0 without triangles
  double lowest = 0, highest = 0;  ///< heights of known samples; 0 without any
  std::size_t triangles = 0;
  std::size_t missing = 0;  ///< samples without data
};

/// Measures a ground. Area and volumes are those of the triangles, without another error than
/// rounding: the plane divides a prism below a triangle into parts whose volumes have closed forms.
/// Missing samples count nothing. Any number of threads gives the same bits.
/// @throws InvalidInput for a field in degrees, or one that requireHeights() refuses
/// @throws Cancelled
[[nodiscard]] GroundMeasures measureGround(const HeightField& field, const GroundPlane& plane = {},
                                           const Progress& progress = {});

}  // namespace levelset
