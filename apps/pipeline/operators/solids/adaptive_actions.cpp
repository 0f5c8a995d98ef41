#include "apps/pipeline/operators/solids/adaptive_actions.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/kind_variant.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/adaptive/adaptive_csg.h"
#include "levelset/adaptive/adaptive_to_band.h"
#include "levelset/adaptive/mesh_to_adaptive.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/offset/offset.h"

namespace pipeline {
namespace {

using levelset::AdaptiveField;
using levelset::UsageError;

/// Options of `level-set` that apply with --adaptive.
const std::vector<std::string> kAdaptiveOptions = {
    "adaptive", "tolerance",   "width",  "interpolation",
    "sign",     "accept-sign", "nested", "skip-intersection-test"};

void checkAdaptiveOptions(const Invocation& in) {
  for (const Param& param : in.op().params)
    if (in.given(param.name) && std::find(kAdaptiveOptions.begin(), kAdaptiveOptions.end(),
                                          param.name) == kAdaptiveOptions.end())
      throw UsageError(
          fmt::format("level-set: --{} does not apply to --adaptive; leave it out", param.name));
  if (!in.given("tolerance"))
    throw UsageError(
        "level-set: --adaptive needs --tolerance, the largest error of the distances; give a "
        "length, for example 0.1%");
  if (in.operands.empty()) return;
  if (in.operands[0].kind() == Kind::Points)
    throw UsageError(
        "level-set: --adaptive takes a mesh or a level set, but the operand is a point cloud; put "
        "'level-set --voxel L' or 'mesh-points' before it");
  if (in.operands[0].kind() == Kind::Band)
    for (const char* name : {"sign", "nested", "accept-sign", "skip-intersection-test"})
      if (in.given(name))
        throw UsageError(fmt::format(
            "level-set: --{} is for meshes, but the operand is a level set; leave it out", name));
}

Value makeAdaptive(Invocation& in) {
  levelset::MeshToAdaptiveOptions options{
      .tolerance = in.length("tolerance"),
      .halfWidth = in.given("width") ? in.length("width") : 0,
      .isTricubic = in.text("interpolation") == "tricubic",
      .acceptSign = in.flag("accept-sign"),
      .searchSelfIntersections = !in.flag("skip-intersection-test"),
      .maxMemory = in.maxMemory,
      .progress = in.progress};
  const std::string sign = in.text("sign");
  if (sign != "auto")
    options.sign = sign == "closed" ? levelset::SignMode::Closed : levelset::SignMode::Winding;
  if (in.text("nested") == "orientation") options.nesting = levelset::Nesting::Orientation;
  const bool isOfBand = in.operands[0].kind() == Kind::Band;
  levelset::TriMesh made;
  if (isOfBand) {  // a mesh of a level set is closed and does not intersect itself
    made = levelset::bandToMesh(in.band());
    options.sign = levelset::SignMode::Closed;
    options.searchSelfIntersections = false;
  }
  const levelset::MeshToAdaptiveResult result =
      levelset::meshToAdaptive(isOfBand ? made : in.mesh(), options);
  if (!isOfBand) in.notes.notes.push_back(describe(result.certificate));
  in.notes.notes.push_back(
      fmt::format("{} cells, {:.3g} MB; largest error at the tested points {:.3g} of the tolerance",
                  result.field.leafCount(), 1e-6 * static_cast<double>(result.field.memoryUse()),
                  (result.report.testedError + result.report.hangingError) / options.tolerance));
  in.notes.detailsJson = Json{{"cells", result.field.leafCount()},
                              {"bytes", result.field.memoryUse()},
                              {"tolerance", options.tolerance},
                              {"width", result.field.halfWidth()},
                              {"interpolation", in.text("interpolation")},
                              {"evaluations", result.report.evaluations},
                              {"tested_error", result.report.testedError},
                              {"hanging_error", result.report.hangingError}}
                             .dump();
  in.notes.errors.push_back({"largest error at the tested points",
                             result.report.testedError + result.report.hangingError,
                             "world units"});
  return Value(result.field);
}

Plan planAdaptive(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Adaptive;
  plan.voxelSize = 0;
  plan.halfWidth = 0;
  plan.fieldBytes = 0;  // unknown until the field is made
  plan.triangles = 0;
  (void)in.length("tolerance");
  if (in.given("width")) (void)in.length("width");
  return plan;
}

std::vector<AdaptiveField> adaptiveOperands(const Invocation& in) {
  std::vector<AdaptiveField> fields;
  for (const Value& value : in.operands) fields.push_back(value.adaptive());
  return fields;
}

template <class Op>
Operator setOperator(levelset::CsgOperation operation) {
  return alsoOfAdaptive(levelSetOperator<Op>(), {}, [operation](Invocation& in) {
    return Value(combineAdaptive(operation, adaptiveOperands(in),
                                 {.maxMemory = in.maxMemory, .progress = in.progress}));
  });
}

Value toBand(Invocation& in) {
  return Value(adaptiveToBand(
      in.operands[0].adaptive(), in.voxelSize(in.operands[0].plan().estimate().longestSide()),
      {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress}));
}

Plan planToBand(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Band;
  plan.fieldBytes = 0;
  plan.voxelSize = in.voxelSize(plan.estimate().longestSide());
  plan.halfWidth = in.number("half-width");
  if (!(plan.area > 0) && !plan.bounds.isEmpty()) {
    // As the surface of the bounding box.
    const Imath::V3d size = plan.bounds.size();
    plan.area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  }
  return plan;
}

}  // namespace

void requireOneKind(const Invocation& in) {
  for (std::size_t i = 1; i < in.operands.size(); ++i) {
    const bool isFirst = in.operands[0].kind() == Kind::Adaptive,
               isOther = in.operands[i].kind() == Kind::Adaptive;
    if (isFirst != isOther)
      throw UsageError(fmt::format(
          "{}: operand {} is an adaptive field, but operand {} is a {}; put 'to-band' after the "
          "adaptive field, or make both with 'level-set --adaptive'",
          in.op().name, isFirst ? 1 : i + 1, isFirst ? i + 1 : 1,
          kindName(in.operands[isFirst ? i : 0].kind())));
  }
}

Operator withAdaptiveResult(Operator levelSet) {
  Operator op = levelSet;
  op.operands[0].push_back(Kind::Band);
  op.details +=
      " --adaptive makes an adaptive field in place of a level set: distances on an octree, whose "
      "cells are small where the distance bends. It takes a mesh, or the mesh of a level set, as "
      "'mesh' makes it. It saves memory where detail is small beside the whole, and takes longer. "
      "'to-band' makes a level set of "
      "it.";
  op.params.push_back({.name = "adaptive",
                       .type = ParamType::Flag,
                       .doc = "make an adaptive field, which needs --tolerance and no voxel size"});
  op.params.push_back({.name = "tolerance",
                       .type = ParamType::Length,
                       .doc = "with --adaptive: largest error of the distances",
                       .range = Range::Positive,
                       .allowsVoxels = false});
  op.params.push_back({.name = "width",
                       .type = ParamType::Length,
                       .doc =
                           "with --adaptive: distance from the surface up to which the tolerance "
                           "holds; default: 2 % of the diagonal",
                       .range = Range::Positive,
                       .allowsVoxels = false});
  op.params.push_back({.name = "interpolation",
                       .type = ParamType::Choice,
                       .doc = "with --adaptive: interpolation in a cell; tricubic needs far fewer "
                              "cells where the surface is smooth",
                       .fallback = "trilinear",
                       .choices = {"trilinear", "tricubic"}});
  op.resultKind = [levelSet](const Invocation& in) {
    return in.flag("adaptive") ? Kind::Adaptive : levelSet.resultKind(in);
  };
  op.run = [levelSet](Invocation& in) {
    return in.flag("adaptive") ? makeAdaptive(in) : levelSet.run(in);
  };
  op.plan = [levelSet](Invocation& in) {
    return in.flag("adaptive") ? planAdaptive(in) : levelSet.plan(in);
  };
  op.cost = [levelSet](Invocation& in) {
    return in.flag("adaptive") ? std::optional<Cost>() : levelSet.cost(in);
  };
  op.takesVoxelSize = [](const Invocation& in) { return !in.flag("adaptive"); };
  op.validate = [levelSet](const Invocation& in) {
    if (in.flag("adaptive")) return checkAdaptiveOptions(in);
    if (!in.operands.empty() && in.operands[0].kind() == Kind::Band)
      throw UsageError(
          "level-set: the operand is a level set, but a mesh or a point cloud is needed; put "
          "'mesh' before it, or 'resample' for another voxel size, or give --adaptive");
    for (const char* name : {"tolerance", "width", "interpolation"})
      if (in.given(name))
        throw UsageError(
            fmt::format("level-set: --{} needs --adaptive; give it, or leave it out", name));
    levelSet.validate(in);
  };
  return op;
}

Operator alsoOfAdaptive(Operator op, std::vector<std::string> names,
                        std::function<Value(Invocation&)> run) {
  for (std::vector<Kind>& kinds : op.operands) kinds.push_back(Kind::Adaptive);
  const auto validate = [names = std::move(names)](const Invocation& in) {
    for (const Param& param : in.op().params)
      if (in.given(param.name) && std::find(names.begin(), names.end(), param.name) == names.end())
        throw UsageError(
            fmt::format("{}: --{} does not apply to an adaptive field; put 'to-band' before it, or "
                        "leave it out",
                        in.op().name, param.name));
    for (const std::string& name : names)
      if (!in.given(name))
        throw UsageError(fmt::format("{}: --{} is missing; give it", in.op().name, name));
  };
  return withVariant(std::move(op), {.kind = Kind::Adaptive,
                                     .run = std::move(run),
                                     .validate = validate,
                                     .validateAny = requireOneKind});
}

Operator unionOperator() {
  return setOperator<levelset::UnionOperator>(levelset::CsgOperation::Union);
}
Operator intersectionOperator() {
  return setOperator<levelset::IntersectionOperator>(levelset::CsgOperation::Intersection);
}
Operator differenceOperator() {
  return setOperator<levelset::DifferenceOperator>(levelset::CsgOperation::Difference);
}

Operator offsetOperator() {
  return alsoOfAdaptive(
      levelSetOperator<levelset::OffsetOperator>(), {"distance"}, [](Invocation& in) {
        return Value(offsetAdaptive(in.operands[0].adaptive(), in.length("distance"),
                                    {.maxMemory = in.maxMemory, .progress = in.progress}));
      });
}

Operator toBandOperator() {
  return {
      .name = "to-band",
      .group = "Conversion",
      .summary = "turn an adaptive field into a level set with exact distances to its surface",
      .details =
          "The surface is that of the adaptive field, so it is off by at most the tolerance of "
          "the field. The level set may be wider than the field.",
      .example =
          "levelsmith box --size 4,4,4 --voxel 0.2 ! mesh --sharp ! level-set --adaptive "
          "--tolerance "
          "0.01 ! to-band --voxel 0.1 ! write part.vdb",
      .params = {voxelParam(), resolutionParam(), halfWidthParam()},
      .operands = {{Kind::Adaptive}},
      .resultKind = [](const Invocation&) { return Kind::Band; },
      .run = toBand,
      .plan = planToBand,
      .slope = Slope::One,
      .validate = requireVoxelSize,
  };
}

}  // namespace pipeline
