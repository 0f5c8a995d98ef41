#include "levelset/distance/moved/leaf_distances.h"

#include <cmath>

#include "levelset/distance/nearest/point_distance.h"
#include "levelset/grids/box_mask_vdb.h"

namespace levelset::eikonal {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::MaskTree;
using LeafNode = openvdb::FloatTree::LeafNodeType;

std::vector<const MaskTree::LeafNodeType*> leavesOf(const MaskTree& tree) {
  std::vector<const MaskTree::LeafNodeType*> leaves;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  return leaves;
}

MaskTree boxesAround(const MaskTree& points, double reach) {
  MaskTree around;
  for (auto leaf = points.cbeginLeaf(); leaf; ++leaf)
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      CoordBBox box(it.getCoord(), it.getCoord());
      box.expand(static_cast<int>(std::ceil(reach)));
      addBox(around, box);
    }
  return around;
}

void setAll(FloatGrid& field, const Coord& origin, const LeafDistances& values, double halfWidth) {
  if (values.empty()) return;
  LeafNode* leaf = field.tree().touchLeaf(origin);
  for (const auto& [n, value] : values)
    setDistance(*leaf, n, value, halfWidth, field.voxelSize()[0], field.background());
}

}  // namespace levelset::eikonal
