#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/shapes/superquadric.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr const char* kShapeGroup = "Shapes";
constexpr const char* kShapeDetails =
    "The signed distances are exact on both sides of the surface. Sizes are full extents, not "
    "halves.";

V3d axisDirection(const V3d& axis) {
  if (!(axis.length() > 0)) throw UsageError("--axis has no direction; give for example 0,0,1");
  return axis.normalized();
}

ShapeOptions shapeOptions(const ShapeGrid& grid, const OperatorRun& run) {
  return {.halfWidth = std::min(grid.halfWidth, run.roi.halfWidth),
          .region = run.roi.region,
          .maxMemory = run.maxMemory,
          .progress = run.progress};
}

}  // namespace

template <class Shape>
double ShapeOperator<Shape>::longestSide(const Shape& shape, Plans) {
  const V3d size = shape.extent().bounds.size();
  return std::max({size.x, size.y, size.z});
}

template <class Shape>
NarrowBand ShapeOperator<Shape>::run(const Shape& shape, OperatorRun& run) {
  return shape.make(shape.voxel.of(longestSide(shape, {})), shapeOptions(shape, run));
}

template <class Shape>
ValuePlan ShapeOperator<Shape>::plan(const Shape& shape, Plans, const OperatorRun& run) {
  const double voxel = shape.voxel.of(longestSide(shape, {}));
  const ShapeExtent extent = shape.extent();
  checkShape(extent, voxel, shapeOptions(shape, run));
  return {.bounds = extent.bounds,
          .area = extent.area,
          .voxelSize = voxel,
          .halfWidth = shape.halfWidth};
}

template <class Shape>
std::optional<Cost> ShapeOperator<Shape>::cost(const Shape&, const OperatorPlans& plans) {
  return costPerVoxel(plans, 55);
}

template struct ShapeOperator<SphereShape>;
template struct ShapeOperator<BoxShape>;
template struct ShapeOperator<TorusShape>;
template struct ShapeOperator<CylinderShape>;
template struct ShapeOperator<CapsuleShape>;
template struct ShapeOperator<SuperquadricShape>;
template struct ShapeOperator<SupershapeShape>;

ShapeExtent SphereShape::extent() const {
  return sphereExtent(radius, center);
}
NarrowBand SphereShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeSphere(radius, center, voxelSize, options);
}

ShapeExtent BoxShape::extent() const {
  return boxExtent(size, center);
}
NarrowBand BoxShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeBox(size, center, voxelSize, options);
}

ShapeExtent TorusShape::extent() const {
  return torusExtent(radius, tube, center, axisDirection(axis));
}
NarrowBand TorusShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeTorus(radius, tube, center, axisDirection(axis), voxelSize, options);
}

ShapeExtent CylinderShape::extent() const {
  return cylinderExtent(radius, height, center, axisDirection(axis));
}
NarrowBand CylinderShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeCylinder(radius, height, center, axisDirection(axis), voxelSize, options);
}

ShapeExtent CapsuleShape::extent() const {
  return capsuleExtent(from, to, radius);
}
NarrowBand CapsuleShape::make(double voxelSize, const ShapeOptions& options) const {
  return makeCapsule(from, to, radius, voxelSize, options);
}

const OperatorText SphereOperator::text{
    .name = "sphere",
    .group = kShapeGroup,
    .summary = "make a ball",
    .details = kShapeDetails,
    .example = "levelsmith sphere --radius 10 --voxel 0.5 ! measure"};

const OperatorText BoxOperator::text{
    .name = "box",
    .group = kShapeGroup,
    .summary = "make a box along the axes",
    .details = kShapeDetails,
    .example = "levelsmith box --size 40,40,10 --voxel 0.5 ! write box.vdb"};

const OperatorText TorusOperator::text{
    .name = "torus",
    .group = kShapeGroup,
    .summary = "make a ring",
    .details = kShapeDetails,
    .example = "levelsmith torus --radius 4 --tube 1.5 --voxel 0.25 ! measure"};

const OperatorText CylinderOperator::text{
    .name = "cylinder",
    .group = kShapeGroup,
    .summary = "make a cylinder with flat ends",
    .details = kShapeDetails,
    .example = "levelsmith cylinder --radius 5 --height 20 --resolution 100 ! measure"};

const OperatorText CapsuleOperator::text{
    .name = "capsule",
    .group = kShapeGroup,
    .summary = "make a rod with round ends",
    .details = kShapeDetails,
    .example = "levelsmith capsule --from 0,0,0 --to 10,0,0 --radius 2 --voxel 0.25 ! measure"};

}  // namespace levelset
