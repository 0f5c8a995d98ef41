#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Solids from formulas, with exact signed distances on both sides. Grid points are at integer
/// multiples of the voxel size. Sizes are full extents in world units.
namespace levelset {

struct ShapeOptions {
  double halfWidth = 3;               ///< half width of the band, voxels, at least 1
  Imath::Box3d region = kEverywhere;  ///< world box that is needed; blocks outside may be left out
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

// Errors of the functions make…(), below:
// @throws UsageError if a size, the voxel size or the half width is not positive and finite
// @throws InvalidInput if the voxel is larger than the shape
// @throws ResourceLimit if the memory estimate or the 32-bit grid index exceeds its limit

/// Builds a ball.
[[nodiscard]] NarrowBand makeSphere(double radius, const Imath::V3d& center, double voxelSize,
                                    const ShapeOptions& options = {});
/// Builds an axis-aligned box. @param size  full edge lengths
[[nodiscard]] NarrowBand makeBox(const Imath::V3d& size, const Imath::V3d& center, double voxelSize,
                                 const ShapeOptions& options = {});
/// Builds a torus: all points within the distance `tube` of a circle of radius `radius` around the
/// axis.
/// @param axis  direction of the axis through `center`, any length but zero
[[nodiscard]] NarrowBand makeTorus(double radius, double tube, const Imath::V3d& center,
                                   const Imath::V3d& axis, double voxelSize,
                                   const ShapeOptions& options = {});
/// Builds a cylinder of full height `height` along `axis`, centred at `center`.
[[nodiscard]] NarrowBand makeCylinder(double radius, double height, const Imath::V3d& center,
                                      const Imath::V3d& axis, double voxelSize,
                                      const ShapeOptions& options = {});
/// Builds a capsule: all points within the distance `radius` of the line segment from `from` to
/// `to`.
[[nodiscard]] NarrowBand makeCapsule(const Imath::V3d& from, const Imath::V3d& to, double radius,
                                     double voxelSize, const ShapeOptions& options = {});

/// Extent of a shape, known before its band is built. It determines the memory of the band.
struct ShapeExtent {
  Imath::Box3d bounds;  ///< bounds of the surface, world units
  double area = 0;      ///< surface area, world units²; overlapping parts count in full
};
[[nodiscard]] ShapeExtent sphereExtent(double radius, const Imath::V3d& center);
[[nodiscard]] ShapeExtent boxExtent(const Imath::V3d& size, const Imath::V3d& center);
/// @param axis  any length but zero, also for cylinderExtent()
[[nodiscard]] ShapeExtent torusExtent(double radius, double tube, const Imath::V3d& center,
                                      const Imath::V3d& axis);
[[nodiscard]] ShapeExtent cylinderExtent(double radius, double height, const Imath::V3d& center,
                                         const Imath::V3d& axis);
[[nodiscard]] ShapeExtent capsuleExtent(const Imath::V3d& from, const Imath::V3d& to,
                                        double radius);

/// Checks the voxel size, half width and memory of a shape from its extent. Throws the same errors
/// as building the shape.
void checkShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options);

/// Grid of a new shape, part of the options of every shape.
struct ShapeGrid {
  VoxelSize voxel;
  double halfWidth = 3;  ///< half width of the band, voxels

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("voxel", &ShapeGrid::voxel, {});
    visit("half-width", &ShapeGrid::halfWidth, kNewHalfWidth);
  }
};

/// Description of a required option that gives a positive length of a shape.
[[nodiscard]] constexpr OptionInfo shapeLength(const char* help) {
  return {
      .help = help, .unit = OptionUnit::Length, .range = OptionRange::Positive, .required = true};
}
inline constexpr OptionInfo kShapeCenter{.help = "position of the centre"};
inline constexpr OptionInfo kShapeAxis{.help = "direction of the axis"};

struct SphereShape : ShapeGrid {
  double radius = 0;
  Imath::V3d center = Imath::V3d(0);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &SphereShape::radius, shapeLength("radius of the ball"));
    visit("center", &SphereShape::center, kShapeCenter);
    ShapeGrid::describe(visit);
  }
};

struct BoxShape : ShapeGrid {
  Imath::V3d size = Imath::V3d(0);
  Imath::V3d center = Imath::V3d(0);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("size", &BoxShape::size, shapeLength("full edge lengths along x, y and z"));
    visit("center", &BoxShape::center, kShapeCenter);
    ShapeGrid::describe(visit);
  }
};

struct TorusShape : ShapeGrid {
  double radius = 0, tube = 0;
  Imath::V3d center = Imath::V3d(0), axis = Imath::V3d(0, 0, 1);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &TorusShape::radius,
          shapeLength("distance from the centre to the middle of the tube"));
    visit("tube", &TorusShape::tube, shapeLength("radius of the tube"));
    visit("center", &TorusShape::center, kShapeCenter);
    visit("axis", &TorusShape::axis, kShapeAxis);
    ShapeGrid::describe(visit);
  }
};

struct CylinderShape : ShapeGrid {
  double radius = 0, height = 0;
  Imath::V3d center = Imath::V3d(0), axis = Imath::V3d(0, 0, 1);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &CylinderShape::radius, shapeLength("radius of the cylinder"));
    visit("height", &CylinderShape::height, shapeLength("height of the cylinder, along its axis"));
    visit("center", &CylinderShape::center, kShapeCenter);
    visit("axis", &CylinderShape::axis, kShapeAxis);
    ShapeGrid::describe(visit);
  }
};

struct CapsuleShape : ShapeGrid {
  Imath::V3d from = Imath::V3d(0), to = Imath::V3d(0);
  double radius = 0;

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("from", &CapsuleShape::from,
          {.help = "centre of the ball at the first end", .required = true});
    visit("to", &CapsuleShape::to,
          {.help = "centre of the ball at the second end", .required = true});
    visit("radius", &CapsuleShape::radius, shapeLength("radius of the rod"));
    ShapeGrid::describe(visit);
  }
};

/// Operator that creates the band of a shape.
template <class Shape>
struct ShapeOperator {
  using Options = Shape;
  static constexpr Slope slope = Slope::One;

  static double longestSide(const Options& shape, Plans operands);
  static NarrowBand run(const Options& shape, OperatorRun& run);
  static ValuePlan plan(const Options& shape, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& shape, const OperatorPlans& plans);
};

/// The operator `sphere`.
struct SphereOperator : ShapeOperator<SphereShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "shapes"};
  static double leastRadius(const Options& shape) { return shape.radius; }
};
/// The operator `box`.
struct BoxOperator : ShapeOperator<BoxShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0, kCreaseError, "shapes"};
};
/// The operator `torus`.
struct TorusOperator : ShapeOperator<TorusShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "shapes"};
  static double leastRadius(const Options& shape) { return shape.tube; }
};
/// The operator `cylinder`.
struct CylinderOperator : ShapeOperator<CylinderShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "shapes"};
  static double leastRadius(const Options& shape) { return shape.radius; }
};
/// The operator `capsule`.
struct CapsuleOperator : ShapeOperator<CapsuleShape> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "shapes"};
  static double leastRadius(const Options& shape) { return shape.radius; }
};

}  // namespace levelset
