#pragma once

#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"

/// Superquadrics and shapes of the superformula, with signed distances on both sides. A distance is
/// that of the closest point up to 1e-8 of the size; up to 1e-7 beside cusps, as those of
/// superquadrics with exponents above 2.
namespace levelset {

/// A closed curve in polar coordinates [Gielis03]:
/// r(a) = (|cos(symmetry a / 4)|^n₂ + |sin(symmetry a / 4)|^n₃)^(−1 / n₁). `exponents` are n₁, n₂
/// and n₃. A symmetry of 0 gives the unit circle.
struct Superformula {
  double symmetry = 0;
  Imath::V3d exponents = Imath::V3d(2);

  [[nodiscard]] double radius(double angle) const;
};

/// Least and largest exponent of a superquadric.
inline constexpr double kLeastSuperExponent = 0.1, kMostSuperExponent = 4;

/// Builds a superellipsoid: ((2x/a)^(2/h) + (2y/b)^(2/h))^(h/v) + (2z/c)^(2/v) ≤ 1 [Barr81].
/// @param size  full extents a, b, c
/// @param vertical, horizontal  the exponents v and h, from 0.1 to 4: near 0 a box, 1 an ellipsoid,
///        2 an octahedron, larger ones a star with sharp edges
/// @throws as makeSphere(); UsageError for exponents out of range
[[nodiscard]] NarrowBand makeSuperquadric(const Imath::V3d& size, double vertical,
                                          double horizontal, const Imath::V3d& center,
                                          double voxelSize, const ShapeOptions& options = {});
[[nodiscard]] ShapeExtent superquadricExtent(const Imath::V3d& size, const Imath::V3d& center);
/// Volume of a superellipsoid, by beta functions.
[[nodiscard]] double superquadricVolume(const Imath::V3d& size, double vertical, double horizontal);

/// Builds a solid from two curves: `around` the z axis, as a function of the longitude, and
/// `upright`, as a function of the latitude. Their radii multiply.
/// @param radius  length that stands for 1 in the formula
/// @throws as makeSphere(); UsageError for a symmetry outside 0 to 64 or exponents outside 0.1 to
///         100; InvalidInput if a radius varies by a factor of more than 50
[[nodiscard]] NarrowBand makeSupershape(const Superformula& around, const Superformula& upright,
                                        double radius, const Imath::V3d& center, double voxelSize,
                                        const ShapeOptions& options = {});
[[nodiscard]] ShapeExtent supershapeExtent(const Superformula& around, const Superformula& upright,
                                           double radius, const Imath::V3d& center);

struct SuperquadricShape : ShapeGrid {
  Imath::V3d size = Imath::V3d(0);
  double vertical = 1, horizontal = 1;
  Imath::V3d center = Imath::V3d(0);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("size", &SuperquadricShape::size, shapeLength("full extents along x, y and z"));
    visit("vertical", &SuperquadricShape::vertical,
          {.help = "exponent of the profile, from 0.1 (almost a box) over 1 (round) and 2 (a "
                   "double cone) to 4 (a star)",
           .range = OptionRange::Positive});
    visit("horizontal", &SuperquadricShape::horizontal,
          {.help = "exponent of the cross-sections along z, from 0.1 (almost square) over 1 "
                   "(round) and 2 (a rhombus) to 4 (a star)",
           .range = OptionRange::Positive});
    visit("center", &SuperquadricShape::center, kShapeCenter);
    ShapeGrid::describe(visit);
  }
};

struct SupershapeShape : ShapeGrid {
  double radius = 0;
  double around = 0, upright = 0;
  Imath::V3d aroundExponents = Imath::V3d(2), uprightExponents = Imath::V3d(2);
  Imath::V3d center = Imath::V3d(0);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &SupershapeShape::radius,
          shapeLength("length that stands for 1 in the formula"));
    visit("around", &SupershapeShape::around,
          {.help = "symmetry m of the curve around the z axis: its number of lobes; 0: a circle",
           .range = OptionRange::NonNegative});
    visit("around-exponents", &SupershapeShape::aroundExponents,
          {.help = "exponents n1,n2,n3 of that curve"});
    visit("upright", &SupershapeShape::upright,
          {.help = "symmetry m of the curve from pole to pole; 0: half a circle",
           .range = OptionRange::NonNegative});
    visit("upright-exponents", &SupershapeShape::uprightExponents,
          {.help = "exponents n1,n2,n3 of that curve"});
    visit("center", &SupershapeShape::center, kShapeCenter);
    ShapeGrid::describe(visit);
  }
};

/// The operator `superquadric`.
struct SuperquadricOperator : ShapeOperator<SuperquadricShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "shapes"};
};
/// The operator `supershape`.
struct SupershapeOperator : ShapeOperator<SupershapeShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "shapes"};
};

}  // namespace levelset
