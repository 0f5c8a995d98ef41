#include "levelset/solids/blend.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "levelset/eikonal/distance_transform.h"
#include "levelset/error.h"
#include "levelset/solids/csg_vdb.h"
#include "levelset/solids/resample.h"
#include "levelset/solids/seam_curve.h"
#include "levelset/solids/seam_flow.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

constexpr double kHalfWidth = 4;      // voxels, of the band in which the flow runs
constexpr double kSurfaceMargin = 8;  // voxels around it that hold the surface it hangs on
constexpr double kStepLength = 0.4;   // voxels that the surface may move in a step …
constexpr double kDrift = 1;          // … and between two distance transforms
// The flow brings a right-angled crease to its radius within this time, voxels² per radius².
constexpr double kDuration = 1;
// It is at rest when it moves slower than this part of the curvature asked for.
constexpr double kRest = 0.03;
constexpr double kCoarsest = 1.5;  // voxels: the smallest radius that a grid can show

struct Operands {
  NarrowBand a, b;
  std::vector<std::string> notes;
};

/// Both on the grid points of the finer.
Operands onOneGrid(const NarrowBand& a, const NarrowBand& b, const BlendOptions& options) {
  if (shareTransform(vdb(a), vdb(b))) return {a, b, {}};
  const bool firstIsFiner = a.voxelSize() <= b.voxelSize();
  const NarrowBand& fine = firstIsFiner ? a : b;
  const NarrowBand& coarse = firstIsFiner ? b : a;
  ResampleOptions resampling;
  resampling.halfWidth = std::min(fine.halfWidth(), coarse.halfWidth());
  resampling.maxMemory = options.maxMemory;
  resampling.progress = subProgress(options.progress, 0, 0.2);
  const NarrowBand moved = resampleTo(coarse, fine.indexToWorld(), resampling);
  std::string note = fmt::format(
      "blend: the {} operand was resampled from voxels of {:.4g} to the other's grid of {:.4g}",
      firstIsFiner ? "second" : "first", coarse.voxelSize(), fine.voxelSize());
  return {firstIsFiner ? fine : moved, firstIsFiner ? moved : fine, {std::move(note)}};
}

/// A block that holds no distances, only signs.
void addSigns(const FloatTree& source, const Coord& origin, FloatTree& target) {
  const float background = target.background();
  const LeafNode* leaf = source.probeConstLeaf(origin);
  if (!leaf) {
    const float tile = source.getValue(origin) < 0 ? -background : background;
    target.addTile(1, origin, tile, false);
    return;
  }
  auto* signs = new LeafNode(origin, background, false);
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n)
    if (leaf->getValue(n) < 0) signs->setValueOnly(n, -background);
  target.addLeaf(signs);
}

/// The blocks of a solid around the curve, in voxels, and the signs of the blocks around those.
FloatGrid::Ptr cutOut(const FloatGrid& solid, const eikonal::PointTree& curve, double radius) {
  const auto scale = static_cast<float>(1 / solid.voxelSize()[0]);
  FloatGrid::Ptr part = FloatGrid::create(solid.background() * scale);
  FloatTree& tree = part->tree();
  std::set<Coord> inner, rim;
  for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf) {
    const Vec3d centre = leaf->origin().asVec3d() + Vec3d(3.5);
    const double reach = radius + kSurfaceMargin + 6.1;  // to the corners of the block
    if (curve.nearest(centre, reach) == eikonal::PointTree::kNone) continue;
    inner.insert(leaf->origin());
    auto copy = std::make_unique<LeafNode>(*leaf);
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n)
      copy->setValueOnly(n, leaf->getValue(n) * scale);
    tree.addLeaf(copy.release());
  }
  for (const Coord& origin : inner)
    for (int i = 0; i < 27; ++i)
      rim.insert(origin.offsetBy(8 * (i / 9 - 1), 8 * (i / 3 % 3 - 1), 8 * (i % 3 - 1)));
  for (const Coord& origin : rim)
    if (!inner.count(origin)) addSigns(solid.tree(), origin, tree);
  return part;
}

/// Lets the flow run until nothing is bent more sharply than the radius.
FloatGrid::Ptr runFlow(FloatGrid::Ptr field, solids::SeamWeights& weights,
                       const solids::SeamFlow& flow, double halfWidth,
                       const BlendOptions& options) {
  eikonal::DistanceRequest request;
  request.action = "blend";
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
    report(options.progress, 0.4 + 0.5 * std::min(1.0, time / duration), "blend");
  }
  request.halfWidth = halfWidth;
  return eikonal::distanceTransform(*field, request);
}

/// Puts the flowed field into the solid where it has a weight, and nowhere else.
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

void checkRadius(double radius) {
  if (!std::isfinite(radius) || radius < 0)
    throw UsageError(fmt::format("blend: the radius is {}; give a length of zero or more", radius));
}

/// A radius beyond the solids themselves would flow them away.
void checkAgainstSize(double radius, const NarrowBand& solid) {
  const Imath::Box3d box = solid.zeroSetBounds();
  if (!box.isEmpty() && radius > box.size().length())
    throw InvalidInput(
        fmt::format("blend: the radius {:.4g} is larger than the solids, whose "
                    "diagonal is {:.4g}; use a smaller one",
                    radius, box.size().length()));
}

}  // namespace

CsgResult blend(CsgOperation operation, const NarrowBand& a, const NarrowBand& b, double radius,
                const BlendOptions& options) {
  checkRadius(radius);
  if (a.isEmpty() || b.isEmpty())
    throw InvalidInput("blend: a solid is empty, so there is nothing to blend; give two solids");

  // === The hard edges first
  const Operands operands = onOneGrid(a, b, options);
  CsgOptions csg;
  csg.maxMemory = options.maxMemory;
  csg.progress = subProgress(options.progress, 0.2, 0.4);
  const std::array<NarrowBand, 2> solids = {operands.a, operands.b};
  CsgResult result = combine(operation, solids, csg);
  result.notes.insert(result.notes.begin(), operands.notes.begin(), operands.notes.end());
  if (radius == 0) return result;

  const double radiusVoxels = radius / result.band.voxelSize();
  checkAgainstSize(radius, result.band);
  if (radiusVoxels < kCoarsest)
    result.notes.push_back(fmt::format(
        "blend: a radius of {:.3g} voxels is below what the grid can show; use smaller voxels",
        radiusVoxels));
  const std::vector<Vec3d> curve =
      solids::seamCurve(vdb(operands.a).tree(), vdb(operands.b).tree());
  if (curve.empty()) {
    result.notes.emplace_back("blend: the surfaces do not meet, so there is no crease to round");
    return result;
  }

  // === Flow beside the curve, on a copy of what lies there
  FloatGrid& solid = editVdb(result.band);
  solids::SeamWeights weights(curve, radiusVoxels);
  FloatGrid::Ptr part = cutOut(solid, eikonal::PointTree(curve), radiusVoxels);
  part = runFlow(std::move(part), weights, {radiusVoxels, options.side}, result.band.halfWidth(),
                 options);
  putBack(*part, weights, solid);
  report(options.progress, 1, "blend");
  return result;
}

}  // namespace levelset
