#include "levelset/solids/shapes.h"

#include <fmt/core.h>

#include <cmath>
#include <functional>

#include "apps/pipeline/invocation.h"
#include "apps/pipeline/operators/common.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::UsageError;

constexpr double kPi = 3.14159265358979323846;

/// A shape once its lengths are world units: how large it is, and how to make it.
struct Shape {
  Imath::Box3d bounds;
  double area = 0;
  std::function<NarrowBand(double voxelSize, const levelset::ShapeOptions&)> make;
};

/// Sizes in `vx` need --voxel: with --resolution the voxel itself follows from the size.
void referToVoxel(Invocation& in) {
  if (in.asksVoxelSize() && in.given("voxel")) in.setReference(in.length("voxel"), 0);
}

Imath::Box3d boxAbout(const V3d& center, const V3d& halfSize) {
  return {center - halfSize, center + halfSize};
}

V3d axisOf(const Invocation& in) {
  const V3d axis = in.point("axis");
  if (!(axis.length() > 0))
    throw UsageError(
        fmt::format("{}: --axis has no direction; give for example 0,0,1", in.op().name));
  return axis.normalized();
}

/// Half extents of a disc of `radius` across `axis`.
V3d discExtent(const V3d& axis, double radius) {
  V3d extent;
  for (int i = 0; i < 3; ++i) extent[i] = radius * std::sqrt(std::max(0.0, 1 - axis[i] * axis[i]));
  return extent;
}

V3d absolute(const V3d& v) {
  return {std::abs(v.x), std::abs(v.y), std::abs(v.z)};
}

Shape sphere(Invocation& in) {
  const double radius = in.length("radius");
  const V3d center = in.point("center");
  return {boxAbout(center, V3d(radius)), 4 * kPi * radius * radius,
          [=](double voxel, const auto& options) {
            return levelset::makeSphere(radius, center, voxel, options);
          }};
}

Shape box(Invocation& in) {
  const std::vector<double> sides = in.lengths("size");
  const V3d size(sides[0], sides[1], sides[2]), center = in.point("center");
  return {boxAbout(center, size / 2), 2 * (size.x * size.y + size.y * size.z + size.z * size.x),
          [=](double voxel, const auto& options) {
            return levelset::makeBox(size, center, voxel, options);
          }};
}

Shape torus(Invocation& in) {
  const double radius = in.length("radius"), tube = in.length("tube");
  const V3d center = in.point("center"), axis = axisOf(in);
  return {boxAbout(center, discExtent(axis, radius) + V3d(tube)), 4 * kPi * kPi * radius * tube,
          [=](double voxel, const auto& options) {
            return levelset::makeTorus(radius, tube, center, axis, voxel, options);
          }};
}

Shape cylinder(Invocation& in) {
  const double radius = in.length("radius"), height = in.length("height");
  const V3d center = in.point("center"), axis = axisOf(in);
  return {boxAbout(center, discExtent(axis, radius) + absolute(axis) * (height / 2)),
          2 * kPi * radius * (radius + height), [=](double voxel, const auto& options) {
            return levelset::makeCylinder(radius, height, center, axis, voxel, options);
          }};
}

Shape capsule(Invocation& in) {
  const double radius = in.length("radius");
  const V3d from = in.point("from"), to = in.point("to");
  Imath::Box3d bounds(from);
  bounds.extendBy(to);
  bounds.min -= V3d(radius);
  bounds.max += V3d(radius);
  return {bounds, 2 * kPi * radius * (2 * radius + (to - from).length()),
          [=](double voxel, const auto& options) {
            return levelset::makeCapsule(from, to, radius, voxel, options);
          }};
}

using Describe = Shape (*)(Invocation&);

double voxelOf(Invocation& in, const Shape& shape) {
  const V3d size = shape.bounds.size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

template <Describe describe>
Value make(Invocation& in) {
  referToVoxel(in);
  const Shape shape = describe(in);
  return Value(shape.make(
      voxelOf(in, shape),
      {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress}));
}

template <Describe describe>
Plan plan(Invocation& in) {
  referToVoxel(in);
  const Shape shape = describe(in);
  return {.kind = Kind::Band,
          .bounds = shape.bounds,
          .area = shape.area,
          .voxelSize = voxelOf(in, shape),
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
