#include "levelset/solids/shapes.h"

#include <fmt/core.h>

#include <cmath>
#include <functional>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::UsageError;

/// A shape once its lengths are world units: how large it is, and how to make it.
struct Shape {
  levelset::ShapeExtent extent;
  std::function<NarrowBand(double voxelSize, const levelset::ShapeOptions&)> make;
};

/// Sizes in `vx` need --voxel: with --resolution the voxel itself follows from the size.
void referToVoxel(Invocation& in) {
  if (in.asksVoxelSize() && in.given("voxel")) in.setReference(in.length("voxel"), 0);
}

V3d axisOf(const Invocation& in) {
  const V3d axis = in.point("axis");
  if (!(axis.length() > 0))
    throw UsageError(
        fmt::format("{}: --axis has no direction; give for example 0,0,1", in.op().name));
  return axis.normalized();
}

Shape sphere(Invocation& in) {
  const double radius = in.length("radius");
  const V3d center = in.point("center");
  return {levelset::sphereExtent(radius, center), [=](double voxel, const auto& options) {
            return levelset::makeSphere(radius, center, voxel, options);
          }};
}

Shape box(Invocation& in) {
  const std::vector<double> sides = in.lengths("size");
  const V3d size(sides[0], sides[1], sides[2]), center = in.point("center");
  return {levelset::boxExtent(size, center), [=](double voxel, const auto& options) {
            return levelset::makeBox(size, center, voxel, options);
          }};
}

Shape torus(Invocation& in) {
  const double radius = in.length("radius"), tube = in.length("tube");
  const V3d center = in.point("center"), axis = axisOf(in);
  return {levelset::torusExtent(radius, tube, center, axis),
          [=](double voxel, const auto& options) {
            return levelset::makeTorus(radius, tube, center, axis, voxel, options);
          }};
}

Shape cylinder(Invocation& in) {
  const double radius = in.length("radius"), height = in.length("height");
  const V3d center = in.point("center"), axis = axisOf(in);
  return {levelset::cylinderExtent(radius, height, center, axis),
          [=](double voxel, const auto& options) {
            return levelset::makeCylinder(radius, height, center, axis, voxel, options);
          }};
}

Shape capsule(Invocation& in) {
  const double radius = in.length("radius");
  const V3d from = in.point("from"), to = in.point("to");
  return {levelset::capsuleExtent(from, to, radius), [=](double voxel, const auto& options) {
            return levelset::makeCapsule(from, to, radius, voxel, options);
          }};
}

using Describe = Shape (*)(Invocation&);

double voxelOf(Invocation& in, const Shape& shape) {
  const V3d size = shape.extent.bounds.size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

levelset::ShapeOptions optionsOf(const Invocation& in) {
  return {.halfWidth = in.neededHalfWidth(in.number("half-width")),
          .region = in.roi.region,
          .maxMemory = in.maxMemory,
          .progress = in.progress};
}

template <Describe describe>
Value make(Invocation& in) {
  referToVoxel(in);
  const Shape shape = describe(in);
  return Value(shape.make(voxelOf(in, shape), optionsOf(in)));
}

template <Describe describe>
Plan plan(Invocation& in) {
  referToVoxel(in);
  const Shape shape = describe(in);
  const double voxel = voxelOf(in, shape);
  levelset::checkShape(shape.extent, voxel, optionsOf(in), in.op().name.c_str());
  return {.kind = Kind::Band,
          .bounds = shape.extent.bounds,
          .area = shape.extent.area,
          .voxelSize = voxel,
          .halfWidth = in.number("half-width")};
}

Param positive(const char* name, const char* doc) {
  return {.name = name,
          .type = ParamType::Length,
          .doc = doc,
          .range = Range::Positive,
          .required = true};
}
Param center() {
  return {.name = "center", .type = ParamType::Point, .doc = "where it sits", .fallback = "0,0,0"};
}
Param axis() {
  return {.name = "axis", .type = ParamType::Point, .doc = "its direction", .fallback = "0,0,1"};
}
Param place(const char* name, const char* doc) {
  return {.name = name, .type = ParamType::Point, .doc = doc, .required = true};
}

template <Describe describe>
Operator shape(const char* name, const char* summary, const char* example,
               std::vector<Param> params) {
  params.push_back(voxelParam());
  params.push_back(resolutionParam());
  params.push_back(halfWidthParam());
  return {.name = name,
          .group = "Shapes",
          .summary = summary,
          .details = "Exact signed distances on both sides. Sizes are full extents.",
          .example = example,
          .params = std::move(params),
          .run = make<describe>,
          .plan = plan<describe>,
          .cost = costPerVoxel(55),
          .slope = Slope::One,
          .validate = requireVoxelSize};
}

}  // namespace

void addShapeOperators(std::vector<Operator>& all) {
  all.push_back(shape<sphere>("sphere", "make a ball",
                              "levelsmith sphere --radius 10 --voxel 0.5 ! measure",
                              {positive("radius", "of the ball"), center()}));
  Param size = positive("size", "full extents");
  size.type = ParamType::Lengths;
  size.count = 3;
  all.push_back(shape<box>("box", "make a box along the axes",
                           "levelsmith box --size 40,40,10 --voxel 0.5 ! write box.vdb",
                           {size, center()}));
  all.push_back(shape<torus>("torus", "make a ring",
                             "levelsmith torus --radius 4 --tube 1.5 --voxel 0.25 ! measure",
                             {positive("radius", "from the centre to the middle of the tube"),
                              positive("tube", "radius of the tube"), center(), axis()}));
  all.push_back(
      shape<cylinder>("cylinder", "make a cylinder with flat ends",
                      "levelsmith cylinder --radius 5 --height 20 --resolution 100 ! measure",
                      {positive("radius", "of its round side"),
                       positive("height", "from end to end"), center(), axis()}));
  all.push_back(shape<capsule>(
      "capsule", "make a rod with round ends",
      "levelsmith capsule --from 0,0,0 --to 10,0,0 --radius 2 --voxel 0.25 ! measure",
      {place("from", "centre of one end's ball"), place("to", "centre of the other's"),
       positive("radius", "of the rod")}));
}

}  // namespace pipeline
