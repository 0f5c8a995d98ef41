#include "levelset/csg/seam_operands.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "levelset/csg/csg_vdb.h"
#include "levelset/transform/resample.h"

namespace levelset::solids {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

// Margin that cutOut() adds around the part of the band that a blend changes, voxels. It contains
// the surface next to that part.
constexpr double kSurfaceMargin = 8;

/// Adds the block at `origin` with the signs of `source`, as ± background and without distances.
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

/// Copies the inside tiles, because the fillet reads the sign at any depth.
void copyInsideTiles(const FloatTree& source, FloatTree& target) {
  auto tile = source.cbeginValueOff();
  tile.setMaxDepth(FloatTree::ValueOffCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile)
    if (*tile < 0) target.addTile(tile.getLevel(), tile.getCoord(), -target.background(), false);
}

}  // namespace

SeamOperands onOneGrid(const NarrowBand& a, const NarrowBand& b, const SeamRequest& request) {
  if (shareTransform(vdb(a), vdb(b))) return {a, b, {}};
  const bool firstIsFiner = a.voxelSize() <= b.voxelSize();
  const NarrowBand& fine = firstIsFiner ? a : b;
  const NarrowBand& coarse = firstIsFiner ? b : a;
  ResampleOptions resampling;
  resampling.halfWidth = std::min(fine.halfWidth(), coarse.halfWidth());
  resampling.maxMemory = request.maxMemory;
  resampling.progress = request.progress;
  const NarrowBand moved = resampleTo(coarse, fine.indexToWorld(), resampling);
  std::string note = fmt::format(
      "the {} operand was resampled from voxels of {:.4g} to the grid of the other operand with "
      "voxels of {:.4g}",
      firstIsFiner ? "second" : "first", coarse.voxelSize(), fine.voxelSize());
  return {firstIsFiner ? fine : moved, firstIsFiner ? moved : fine, {std::move(note)}};
}

FloatGrid::Ptr cutOut(const FloatGrid& solid, const PointSearch& curve, double radius) {
  const auto scale = static_cast<float>(1 / solid.voxelSize()[0]);
  FloatGrid::Ptr part = FloatGrid::create(solid.background() * scale);
  FloatTree& tree = part->tree();
  copyInsideTiles(solid.tree(), tree);
  std::set<Coord> inner, rim;
  for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf) {
    const Vec3d centre = leaf->origin().asVec3d() + Vec3d(3.5);
    const double reach = radius + kSurfaceMargin + 6.1;  // 6.1: half the diagonal of a block
    if (!isNear(curve, toImath(centre), reach)) continue;
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

}  // namespace levelset::solids
