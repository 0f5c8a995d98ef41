#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Solids made from formulas: exact signed distances on both sides, in a band on the axis-aligned
/// grid of integer multiples of the voxel size. Sizes are full extents, world units.
namespace levelset {

struct ShapeOptions {
  double halfWidth = 3;               ///< voxels, at least 1
  Imath::Box3d region = kEverywhere;  ///< world; only there, as cropped() leaves it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// All throw UsageError for sizes, voxel size or half width that are not positive and finite,
/// InvalidInput when the voxel is larger than the shape, ResourceLimit for memory or 32-bit
/// indices.
[[nodiscard]] NarrowBand makeSphere(double radius, const Imath::V3d& center, double voxelSize,
                                    const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeBox(const Imath::V3d& size, const Imath::V3d& center, double voxelSize,
                                 const ShapeOptions& options = {});
/// A circle of `radius` about `axis` through `center`, thickened by `tube`.
[[nodiscard]] NarrowBand makeTorus(double radius, double tube, const Imath::V3d& center,
                                   const Imath::V3d& axis, double voxelSize,
                                   const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeCylinder(double radius, double height, const Imath::V3d& center,
                                      const Imath::V3d& axis, double voxelSize,
                                      const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeCapsule(const Imath::V3d& from, const Imath::V3d& to, double radius,
                                     double voxelSize, const ShapeOptions& options = {});

/// What is known of a shape before its band is made: its size, and what a band will cost.
struct ShapeExtent {
  Imath::Box3d bounds;  ///< of the surface
  double area = 0;      ///< of the surface; of parts that overlap, their sum
};
[[nodiscard]] ShapeExtent sphereExtent(double radius, const Imath::V3d& center);
[[nodiscard]] ShapeExtent boxExtent(const Imath::V3d& size, const Imath::V3d& center);
/// @param axis  of any length but zero, here and below
[[nodiscard]] ShapeExtent torusExtent(double radius, double tube, const Imath::V3d& center,
                                      const Imath::V3d& axis);
[[nodiscard]] ShapeExtent cylinderExtent(double radius, double height, const Imath::V3d& center,
                                         const Imath::V3d& axis);
[[nodiscard]] ShapeExtent capsuleExtent(const Imath::V3d& from, const Imath::V3d& to,
                                        double radius);

/// Refuses, as making it would, what can be told from the extent of a shape. @param action  its
/// name
void checkShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options,
                const char* action);

/// Grid of a new shape, part of the options of every shape.
struct ShapeGrid {
  VoxelSize voxel;
  double halfWidth = 3;  ///< voxels

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("voxel", &ShapeGrid::voxel, {});
    visit("half-width", &ShapeGrid::halfWidth, kNewHalfWidth);
  }
};

/// Options that describe a position, a direction and a positive length of a shape.
[[nodiscard]] constexpr OptionInfo shapeLength(const char* help) {
  return {
      .help = help, .unit = OptionUnit::Length, .range = OptionRange::Positive, .required = true};
}
inline constexpr OptionInfo kShapeCenter{.help = "position of the centre"};
inline constexpr OptionInfo kShapeAxis{.help = "direction of the axis"};

struct SphereShape : ShapeGrid {
  static constexpr const char* kName = "sphere";
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
  static constexpr const char* kName = "box";
  Imath::V3d size = Imath::V3d(0);
  Imath::V3d center = Imath::V3d(0);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("size", &BoxShape::size, shapeLength("full extents"));
    visit("center", &BoxShape::center, kShapeCenter);
    ShapeGrid::describe(visit);
  }
};

struct TorusShape : ShapeGrid {
  static constexpr const char* kName = "torus";
  double radius = 0, tube = 0;
  Imath::V3d center = Imath::V3d(0), axis = Imath::V3d(0, 0, 1);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &TorusShape::radius, shapeLength("from the centre to the middle of the tube"));
    visit("tube", &TorusShape::tube, shapeLength("radius of the tube"));
    visit("center", &TorusShape::center, kShapeCenter);
    visit("axis", &TorusShape::axis, kShapeAxis);
    ShapeGrid::describe(visit);
  }
};

struct CylinderShape : ShapeGrid {
  static constexpr const char* kName = "cylinder";
  double radius = 0, height = 0;
  Imath::V3d center = Imath::V3d(0), axis = Imath::V3d(0, 0, 1);

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &CylinderShape::radius, shapeLength("radius of the round side"));
    visit("height", &CylinderShape::height, shapeLength("length from end to end"));
    visit("center", &CylinderShape::center, kShapeCenter);
    visit("axis", &CylinderShape::axis, kShapeAxis);
    ShapeGrid::describe(visit);
  }
};

struct CapsuleShape : ShapeGrid {
  static constexpr const char* kName = "capsule";
  Imath::V3d from = Imath::V3d(0), to = Imath::V3d(0);
  double radius = 0;

  [[nodiscard]] ShapeExtent extent() const;
  [[nodiscard]] NarrowBand make(double voxelSize, const ShapeOptions& options) const;
  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("from", &CapsuleShape::from, {.help = "centre of one end's ball", .required = true});
    visit("to", &CapsuleShape::to, {.help = "centre of the other end's ball", .required = true});
    visit("radius", &CapsuleShape::radius, shapeLength("radius of the rod"));
    ShapeGrid::describe(visit);
  }
};

/// Operator that makes a shape.
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
