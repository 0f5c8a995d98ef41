#include <Imath/ImathPlane.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/csg/clip.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/placement/resample.h"
#include "levelset/placement/transform.h"

namespace pipeline {
namespace {

using Imath::M44d;
using Imath::V3d;
using levelset::UsageError;

Value clip(Invocation& in) {
  if (in.given("box")) return Value(levelset::clip(in.band(), in.box("box"), in.progress));
  const std::vector<V3d> plane = in.points("plane");
  return Value(
      levelset::clip(in.band(), Imath::Plane3d(plane[0], plane[1].normalized()), in.progress));
}

void validateClip(const Invocation& in) {
  if (in.given("box") == in.given("plane")) throw UsageError("clip: give one of --box and --plane");
  if (in.given("box")) return;
  const std::vector<V3d> plane = in.points("plane");
  if (plane.size() != 2 || !(plane[1].length() > 0)) {
    throw UsageError(
        "clip: --plane needs a point and a normal, \"x,y,z x,y,z\"; what lies behind the plane "
        "stays");
  }
}

Plan planClip(Invocation& in) {
  Plan plan = in.operands[0].plan();
  if (!in.given("box") || plan.bounds.isEmpty()) return plan;
  const Imath::Box3d box = in.box("box");
  Imath::Box3d left;
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    left.min[axis] = std::max(plan.bounds.min[axis], box.min[axis]);
    left.max[axis] = std::min(plan.bounds.max[axis], box.max[axis]);
    const double side = plan.bounds.max[axis] - plan.bounds.min[axis];
    if (side > 0) share *= std::clamp((left.max[axis] - left.min[axis]) / side, 0.0, 1.0);
  }
  if (left.isEmpty()) return plan;
  const V3d size = left.size();
  plan.bounds = left;
  // Its own surface as if spread evenly, and the faces that close it.
  plan.area = share * plan.area + 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  return plan;
}

/// As of any intersection, and no further off the box than where that is further than the band
/// reaches, whatever is there.
RegionOfInterest roiOfClip(Invocation& in, std::size_t, const RegionOfInterest& of) {
  const double voxel = in.planned->voxelSize, width = in.planned->halfWidth;
  Imath::Box3d asked = grown(of.region, seamReach(width) * voxel);
  if (in.given("box")) {
    const Imath::Box3d box = grown(in.box("box"), (width + 2) * voxel);
    for (int axis = 0; axis < 3; ++axis) {
      asked.min[axis] = std::max(asked.min[axis], box.min[axis]);
      asked.max[axis] = std::min(asked.max[axis], box.max[axis]);
    }
  }
  return {.region = asked};
}

M44d rotationMatrix(const Invocation& in) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const std::vector<double> angles = in.numbers("rotate");
  M44d matrix;
  if (angles.size() == 1) {
    const V3d axis = in.point("axis");
    if (!(axis.length() > 0))
      throw UsageError("transform: --axis has no direction; give for example 0,0,1");
    matrix.setAxisAngle(axis.normalized(), angles[0] * kDegree);
    return matrix;
  }
  if (in.given("axis")) throw UsageError("transform: --axis goes with one angle, not with three");
  for (int i = 0; i < 3; ++i) {
    V3d axis(0);
    axis[i] = 1;
    M44d turn;
    turn.setAxisAngle(axis, angles[static_cast<std::size_t>(i)] * kDegree);
    matrix = matrix * turn;
  }
  return matrix;
}

/// matrix, then mirror, scale, rotate, translate.
M44d matrixOf(const Invocation& in) {
  M44d matrix;
  if (in.given("matrix")) matrix = in.matrix("matrix");
  const V3d about = in.point("about");
  M44d there, back;
  there.setTranslation(-about);
  back.setTranslation(about);
  matrix = matrix * there;
  if (in.given("mirror")) {
    M44d mirror;
    const int axis = in.text("mirror")[0] - 'x';
    mirror[axis][axis] = -1;
    matrix = matrix * mirror;
  }
  if (in.given("scale")) {
    const std::vector<double> factors = in.numbers("scale");
    M44d scale;
    scale.setScale(factors.size() == 1 ? V3d(factors[0]) : V3d(factors[0], factors[1], factors[2]));
    matrix = matrix * scale;
  }
  if (in.given("rotate")) matrix = matrix * rotationMatrix(in);
  matrix = matrix * back;
  if (in.given("translate")) {
    M44d move;
    move.setTranslation(in.point("translate"));
    matrix = matrix * move;
  }
  if (!(std::abs(matrix.determinant()) > 0))
    throw UsageError("transform: the matrix flattens space; it must be invertible");
  return matrix;
}

bool isSimilarity(const M44d& m) {
  const V3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]),
      z(m[2][0], m[2][1], m[2][2]);
  const double s = x.length2(), tolerance = 1e-9 * s;
  return std::abs(y.length2() - s) < tolerance && std::abs(z.length2() - s) < tolerance &&
         std::abs(x.dot(y)) < tolerance && std::abs(y.dot(z)) < tolerance &&
         std::abs(z.dot(x)) < tolerance && x.cross(y).dot(z) > 0;
}

void validateTransform(const Invocation& in) {
  const M44d matrix = matrixOf(in);
  if (in.operands[0].kind() == Kind::Mesh) {
    if (in.flag("bake") || in.given("voxel"))
      throw UsageError("transform: --bake and --voxel are for level sets, and this is a mesh");
    return;
  }
  if (in.flag("bake")) return;
  if (in.given("voxel")) throw UsageError("transform: --voxel goes with --bake");
  if (!isSimilarity(matrix)) {
    throw UsageError(
        "transform: a level set that is mirrored, sheared or scaled unevenly must be resampled; "
        "add --bake");
  }
}

Value transform(Invocation& in) {
  const M44d matrix = matrixOf(in);
  if (in.operands[0].kind() == Kind::Mesh) return Value(levelset::transform(in.mesh(), matrix));
  if (in.flag("bake")) {
    const double voxel = in.given("voxel") ? in.length("voxel") : in.band().voxelSize();
    return Value(levelset::bake(in.band(), matrix, voxel,
                                {.maxMemory = in.maxMemory, .progress = in.progress}));
  }
  levelset::NarrowBand band = in.band();
  in.operands.clear();
  return Value(levelset::transform(std::move(band), matrix));
}

Imath::Box3d moved(const Imath::Box3d& box, const M44d& matrix) {
  Imath::Box3d there;
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
    there.extendBy(V3d((corner & 1) ? box.max.x : box.min.x, (corner & 2) ? box.max.y : box.min.y,
                       (corner & 4) ? box.max.z : box.min.z) *
                   matrix);
  return there;
}

Plan planTransform(Invocation& in) {
  const M44d matrix = matrixOf(in);
  Plan plan = in.operands[0].plan();
  plan.bounds = moved(plan.bounds, matrix);
  const double scale = std::cbrt(std::abs(matrix.determinant()));
  plan.area *= scale * scale;
  if (!in.flag("bake"))
    plan.voxelSize *= scale;
  else if (in.given("voxel"))
    plan.voxelSize = in.length("voxel");
  return plan;
}

/// @param in  a band is laid on another grid
std::optional<Cost> costOfSamples(Invocation& in) {
  const Plan source = in.operands[0].plan(), target = *in.planned;
  const double from = layerOf(source), to = layerOf(target),
               sampled = levelset::sampledWidth(target.voxelSize / source.voxelSize);
  Cost cost{1e-9 * (7600 * from + 8400 * to), 50 * from + 1030 * to};
  if (sampled > source.halfWidth + 4) cost += costOfDistances(from, sampled);
  return cost += costOfDistances(to, target.halfWidth);
}

std::optional<Cost> costOfTransform(Invocation& in) {
  const Plan plan = in.operands[0].plan();
  if (plan.kind == Kind::Mesh) return Cost{25e-9 * plan.triangles};
  if (in.flag("bake")) return costOfSamples(in);
  return Cost{25e-9 * plan.activeVoxels()};
}

/// Of a solid that is laid on another grid, and made distances of again there.
/// @param toSource  from the world of the result to that of the operand
RegionOfInterest roiOfSamples(const Invocation& in, const RegionOfInterest& of,
                              const M44d& toSource) {
  const Plan source = in.operands[0].plan(), target = *in.planned;
  double squares = 0;  // of the stretches along three axes: none is more than their root
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) squares += toSource[i][k] * toSource[i][k];
  const double sampled =
      levelset::sampledWidth(std::sqrt(squares) * target.voxelSize / source.voxelSize);
  const Imath::Box3d about =
      grown(of.region, levelset::distanceReach(target.halfWidth) * target.voxelSize);
  if (levelset::isEverywhere(about)) return {};
  return {.region = grown(
              moved(about, toSource),
              levelset::distanceReach(std::max(source.halfWidth, sampled)) * source.voxelSize)};
}

RegionOfInterest roiOfTransform(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (in.operands[0].kind() != Kind::Band) return {};
  if (in.flag("bake")) return roiOfSamples(in, of, matrixOf(in).inverse());
  RegionOfInterest read = of;
  read.halfWidth *= 1 + 1e-6;  // its end is rounded before it is scaled
  if (!levelset::isEverywhere(of.region))
    read.region = grown(moved(of.region, matrixOf(in).inverse()), in.operands[0].plan().voxelSize);
  return read;
}

levelset::ResampleOptions resampleOptions(Invocation& in) {
  levelset::ResampleOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("half-width")) options.halfWidth = in.number("half-width");
  return options;
}

double newVoxelSize(Invocation& in) {
  const V3d size = in.operands[0].plan().bounds.size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

Value resample(Invocation& in) {
  const double voxel = newVoxelSize(in);
  return Value(levelset::resample(in.band(), voxel, resampleOptions(in)));
}

RegionOfInterest roiOfResample(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (in.given("resolution")) return {};  // of the whole
  return roiOfSamples(in, of, M44d());
}

Plan planResample(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.voxelSize = newVoxelSize(in);
  if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  return plan;
}

Kind sameKind(const Invocation& in) {
  return in.operands.empty() ? Kind::Band : in.operands[0].kind();
}

}  // namespace

void addPlacementOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "transform",
      .group = "Placement",
      .summary = "move, turn, scale or mirror a solid or a mesh",
      .details = "Applied in the order matrix, mirror, scale, rotate, translate. A level set moves "
                 "exactly, by its grid's "
                 "transform; what mirrors, shears or scales unevenly needs --bake, which resamples "
                 "on an axis-aligned grid.",
      .example = "levelsmith box --size 2,1,1 --voxel 0.05 ! transform --rotate 30 --translate "
                 "1,0,0 ! measure",
      .params = {{.name = "matrix",
                  .type = ParamType::Matrix,
                  .doc = "acts on row vectors, translation in the last row"},
                 {.name = "translate", .type = ParamType::Point, .doc = "world units"},
                 {.name = "rotate",
                  .type = ParamType::Numbers,
                  .doc = "degrees about --axis, or about x, then y, then z"},
                 {.name = "axis",
                  .type = ParamType::Point,
                  .doc = "of a single --rotate",
                  .fallback = "0,0,1"},
                 {.name = "scale",
                  .type = ParamType::Numbers,
                  .doc = "one factor, or one for each axis",
                  .range = Range::Positive},
                 {.name = "mirror",
                  .type = ParamType::Choice,
                  .doc = "across the plane through --about",
                  .choices = {"x", "y", "z"}},
                 {.name = "about",
                  .type = ParamType::Point,
                  .doc = "centre of mirror, scale and rotate",
                  .fallback = "0,0,0"},
                 {.name = "bake",
                  .type = ParamType::Flag,
                  .doc = "resample on an axis-aligned uniform grid"},
                 voxelParam("of the baked grid; default: as before")},
      .operands = {{Kind::Band, Kind::Mesh}},
      .resultKind = sameKind,
      .run = transform,
      .plan = planTransform,
      .cost = costOfTransform,
      .slope = Slope::OfOperands,
      .regionOfInterest = roiOfTransform,
      .partTolerance = kDistanceTolerance,  // with --bake; else to the bit
      .validate = validateTransform,
  });
  all.push_back({
      .name = "resample",
      .group = "Placement",
      .summary = "the same solid on an axis-aligned grid of another voxel size",
      .example =
          "levelsmith torus --radius 2 --tube 0.7 --voxel 0.1 ! resample --voxel 0.05 ! measure",
      .params = {voxelParam(),
                 resolutionParam(),
                 {.name = "half-width",
                  .type = ParamType::Number,
                  .doc = "of the result, in voxels; default: as before",
                  .range = Range::Positive}},
      .operands = {{Kind::Band}},
      .run = resample,
      .plan = planResample,
      .cost = costOfSamples,
      .slope = Slope::One,
      .regionOfInterest = roiOfResample,
      .partTolerance = kDistanceTolerance,
      .validate = requireVoxelSize,
  });
  all.push_back({
      .name = "clip",
      .group = "Placement",
      .summary = "cut a solid by a box or a plane, and close it there",
      .example =
          "levelsmith sphere --radius 2 --voxel 0.1 ! clip --plane \"0,0,0 0,0,1\" ! measure",
      .params = {{.name = "box", .type = ParamType::Box, .doc = "keep what is inside"},
                 {.name = "plane",
                  .type = ParamType::Points,
                  .doc = "point and normal: keep what lies behind"}},
      .operands = {{Kind::Band}},
      .run = clip,
      .plan = planClip,
      .cost = costPerVoxel(90, 15),
      .slope = Slope::OfOperands,
      .regionOfInterest = roiOfClip,
      .validate = validateClip,
  });
}

}  // namespace pipeline
