#include "levelset/adaptive/hanging_nodes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/adaptive/adaptive_tree.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

/// Finds the largest leaf that touches a point of a block's lattice and is no child of a cell of
/// the size of the block's parent. The point is no corner of the parent.
/// @param at  0 to 2 along each axis, with a 1
std::optional<HashedOctree::Place> largerLeaf(const HashedOctree& octree, const CellKey& parent,
                                              const V3i& at) {
  const int side = 1 << octree.depth(), edge = static_cast<int>(parent.edge());
  std::optional<HashedOctree::Place> largest;
  // Neighbours of the parent that touch the point: steps along the axes on which it lies at an end.
  for (int steps = 1; steps < 8; ++steps) {
    V3i low = parent.low();
    bool isBeside = true;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(steps >> axis & 1)) continue;
      if (at[axis] == 1) isBeside = false;
      low[axis] += at[axis] == 0 ? -edge : edge;
      if (low[axis] < 0 || low[axis] >= side) isBeside = false;
    }
    if (!isBeside) continue;
    const CellKey beside{std::uint32_t(low.x), std::uint32_t(low.y), std::uint32_t(low.z),
                         parent.level};
    if (octree.isSplit(beside)) continue;
    const HashedOctree::Place place =
        octree.findLeaf(low, [&](const CellKey& key) { return octree.block(key); });
    if (!largest || place.leaf.level > largest->leaf.level) largest = place;
  }
  return largest;
}

void constrainBlock(AdaptiveTree& tree, std::uint32_t block) {
  const HashedOctree& octree = tree.octree;
  const CellKey parent = octree.parent(block);
  const std::uint32_t outer =
      parent.level == octree.depth() ? HashedOctree::kNone : octree.block(parent.parent());
  const int half = static_cast<int>(parent.edge() / 2);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x) {
        const V3i at(x, y, z);
        float& value = tree.values[block][static_cast<std::size_t>(x + 3 * y + 9 * z)];
        if (x != 1 && y != 1 && z != 1) {
          // A corner of the parent has its value in the block of the parent already.
          if (outer != HashedOctree::kNone)
            value = tree.corner(outer, parent.octant(), x / 2 | y / 2 << 1 | z / 2 << 2);
          continue;
        }
        const auto place = largerLeaf(octree, parent, at);
        if (!place) continue;
        const V3d local = V3d(parent.low() + at * half - place->leaf.low()) / place->leaf.edge();
        value = static_cast<float>(tree.interpolate(*place, local));
      }
}

}  // namespace

void constrainHangingNodes(AdaptiveTree& tree) {
  // Large cells first: a leaf must have its own values before smaller ones take them over.
  std::vector<std::vector<std::uint32_t>> levels(static_cast<std::size_t>(tree.octree.depth()) + 1);
  for (std::uint32_t block = 0; block < tree.octree.blockCount(); ++block)
    levels[static_cast<std::size_t>(tree.octree.parent(block).level)].push_back(block);
  for (auto blocks = levels.rbegin(); blocks != levels.rend(); ++blocks)
    tbb::parallel_for(std::size_t{0}, blocks->size(),
                      [&](std::size_t k) { constrainBlock(tree, (*blocks)[k]); });
}

}  // namespace levelset
