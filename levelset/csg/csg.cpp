#include "levelset/csg/csg.h"

#include <fmt/core.h>
#include <openvdb/tools/Merge.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "levelset/csg/csg_vdb.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;

/// Replaces negative zeros by zeros, so that equal results have equal bits.
void clearSignOfZeros(FloatTree& tree) {
  openvdb::tree::LeafManager<FloatTree> leaves(tree);
  leaves.foreach ([](FloatTree::LeafNodeType& leaf, std::size_t) {
    float* values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < FloatTree::LeafNodeType::SIZE; ++i) values[i] += 0.0f;
  });
}

/// Combines `b` into `a` by OpenVDB's CSG node operations, without pruning.
/// @param tag  openvdb::Steal to move the nodes of `b`, openvdb::DeepCopy to copy them
template <typename Tree, typename Tag>
void mergeInto(CsgOperation operation, FloatGrid& a, Tree& b, const Tag& tag) {
  {
    openvdb::tree::DynamicNodeManager<FloatTree> nodes(a.tree());
    if (operation == CsgOperation::Union)
      nodes.foreachTopDown(openvdb::tools::CsgUnionOp<FloatTree>(b, tag));
    else if (operation == CsgOperation::Intersection)
      nodes.foreachTopDown(openvdb::tools::CsgIntersectionOp<FloatTree>(b, tag));
    else
      nodes.foreachTopDown(openvdb::tools::CsgDifferenceOp<FloatTree>(b, tag));
  }
  if (operation == CsgOperation::Difference) clearSignOfZeros(a.tree());
}

void requireSolids(std::span<const NarrowBand> solids, const CsgOptions& options) {
  if (solids.size() < 2) {
    throw UsageError(
        fmt::format("the operation needs at least two solids, but there {}; name more operands",
                    solids.empty() ? "are none" : "is one"));
  }
  double bytes = 0;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    requireSolid(solids[i]);
    if (solids[i].isEmpty()) {
      throw InvalidInput(fmt::format("operand {} has no surface; leave it out", i + 1));
    }
    bytes += static_cast<double>(solids[i].memoryUse());
  }
  requireMemory(2 * bytes, options.maxMemory);
}

using Leaf = FloatTree::LeafNodeType;

/// Restores the old values of a redistanced leaf where old and new value differ by at most 0.05
/// voxels. Also deactivates voxels that have become active within 0.05 voxels of the half width:
/// where faces lie on grid points, rounding decides if voxels at exactly the half width are active.
/// @param old  leaf before redistancing; null: there was none
void keepGoodValues(Leaf& leaf, const Leaf* old, float background, double voxelSize) {
  constexpr double kSame = 0.05;  // voxels: error of redistancing along ridges of the distance
  const auto same = static_cast<float>(kSame * voxelSize);
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
    if (!leaf.isValueOn(n)) continue;
    const float value = leaf.getValue(n);
    if (old && old->isValueOn(n)) {
      if (std::abs(value - old->getValue(n)) <= same) leaf.setValueOnly(n, old->getValue(n));
    } else if (std::abs(value) > background - same) {
      leaf.setValueOff(n, std::copysign(background, value));
    }
  }
}

/// Dilates a set of blocks, given by their origins, by `reach` blocks along each axis.
std::set<openvdb::Coord> blocksAbout(const std::vector<openvdb::Coord>& blocks, int reach) {
  std::set<openvdb::Coord> all(blocks.begin(), blocks.end());
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<openvdb::Coord> before(all.begin(), all.end());
    for (openvdb::Coord c : before) {
      c[axis] -= reach * static_cast<int>(Leaf::DIM);
      for (int i = 0; i <= 2 * reach; ++i, c[axis] += static_cast<int>(Leaf::DIM)) all.insert(c);
    }
  }
  return all;
}

/// Redistances the field within the half width of coincident faces: faces of both operands that lie
/// on each other and bound no solid in the result. Works only near these faces, so the cost and the
/// result do not depend on the rest of the solid.
/// @param faces  origins of the blocks that contain such faces
void redistanceAbout(const std::vector<openvdb::Coord>& faces, FloatGrid& grid) {
  const double voxelSize = grid.voxelSize()[0];
  const float background = grid.background();
  eikonal::DistanceRequest request;
  request.halfWidth = static_cast<double>(background) / voxelSize;
  const int reach = static_cast<int>(std::ceil((request.halfWidth + 1) / Leaf::DIM));
  const std::set<openvdb::Coord> blocks = blocksAbout(faces, reach);
  openvdb::CoordBBox region;
  for (const openvdb::Coord& block : blocks)
    region.expand(openvdb::CoordBBox::createCube(block, Leaf::DIM));
  request.region = region;
  const FloatGrid::Ptr made = eikonal::distanceTransform(grid, request);
  for (const openvdb::Coord& block : blocks) {
    if (const Leaf* leaf = made->tree().probeConstLeaf(block)) {
      auto mended = std::make_unique<Leaf>(*leaf);
      keepGoodValues(*mended, grid.tree().probeConstLeaf(block), background, voxelSize);
      grid.tree().addLeaf(mended.release());
    } else {
      grid.tree().addTile(1, block, std::copysign(background, made->tree().getValue(block)), false);
    }
  }
  pruneOneSided(grid.tree());
}

/// Returns the fraction of the volume of `box` that also lies in `other`; 1 if `box` has no volume.
double shareWithin(const Imath::Box3d& box, const Imath::Box3d& other) {
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = box.max[axis] - box.min[axis];
    if (!(side > 0)) return 1;
    const double common =
        std::min(box.max[axis], other.max[axis]) - std::max(box.min[axis], other.min[axis]);
    share *= std::clamp(common / side, 0.0, 1.0);
  }
  return share;
}

}  // namespace

void bringToOneGrid(std::vector<NarrowBand>& solids, std::size_t maxMemory,
                    std::vector<std::string>& notes) {
  const auto finest = std::min_element(
      solids.begin(), solids.end(),
      [](const auto& a, const auto& b) { return a.voxelSize() < b.voxelSize() * (1 - 1e-9); });
  double halfWidth = finest->halfWidth();
  for (const NarrowBand& solid : solids) halfWidth = std::min(halfWidth, solid.halfWidth());
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (shareTransform(vdb(*finest), vdb(solids[i]))) {
      // Half widths that differ only by rounding need no note.
      if (halfWidth < solids[i].halfWidth() * (1 - 1e-5))
        notes.push_back(fmt::format("operand {} was narrowed to a half width of {:.6g} voxels",
                                    i + 1, halfWidth));
      solids[i] = narrowed(std::move(solids[i]), halfWidth);
      continue;
    }
    notes.push_back(fmt::format(
        "operand {} was resampled from voxels of {} to the grid of operand {} "
        "with voxels of {}",
        i + 1, solids[i].voxelSize(), finest - solids.begin() + 1, finest->voxelSize()));
    solids[i] = resampleTo(solids[i], finest->indexToWorld(),
                           {.halfWidth = halfWidth, .maxMemory = maxMemory});
  }
  // Voxel sizes may differ in the last bits. Equal half widths then give different backgrounds, so
  // all bands are shortened to the smallest background.
  float background = vdb(solids.front()).background();
  for (const NarrowBand& solid : solids) background = std::min(background, vdb(solid).background());
  for (NarrowBand& solid : solids)
    if (vdb(solid).background() != background) endBandAt(editVdb(solid), background);
}

CsgSigns csgSigns(CsgOperation operation) {
  switch (operation) {
    case CsgOperation::Union:
      return {1, 1, 1};
    case CsgOperation::Intersection:
      return {-1, -1, -1};
    case CsgOperation::Difference:
      return {-1, 1, -1};
  }
  return {1, 1, 1};
}

FloatGrid::Ptr mergePlain(CsgOperation operation, const FloatGrid& a, const FloatGrid& b) {
  const FloatGrid::Ptr result = a.deepCopy();
  mergeInto(operation, *result, b.tree(), openvdb::DeepCopy());
  pruneOneSided(result->tree());
  return result;
}

NarrowBand mergePair(CsgOperation operation, NarrowBand a, NarrowBand b) {
  const CsgSigns signs = csgSigns(operation);

  // === Measure, while both operands are unchanged
  std::vector<SharedLeaf> shared = sharedLeaves(vdb(a), vdb(b));
  const Coincidence coincidence = coincidenceOf(vdb(a), vdb(b), signs, shared);
  if (!coincidence.contacts.empty()) {
    closeContacts(editVdb(a), coincidence.contacts, signs.first);
    closeContacts(editVdb(b), coincidence.contacts, signs.second);
    shared = sharedLeaves(vdb(a), vdb(b));
  }
  const std::vector<SeamDistances> distances = seamDistances(vdb(a), vdb(b), signs, shared);

  // === Combine
  FloatGrid& result = editVdb(a);
  if (b.shared().use_count() == 1)
    mergeInto(operation, result, editVdb(b).tree(), openvdb::Steal());
  else
    mergeInto(operation, result, vdb(b).tree(), openvdb::DeepCopy());
  correctSeam(result, distances);
  pruneOneSided(result.tree());
  // Faces of the operands that lie on each other and bound no solid may end at an edge of the
  // result. There correctSeam(), which fits planes to the surfaces, is wrong, so the band is
  // redistanced.
  if (!coincidence.faces.empty() && eikonal::hasZeroCrossing(result.tree()))
    redistanceAbout(coincidence.faces, result);
  return a;
}

namespace {

/// Unites the solids in pairs, then the results in pairs, and so on. Adding many small solids one
/// by one would copy the large intermediate band for each of them.
NarrowBand uniteAll(std::vector<NarrowBand> solids, const CsgOptions& options) {
  const auto pairs = static_cast<double>(solids.size() - 1);
  double done = 0;
  while (solids.size() > 1) {
    const std::size_t half = (solids.size() + 1) / 2;
    for (std::size_t i = 0; i < half; ++i) {
      const bool isPair = 2 * i + 1 < solids.size();
      if (isPair) report(options.progress, done++ / pairs);
      NarrowBand first = std::move(solids[2 * i]);
      solids[i] =
          isPair ? mergePair(CsgOperation::Union, std::move(first), std::move(solids[2 * i + 1]))
                 : std::move(first);
    }
    solids.resize(half);
  }
  return std::move(solids.front());
}

}  // namespace

CsgResult combineMoved(CsgOperation operation, std::vector<NarrowBand> operands,
                       const CsgOptions& options) {
  requireSolids(operands, options);
  CsgResult result;
  bringToOneGrid(operands, options.maxMemory, result.notes);
  if (operation == CsgOperation::Union) {
    result.band = uniteAll(std::move(operands), options);
    report(options.progress, 1);
    return result;
  }
  result.band = std::move(operands.front());
  for (std::size_t i = 1; i < operands.size(); ++i) {
    report(options.progress, static_cast<double>(i - 1) / static_cast<double>(operands.size() - 1));
    result.band = mergePair(operation, std::move(result.band), std::move(operands[i]));
    if (!hasInside(vdb(result.band))) {
      throw InvalidInput(operation == CsgOperation::Intersection
                             ? fmt::format("the result is empty, because operand {} does not "
                                           "overlap the intersection of the "
                                           "operands before it; check their positions",
                                           i + 1)
                             : fmt::format("the result is empty after operand {} is "
                                           "subtracted; check the order of the "
                                           "operands",
                                           i + 1));
    }
  }
  report(options.progress, 1);
  return result;
}

CsgResult combine(CsgOperation operation, std::span<const NarrowBand> solids,
                  const CsgOptions& options) {
  return combineMoved(operation, std::vector<NarrowBand>(solids.begin(), solids.end()), options);
}

namespace {
NarrowBand combinePair(CsgOperation operation, const NarrowBand& a, const NarrowBand& b) {
  const std::array<NarrowBand, 2> solids = {a, b};
  return combine(operation, solids).band;
}
}  // namespace

NarrowBand unite(const NarrowBand& a, const NarrowBand& b) {
  return combinePair(CsgOperation::Union, a, b);
}
NarrowBand intersect(const NarrowBand& a, const NarrowBand& b) {
  return combinePair(CsgOperation::Intersection, a, b);
}
NarrowBand subtract(const NarrowBand& a, const NarrowBand& b) {
  return combinePair(CsgOperation::Difference, a, b);
}

ValuePlan planCombined(CsgOperation operation, Plans operands) {
  ValuePlan plan = operands[0];
  for (const ValuePlan& other : operands.subspan(1)) {
    plan.voxelSize = std::min(plan.voxelSize, other.voxelSize);
    plan.halfWidth = std::min(plan.halfWidth, other.halfWidth);
    if (operation == CsgOperation::Union) {
      plan.area += other.area;
      plan.bounds.extendBy(other.bounds);
      continue;
    }
    const double within = other.area * shareWithin(other.bounds, plan.bounds);
    if (operation == CsgOperation::Difference) {
      plan.area += within;
      continue;
    }
    plan.area = plan.area * shareWithin(plan.bounds, other.bounds) + within;
    // Both boxes are estimates, so their intersection may be too small.
    plan.bounds.extendBy(other.bounds);
  }
  return plan;
}

}  // namespace levelset
