#include "levelset/distance/signs.h"

namespace levelset::eikonal {

using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

void copyTileSigns(const FloatTree& field, FloatTree& result) {
  const float background = result.background();
  for (auto it = field.cbeginValueAll(); it; ++it) {
    it.setMaxDepth(FloatTree::DEPTH - 2);
    if (it.getDepth() == FloatTree::DEPTH - 1) continue;
    if (*it < 0) result.addTile(it.getLevel(), it.getCoord(), -background, false);
  }
}

void copyLeafSigns(const LeafNode& leaf, FloatTree& result) {
  const float background = result.background();
  openvdb::Index inside = 0;
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) inside += leaf.getValue(n) < 0;
  if (inside == LeafNode::SIZE) {
    result.addTile(1, leaf.origin(), -background, false);
  } else if (inside > 0) {
    auto* signs = new LeafNode(leaf.origin(), background, false);
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n)
      if (leaf.getValue(n) < 0) signs->setValueOnly(n, -background);
    result.addLeaf(signs);
  }
}

void copySigns(const FloatTree& field, const std::function<bool(const openvdb::Coord&)>& holds,
               FloatTree& result) {
  copyTileSigns(field, result);
  for (auto leaf = field.cbeginLeaf(); leaf; ++leaf)
    if (!holds(leaf->origin())) copyLeafSigns(*leaf, result);
}

}  // namespace levelset::eikonal
