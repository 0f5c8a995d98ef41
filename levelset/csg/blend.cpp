#include "levelset/csg/blend.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "levelset/csg/fillet.h"
#include "levelset/csg/seam_curve.h"
#include "levelset/csg/seam_flow.h"
#include "levelset/csg/seam_operands.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/error.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

constexpr double kHalfWidth = 4;     // voxels, half width of the band for the flow
constexpr double kStepLength = 0.4;  // voxels: largest motion of the surface in one step
constexpr double kDrift = 1;         // voxels: motion after which the band is redistanced
// Time in which the flow rounds a right-angled crease to an arc of the radius, divided by radius².
constexpr double kDuration = 1;
// The flow has converged when its speed is below this fraction of 1 / radius.
constexpr double kRest = 0.03;
constexpr double kCoarsest = 1.5;  // voxels: smallest radius that a grid can represent

/// Runs the flow near the seam until its speed falls below kRest / radius, but at most for the time
/// kDuration × radius².
/// @param halfWidth  half width of the result, voxels
FloatGrid::Ptr runFlow(FloatGrid::Ptr field, solids::SeamWeights& weights,
                       const solids::SeamFlow& flow, double halfWidth,
                       const BlendOptions& options) {
  eikonal::DistanceRequest request;
  request.halfWidth = kHalfWidth;
  request.maxMemory = options.maxMemory;
  field = eikonal::distanceTransform(*field, request);
  const double duration = kDuration * flow.radius * flow.radius;
  double time = 0, moved = 0;
  while (time < duration) {
    const double speed = solids::seamSpeed(field->tree(), weights, flow);
    if (speed < kRest / flow.radius) break;
    const double dt = std::min(kStepLength / speed, duration - time);
    moved += solids::seamStep(field->tree(), weights, flow, dt);
    time += dt;
    if (moved > kDrift) {
      field = eikonal::distanceTransform(*field, request);
      moved = 0;
    }
    report(options.progress, 0.4 + 0.5 * std::min(1.0, time / duration));
  }
  request.halfWidth = halfWidth;
  return eikonal::distanceTransform(*field, request);
}

/// Copies the distances of `part`, the result of the flow, into the solid where the weight of the
/// flow is not zero, which means near the seam.
/// @param part  distances in voxels
void putBack(const FloatGrid& part, solids::SeamWeights& weights, FloatGrid& solid) {
  FloatTree& tree = solid.tree();
  const float background = solid.background();
  const auto scale = static_cast<float>(solid.voxelSize()[0]);
  std::set<Coord> origins;
  for (auto leaf = part.tree().cbeginLeaf(); leaf; ++leaf) origins.insert(leaf->origin());
  for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf) origins.insert(leaf->origin());
  weights.prepare({origins.begin(), origins.end()});
  for (const Coord& origin : origins) {
    const solids::SeamWeights::Block* block = weights.at(origin);
    if (!block) continue;
    LeafNode* target = tree.touchLeaf(origin);
    const LeafNode* source = part.tree().probeConstLeaf(origin);
    const float tile = source ? 0 : part.tree().getValue(origin);
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
      if ((*block)[n] == 0) continue;
      const float value = source ? source->getValue(n) : tile;
      const float scaled = value * scale;
      if (source && source->isValueOn(n) && std::abs(scaled) < background)
        target->setValueOn(n, scaled);
      else
        target->setValueOff(n, value < 0 ? -background : background);
    }
  }
  openvdb::tools::pruneLevelSet(tree);
}

void checkRadius(double radius, const BlendOptions& options) {
  if (!std::isfinite(radius) || radius < 0)
    throw UsageError(fmt::format("the radius is {}; give a length of zero or more", radius));
  if (!options.reach) return;
  if (!std::isfinite(*options.reach) || *options.reach <= 0)
    throw UsageError(fmt::format("the reach is {}; give a length above zero", *options.reach));
  if (options.method != BlendMethod::Fillet)
    throw UsageError("--reach applies only to --method fillet; leave it out");
}

/// Checks the radius against the size of the solid. A flow with a larger radius would remove the
/// solid.
void checkAgainstSize(double radius, const NarrowBand& solid) {
  const Imath::Box3d box = solid.zeroSetBounds();
  if (!box.isEmpty() && radius > box.size().length())
    throw InvalidInput(
        fmt::format("the radius {:.4g} is larger than the solids, whose "
                    "diagonal is {:.4g}; use a smaller radius",
                    radius, box.size().length()));
}

}  // namespace

CsgResult blend(CsgOperation operation, const NarrowBand& a, const NarrowBand& b, double radius,
                const BlendOptions& options) {
  checkRadius(radius, options);
  requireSolid(a);
  requireSolid(b);
  if (a.isEmpty() || b.isEmpty())
    throw InvalidInput(
        "one of the solids is empty, so there is nothing to blend; give two solids with a surface");

  // === Plain CSG
  const solids::SeamOperands operands =
      solids::onOneGrid(a, b, {options.maxMemory, subProgress(options.progress, 0, 0.2)});
  CsgOptions csg;
  csg.maxMemory = options.maxMemory;
  csg.progress = subProgress(options.progress, 0.2, 0.4);
  const std::array<NarrowBand, 2> pair = {operands.a, operands.b};
  CsgResult result = combine(operation, pair, csg);
  result.notes.insert(result.notes.begin(), operands.notes.begin(), operands.notes.end());
  if (radius == 0) return result;
  if (options.method == BlendMethod::Fillet) {
    checkAgainstSize(radius, result.band);
    solids::addFillet(operation, operands, radius, options, result);
    return result;
  }

  const double radiusVoxels = radius / result.band.voxelSize();
  checkAgainstSize(radius, result.band);
  if (radiusVoxels < kCoarsest)
    result.notes.push_back(fmt::format(
        "the grid cannot represent a radius of {:.3g} voxels; use smaller voxels", radiusVoxels));
  const std::vector<Vec3d> curve =
      solids::seamCurve(vdb(operands.a).tree(), vdb(operands.b).tree());
  if (curve.empty()) {
    result.notes.emplace_back("the surfaces do not intersect, so there is no crease to round");
    return result;
  }

  // === Flow near the curve, on a copy of the blocks near it
  FloatGrid& solid = editVdb(result.band);
  solids::SeamWeights weights(curve, radiusVoxels);
  FloatGrid::Ptr part = solids::cutOut(solid, makePointSearch(curve), radiusVoxels);
  part = runFlow(std::move(part), weights, {radiusVoxels, options.side}, result.band.halfWidth(),
                 options);
  putBack(*part, weights, solid);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
