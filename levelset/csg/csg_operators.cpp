#include <algorithm>
#include <cmath>

#include "levelset/csg/blend.h"
#include "levelset/csg/clip.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"

namespace levelset {
namespace {

constexpr const char* kCsgDetails =
    "Operands on different grids are resampled to the finest grid, and the report says so. Without "
    "named operands the action takes the two newest values of the stack, the older one first.";

NarrowBand bandAndNotes(CsgResult result, OperatorRun& run) {
  run.notes = std::move(result.notes);
  return std::move(result.band);
}

}  // namespace

template <CsgOperation operation>
NarrowBand CsgOperator<operation>::run(std::vector<NarrowBand> operands, const Options&,
                                       OperatorRun& run) {
  return bandAndNotes(combineMoved(operation, std::move(operands),
                                   {.maxMemory = run.maxMemory, .progress = run.progress}),
                      run);
}

template <CsgOperation operation>
ValuePlan CsgOperator<operation>::plan(const Options&, Plans operands, const OperatorRun&) {
  return planCombined(operation, operands);
}

template <CsgOperation operation>
RegionOfInterest CsgOperator<operation>::regionOfInterest(const Options&,
                                                          const OperatorPlans& plans, std::size_t,
                                                          const RegionOfInterest& ofResult) {
  const double voxel = plans.result.voxelSize;
  for (const ValuePlan& operand : plans.operands)
    if (std::abs(operand.voxelSize / voxel - 1) > 1e-9)
      return {};  // an operand is resampled, which needs the complete operand
  return {.region = grown(ofResult.region, seamReach(plans.result.halfWidth) * voxel)};
}

template <CsgOperation operation>
std::optional<Cost> CsgOperator<operation>::cost(const Options&, const OperatorPlans& plans) {
  return costPerVoxel(plans, 90, 8);
}

template struct CsgOperator<CsgOperation::Union>;
template struct CsgOperator<CsgOperation::Intersection>;
template struct CsgOperator<CsgOperation::Difference>;

const OperatorText UnionOperator::text{
    .name = "union",
    .group = "Solids",
    .summary = "join solids: the points inside any of them",
    .details = kCsgDetails,
    .example =
        "levelsmith sphere --radius 2 --voxel 0.1 ! box --size 3,3,3 --voxel 0.1 ! union ! "
        "measure"};

const OperatorText IntersectionOperator::text{
    .name = "intersection",
    .group = "Solids",
    .summary = "intersect solids: the points inside all of them",
    .details = kCsgDetails,
    .example =
        "levelsmith sphere --radius 2 --voxel 0.1 ! box --size 3,3,3 --voxel 0.1 ! "
        "intersection ! measure"};

const OperatorText DifferenceOperator::text{
    .name = "difference",
    .group = "Solids",
    .summary = "subtract solids from the first",
    .details = kCsgDetails,
    .example =
        "levelsmith box --size 3,3,3 --voxel 0.1 ! sphere --radius 1.8 --voxel 0.1 ! "
        "difference ! measure"};

const OperatorText BlendOperator::text{
    .name = "blend",
    .group = "Solids",
    .summary = "union, intersection or difference with a rounded seam",
    .details =
        "'curvature' smooths along the seam, the curve in which the two surfaces intersect; "
        "nothing changes further than the radius from the seam. 'fillet' is the surface of a ball "
        "of that radius that rolls along the seam: an arc of the radius, tangent to both surfaces. "
        "It changes nothing beyond radius / tan(angle / 2) from the seam, with the angle between "
        "the surfaces. Solids that are close but do not intersect stay apart.",
    .example =
        "levelsmith box --size 8,8,2 --voxel 0.1 ! cylinder --radius 1.5 --height 6 "
        "--voxel 0.1 ! blend --radius 0.8 ! measure"};

NarrowBand BlendOperator::run(std::vector<NarrowBand> operands, const Options& options,
                              OperatorRun& run) {
  return bandAndNotes(blend(options.operation, operands[0], operands[1], options.radius,
                            {.side = options.side,
                             .method = options.method,
                             .reach = options.reach,
                             .maxMemory = run.maxMemory,
                             .progress = run.progress}),
                      run);
}

ValuePlan BlendOperator::plan(const Options&, Plans operands, const OperatorRun&) {
  return planCombined(CsgOperation::Union, operands);
}

const OperatorText ClipOperator::text{
    .name = "clip",
    .group = "Placement",
    .summary = "cut a solid by a box or a plane, and close the cut",
    .example = "levelsmith sphere --radius 2 --voxel 0.1 ! clip --plane \"0,0,0 0,0,1\" ! measure"};

void ClipOperator::check(const Options& options, const GivenOptions& given) {
  if (given("box") == given("plane")) throw UsageError("give either --box or --plane");
  if (given("box")) return;
  if (options.plane.size() != 2 || !(options.plane[1].length() > 0)) {
    throw UsageError(
        "--plane needs a point and a normal other than zero, \"x,y,z x,y,z\"; the part behind the "
        "plane is kept");
  }
}

NarrowBand ClipOperator::run(std::vector<NarrowBand> operands, const Options& options,
                             OperatorRun& run) {
  if (options.box) return clip(operands[0], *options.box, run.progress);
  return clip(operands[0], Imath::Plane3d(options.plane[0], options.plane[1].normalized()),
              run.progress);
}

ValuePlan ClipOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (!options.box || plan.bounds.isEmpty()) return plan;
  Imath::Box3d left;
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    left.min[axis] = std::max(plan.bounds.min[axis], options.box->min[axis]);
    left.max[axis] = std::min(plan.bounds.max[axis], options.box->max[axis]);
    const double side = plan.bounds.max[axis] - plan.bounds.min[axis];
    if (side > 0) share *= std::clamp((left.max[axis] - left.min[axis]) / side, 0.0, 1.0);
  }
  if (left.isEmpty()) return plan;
  const Imath::V3d size = left.size();
  plan.bounds = left;
  // Area of the operand within the box, as if it were spread evenly over its bounds, plus the faces
  // that close the cut.
  plan.area = share * plan.area + 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  return plan;
}

/// Returns the region of the operand that determines the result in `ofResult`, as for an
/// intersection. The region ends at the half width plus two voxels outside the clip box.
RegionOfInterest ClipOperator::regionOfInterest(const Options& options, const OperatorPlans& plans,
                                                std::size_t, const RegionOfInterest& ofResult) {
  const double voxel = plans.result.voxelSize, width = plans.result.halfWidth;
  Imath::Box3d region = grown(ofResult.region, seamReach(width) * voxel);
  if (options.box) {
    const Imath::Box3d box = grown(*options.box, (width + 2) * voxel);
    for (int axis = 0; axis < 3; ++axis) {
      region.min[axis] = std::max(region.min[axis], box.min[axis]);
      region.max[axis] = std::min(region.max[axis], box.max[axis]);
    }
  }
  return {.region = region};
}

std::optional<Cost> ClipOperator::cost(const Options&, const OperatorPlans& plans) {
  return costPerVoxel(plans, 90, 15);
}

}  // namespace levelset
