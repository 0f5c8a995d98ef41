#include <algorithm>
#include <cmath>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"

namespace levelset {
namespace {

using Imath::M44d;
using Imath::V3d;

M44d rotationOf(const TransformOperator::Options& options) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  M44d matrix;
  if (options.rotate.size() == 1) {
    if (!(options.axis.length() > 0))
      throw UsageError("--axis has no direction; give for example 0,0,1");
    matrix.setAxisAngle(options.axis.normalized(), options.rotate[0] * kDegree);
    return matrix;
  }
  for (int i = 0; i < 3; ++i) {
    V3d axis(0);
    axis[i] = 1;
    M44d turn;
    turn.setAxisAngle(axis, options.rotate[static_cast<std::size_t>(i)] * kDegree);
    matrix = matrix * turn;
  }
  return matrix;
}

bool isSimilarityMatrix(const M44d& m) {
  const V3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]),
      z(m[2][0], m[2][1], m[2][2]);
  const double s = x.length2(), tolerance = 1e-9 * s;
  return std::abs(y.length2() - s) < tolerance && std::abs(z.length2() - s) < tolerance &&
         std::abs(x.dot(y)) < tolerance && std::abs(y.dot(z)) < tolerance &&
         std::abs(z.dot(x)) < tolerance && x.cross(y).dot(z) > 0;
}

Imath::Box3d movedBox(const Imath::Box3d& box, const M44d& matrix) {
  Imath::Box3d moved;
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
    moved.extendBy(V3d((corner & 1) ? box.max.x : box.min.x, (corner & 2) ? box.max.y : box.min.y,
                       (corner & 4) ? box.max.z : box.min.z) *
                   matrix);
  return moved;
}

}  // namespace

Cost costOfSamples(const ValuePlan& source, const ValuePlan& target) {
  const double from = source.layer(), to = target.layer(),
               sampled = sampledWidth(target.voxelSize / source.voxelSize);
  Cost cost{1e-9 * (7600 * from + 8400 * to), 50 * from + 1030 * to};
  if (sampled > source.halfWidth + 4) cost += costOfDistances(from, sampled);
  return cost += costOfDistances(to, target.halfWidth);
}

RegionOfInterest sampledRegion(const OperatorPlans& plans, const RegionOfInterest& ofResult,
                               const M44d& toSource) {
  const ValuePlan &source = plans.operands[0], &target = plans.result;
  // Sum of the squared factors by which `toSource` stretches the three axes. Its root bounds the
  // stretch in any direction.
  double squares = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) squares += toSource[i][k] * toSource[i][k];
  const double sampled = sampledWidth(std::sqrt(squares) * target.voxelSize / source.voxelSize);
  const Imath::Box3d about =
      grown(ofResult.region, distanceReach(target.halfWidth) * target.voxelSize);
  if (isEverywhere(about)) return {};
  return {.region = grown(movedBox(about, toSource),
                          distanceReach(std::max(source.halfWidth, sampled)) * source.voxelSize)};
}

const OperatorText ResampleOperator::text{
    .name = "resample",
    .group = "Placement",
    .summary = "resample a solid on an axis-aligned grid of another voxel size",
    .example =
        "levelsmith torus --radius 2 --tube 0.7 --voxel 0.1 ! resample --voxel 0.05 ! measure"};

double ResampleOperator::longestSide(const Options&, Plans operands) {
  return operands[0].longestSide();
}

NarrowBand ResampleOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                 OperatorRun& run) {
  return resample(
      operands[0], options.voxel.edge,
      {.halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress});
}

ValuePlan ResampleOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  plan.voxelSize = options.voxel.edge;
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  return plan;
}

RegionOfInterest ResampleOperator::regionOfInterest(const Options&, const OperatorPlans& plans,
                                                    std::size_t, const RegionOfInterest& ofResult) {
  return sampledRegion(plans, ofResult, M44d());
}

std::optional<Cost> ResampleOperator::cost(const Options&, const OperatorPlans& plans) {
  return costOfSamples(plans.operands[0], plans.result);
}

const OperatorText TransformOperator::text{
    .name = "transform",
    .group = "Placement",
    .summary = "move, turn, scale or mirror a solid or a mesh",
    .details =
        "The order is matrix, mirror, scale, rotate, translate. A level set moves exactly, by its "
        "grid's transform. A matrix that mirrors, shears or scales unevenly needs --bake, which "
        "resamples on an axis-aligned grid.",
    .example =
        "levelsmith box --size 2,1,1 --voxel 0.05 ! transform --rotate 30 --translate "
        "1,0,0 ! measure"};

M44d TransformOperator::matrixOf(const Options& options) {
  M44d matrix = options.matrix.value_or(M44d());
  M44d there, back;
  there.setTranslation(-options.about);
  back.setTranslation(options.about);
  matrix = matrix * there;
  if (options.mirror) {
    M44d mirror;
    mirror[*options.mirror][*options.mirror] = -1;
    matrix = matrix * mirror;
  }
  if (!options.scale.empty()) {
    const std::vector<double>& factors = options.scale;
    M44d scale;
    scale.setScale(factors.size() == 1 ? V3d(factors[0]) : V3d(factors[0], factors[1], factors[2]));
    matrix = matrix * scale;
  }
  if (!options.rotate.empty()) matrix = matrix * rotationOf(options);
  matrix = matrix * back;
  if (options.translate) {
    M44d move;
    move.setTranslation(*options.translate);
    matrix = matrix * move;
  }
  if (!(std::abs(matrix.determinant()) > 0))
    throw UsageError("the matrix is singular; give an invertible matrix");
  return matrix;
}

void TransformOperator::check(const Options& options, const GivenOptions& given) {
  if (options.rotate.size() > 1 && given("axis"))
    throw UsageError("--axis needs a single angle, but --rotate has three; leave out --axis");
  const M44d matrix = matrixOf(options);
  if (given.isMesh) {
    if (options.bake || options.voxel)
      throw UsageError(
          "--bake and --voxel are for level sets, but the operand is a mesh; leave them out");
    return;
  }
  if (options.bake) return;
  if (options.voxel) throw UsageError("--voxel needs --bake; add --bake, or leave out --voxel");
  if (!isSimilarityMatrix(matrix)) {
    throw UsageError(
        "the matrix mirrors, shears or scales unevenly, so the level set must be resampled; "
        "add --bake");
  }
}

NarrowBand TransformOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                  OperatorRun& run) {
  const M44d matrix = matrixOf(options);
  NarrowBand band = std::move(operands[0]);
  operands.clear();
  if (!options.bake) return transform(std::move(band), matrix);
  return bake(band, matrix, options.voxel.value_or(band.voxelSize()),
              {.maxMemory = run.maxMemory, .progress = run.progress});
}

TriMesh TransformOperator::run(const TriMesh& mesh, const Options& options, OperatorRun&) {
  return transform(mesh, matrixOf(options));
}

ValuePlan TransformOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  const M44d matrix = matrixOf(options);
  ValuePlan plan = operands[0];
  plan.bounds = movedBox(plan.bounds, matrix);
  const double scale = std::cbrt(std::abs(matrix.determinant()));
  plan.area *= scale * scale;
  if (!options.bake)
    plan.voxelSize *= scale;
  else if (options.voxel)
    plan.voxelSize = *options.voxel;
  return plan;
}

RegionOfInterest TransformOperator::regionOfInterest(const Options& options,
                                                     const OperatorPlans& plans, std::size_t,
                                                     const RegionOfInterest& ofResult) {
  const M44d toSource = matrixOf(options).inverse();
  if (options.bake) return sampledRegion(plans, ofResult, toSource);
  RegionOfInterest read = ofResult;
  read.halfWidth *= 1 + 1e-6;  // margin: the background value is rounded before it is scaled
  if (!isEverywhere(ofResult.region))
    read.region = grown(movedBox(ofResult.region, toSource), plans.operands[0].voxelSize);
  return read;
}

std::optional<Cost> TransformOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan& plan = plans.operands[0];
  if (!plan.isBand()) return Cost{25e-9 * plan.triangles};
  if (options.bake) return costOfSamples(plan, plans.result);
  return Cost{25e-9 * plan.activeVoxels()};
}

}  // namespace levelset
