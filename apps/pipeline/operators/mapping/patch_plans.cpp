#include "apps/pipeline/operators/mapping/patch_plans.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "apps/pipeline/operators/mapping/patch_options.h"

namespace pipeline {
namespace {

using Imath::V3d;

/// Returns `plan` for a patch whose particles on the surface lie in `box`: the box is extended on
/// all sides by the height, with --height auto by half the diagonal of the box.
Plan raisedPlan(Invocation& in, Plan plan, Imath::Box3d box) {
  const bool isAuto = in.text("height") == "auto";
  const double height = isAuto ? box.size().length() / 2 : in.length("height");
  if (!isAuto) plan.patchSize.z = height;
  box.min -= V3d(height);
  box.max += V3d(height);
  plan.bounds = box;
  plan.area = 0;
  return plan;
}

}  // namespace

Plan planPatch(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Patch;
  Imath::Box3d box;
  if (in.given("corners")) {
    const std::vector<V3d> p = in.points("corners");
    for (const V3d& corner : p) box.extendBy(corner);
    plan.patchSize = {std::min((p[1] - p[0]).length(), (p[2] - p[3]).length()),
                      std::min((p[3] - p[0]).length(), (p[2] - p[1]).length()), 0};
  } else {
    const std::vector<double> size = in.lengths("size");
    plan.patchSize = {size[0], size[1], 0};
    const double reach = std::hypot(size[0], size[1]) / 2;
    box = {in.point("at") - V3d(reach), in.point("at") + V3d(reach)};
  }
  return raisedPlan(in, plan, box);
}

Plan planDecal(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Patch;
  const double radius = in.length("radius"), reach = radius * std::sqrt(2.0);
  plan.patchSize = {2 * radius, 2 * radius, 0};
  return raisedPlan(in, plan, {in.point("at") - V3d(reach), in.point("at") + V3d(reach)});
}

Plan planGrid(Invocation& in) {
  if (!in.given("around")) {
    Plan plan = planPatch(in);
    const auto [columns, rows] = countOf(in);
    plan.patchSize.x /= static_cast<double>(columns);
    plan.patchSize.y /= static_cast<double>(rows);
    return plan;
  }
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Patch;
  plan.patchSize =
      V3d(0);  // unknown: the lengths of the sides depend on the surface between the corners
  return raisedPlan(in, plan, plan.bounds);
}

}  // namespace pipeline
