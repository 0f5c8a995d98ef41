#include <openvdb/tree/LeafManager.h>
#include <openvdb/tree/NodeManager.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/grids/grid_queries_vdb.h"

namespace levelset {

using openvdb::FloatGrid;
using openvdb::FloatTree;

namespace {

/// Replaces nodes by tiles where they lie beyond the band and on one side of the surface. OpenVDB's
/// pruneLevelSet() uses a node's first value, which is valid for closed bands only. At the cut of a
/// cropped band (crop.h), a node may hold inactive values of both signs.
class PruneOneSided {
 public:
  explicit PruneOneSided(float background) : background_(background) {}

  void operator()(FloatTree::RootNodeType& root) const {
    for (auto child = root.beginChildOn(); child; ++child)
      if (isOneSided(*child)) root.addTile(child.getCoord(), tileOf(*child), false);
    root.eraseBackgroundTiles();
  }
  template <typename Node>
  void operator()(Node& node) const {
    for (auto child = node.beginChildOn(); child; ++child)
      if (isOneSided(*child)) node.addTile(child.pos(), tileOf(*child), false);
  }
  void operator()(FloatTree::LeafNodeType&) const {}

 private:
  template <typename Node>
  static bool isOneSided(const Node& node) {
    if (!node.isInactive()) return false;
    const bool isInside = node.getFirstValue() < 0;
    for (auto value = node.cbeginValueOff(); value; ++value)
      if ((*value < 0) != isInside) return false;
    return !node.cbeginChildOn();
  }
  template <typename Node>
  [[nodiscard]] float tileOf(const Node& node) const {
    return std::copysign(background_, node.getFirstValue());
  }

  float background_;
};

}  // namespace

void pruneOneSided(FloatTree& tree) {
  openvdb::tree::NodeManager<FloatTree, FloatTree::DEPTH - 2> nodes(tree);
  nodes.foreachBottomUp(PruneOneSided(tree.background()));
}

void endBandAt(FloatGrid& grid, float background) {
  openvdb::tree::LeafManager<FloatTree> leaves(grid.tree());
  leaves.foreach ([background](FloatTree::LeafNodeType& leaf, std::size_t) {
    float* values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < FloatTree::LeafNodeType::SIZE; ++i) {
      if (std::abs(values[i]) < background) continue;
      values[i] = std::copysign(background, values[i]);
      leaf.setValueOff(i);
    }
  });
  auto tile = grid.tree().beginValueOff();
  tile.setMaxDepth(FloatTree::DEPTH - 2);
  for (; tile; ++tile) tile.setValue(std::copysign(background, *tile));
  grid.tree().root().setBackground(background, /*updateChildNodes=*/false);
  pruneOneSided(grid.tree());
}

bool shareTransform(const FloatGrid& a, const FloatGrid& b) {
  openvdb::CoordBBox box = a.evalActiveVoxelBoundingBox();
  box.expand(b.evalActiveVoxelBoundingBox());
  // OpenVDB compares transforms with a tolerance of 1e-7 world units, which may exceed a voxel.
  if (box.empty()) return a.transform() == b.transform();
  std::array<openvdb::Coord, 8> corners;
  box.getCornerPoints(corners.data());
  return std::all_of(corners.begin(), corners.end(), [&](const openvdb::Coord& corner) {
    return (b.worldToIndex(a.indexToWorld(corner)) - corner.asVec3d()).length() < 1e-6;
  });
}

bool hasInside(const FloatGrid& grid) {
  for (auto it = grid.tree().cbeginValueAll(); it; ++it)
    if (*it < 0) return true;
  return false;
}

NarrowBand narrowed(NarrowBand band, double halfWidth) {
  const float background = backgroundOf(halfWidth, band.voxelSize());
  if (background < vdb(band).background()) endBandAt(editVdb(band), background);
  return band;
}

}  // namespace levelset
