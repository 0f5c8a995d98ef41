#include "levelset/adaptive/octree/hanging_nodes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

using Leaf = std::optional<HashedOctree::Place>;

/// Sources of the figures at a point of a block's lattice.
struct Source {
  Leaf larger;  ///< largest leaf that touches the point
  /// For each axis the largest one of those that touch the block along that axis. Its derivative
  /// along the axis is that of the common face or edge. Across an edge, derivatives of leaves jump.
  std::array<Leaf, 3> along;
  std::uint32_t block;  ///< first one of the blocks of this size that have the point
};

void keepLarger(const HashedOctree::Place& place, Leaf& leaf) {
  if (!leaf || place.leaf.level > leaf->leaf.level) leaf = place;
}

/// Finds the sources of a point that is no corner of the block's parent.
/// @param at  0 to 2 along each axis, with a 1
Source sourceOf(const HashedOctree& octree, std::uint32_t block, const V3i& at) {
  const CellKey parent = octree.parent(block);
  const int side = 1 << octree.depth(), edge = static_cast<int>(parent.edge());
  Source source{{}, {}, block};
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
    const std::uint32_t other =
        octree.block({static_cast<std::uint32_t>(low.x), static_cast<std::uint32_t>(low.y),
                      static_cast<std::uint32_t>(low.z), parent.level});
    if (other != HashedOctree::kNone) {
      source.block = std::min(source.block, other);
      continue;
    }
    const HashedOctree::Place place =
        octree.findLeaf(low, [&](const CellKey& key) { return octree.block(key); });
    keepLarger(place, source.larger);
    for (int axis = 0; axis < 3; ++axis)
      if (!(steps >> axis & 1)) keepLarger(place, source.along[static_cast<std::size_t>(axis)]);
  }
  return source;
}

/// Copies the figures at a point of one block to a point of another.
void copyPoint(const CornerData& from, std::uint32_t block, std::size_t index, CornerData& to,
               std::uint32_t toBlock, std::size_t toIndex) {
  to.values[toBlock][toIndex] = from.values[block][index];
  if (!from.isTricubic()) return;
  for (std::size_t axis = 0; axis < 3; ++axis)
    to.gradients[toBlock][axis][toIndex] = from.gradients[block][axis][index];
}

void resize(CornerData& data, std::size_t blocks, bool isTricubic) {
  data.values.resize(blocks);
  if (isTricubic) data.gradients.resize(blocks);
}

LeafInterpolant interpolantIn(const CornerData& data, const HashedOctree::Place& place,
                              double unit) {
  return interpolantOf(data, place.block, place.leaf.octant(), unit * place.leaf.edge());
}
/// Position of a point in a leaf, each coordinate in [0, 1].
V3d localIn(const HashedOctree::Place& place, const V3i& point) {
  return V3d(point - place.leaf.low()) / place.leaf.edge();
}

void fill(const AdaptiveTree& tree, std::uint32_t block, CornerData& data) {
  const HashedOctree& octree = tree.octree;
  const CellKey parent = octree.parent(block);
  const std::uint32_t outer =
      parent.level == octree.depth() ? HashedOctree::kNone : octree.block(parent.parent());
  const int half = static_cast<int>(parent.edge() / 2);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x) {
        const V3i at(x, y, z);
        const auto i = static_cast<std::size_t>(x + 3 * y + 9 * z);
        if (x != 1 && y != 1 && z != 1) {
          // A corner of the parent has its value in the block of the parent already.
          if (outer == HashedOctree::kNone)
            copyPoint(tree.data, block, i, data, block, i);
          else
            copyPoint(data, outer,
                      AdaptiveTree::latticeIndex(parent.octant(), x / 2 | y / 2 << 1 | z / 2 << 2),
                      data, block, i);
          continue;
        }
        const Source source = sourceOf(octree, block, at);
        const V3i p = (parent.low() + at * half - octree.parent(source.block).low()) / half;
        copyPoint(tree.data, source.block, static_cast<std::size_t>(p.x + 3 * p.y + 9 * p.z), data,
                  block, i);
        if (!source.larger) continue;
        const V3i point = parent.low() + at * half;
        data.values[block][i] = static_cast<float>(
            interpolantIn(data, *source.larger, tree.unit).value(localIn(*source.larger, point)));
        for (int axis = 0; axis < 3 && tree.data.isTricubic(); ++axis) {
          const auto along = static_cast<std::size_t>(axis);
          const Leaf& leaf = source.along[along];
          if (!leaf) continue;
          const V3d slope = interpolantIn(data, *leaf, tree.unit).slope(localIn(*leaf, point));
          data.gradients[block][along][i] =
              static_cast<float>(slope[axis] / (tree.unit * leaf->leaf.edge()));
        }
      }
}

/// Collects the blocks up to a level whose parents touch a cell.
class Touching {
 public:
  Touching(const HashedOctree& octree, const CellKey& cell, int level,
           std::vector<std::uint32_t>& blocks)
      : octree_(octree),
        low_(cell.low()),
        high_(cell.low() + V3i(static_cast<int>(cell.edge()))),
        level_(level),
        blocks_(blocks) {
    collect(octree.root());
  }

 private:
  void collect(const CellKey& cell) {
    const V3i low = cell.low(), high = low + V3i(static_cast<int>(cell.edge()));
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] > high_[axis] || high[axis] < low_[axis]) return;
    const std::uint32_t block = octree_.block(cell);
    if (block == HashedOctree::kNone) return;
    if (cell.level <= level_) blocks_.push_back(block);
    if (cell.level > 1)
      for (int octant = 0; octant < 8; ++octant) collect(cell.child(octant));
  }

  const HashedOctree& octree_;
  V3i low_, high_;
  int level_;
  std::vector<std::uint32_t>& blocks_;
};

void sortUnique(std::vector<std::uint32_t>& blocks) {
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
}

}  // namespace

std::vector<std::uint32_t> updateData(const AdaptiveTree& tree, std::uint32_t first,
                                      CornerData& data) {
  const HashedOctree& octree = tree.octree;
  const auto count = static_cast<std::uint32_t>(octree.blockCount());
  resize(data, count, tree.data.isTricubic());
  // Blocks to compute, by the level of their parent. A block depends on larger leaves only, and on
  // the block of its parent.
  std::vector<std::vector<std::uint32_t>> levels(static_cast<std::size_t>(octree.depth()) + 1);
  const auto add = [&](const CellKey& cell, int level) {
    std::vector<std::uint32_t> blocks;
    Touching(octree, cell, level, blocks);
    for (const std::uint32_t block : blocks)
      levels[static_cast<std::size_t>(octree.parent(block).level)].push_back(block);
  };
  for (std::uint32_t block = first; block < count; ++block)
    add(octree.parent(block), octree.parent(block).level);
  std::vector<std::uint32_t> computed;
  for (std::size_t level = levels.size(); level-- > 0;) {
    std::vector<std::uint32_t>& blocks = levels[level];
    sortUnique(blocks);
    std::vector<char> isChanged(blocks.size(), 0);
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t k) {
      const std::uint32_t block = blocks[k];
      const CornerValues before = data.values[block];
      const CornerGradients slopes = data.isTricubic() ? data.gradients[block] : CornerGradients{};
      fill(tree, block, data);
      isChanged[k] =
          before != data.values[block] || (data.isTricubic() && slopes != data.gradients[block]);
    });
    for (std::size_t k = 0; k < blocks.size(); ++k)
      if (isChanged[k] && level > 0) add(octree.parent(blocks[k]), static_cast<int>(level) - 1);
    computed.insert(computed.end(), blocks.begin(), blocks.end());
  }
  sortUnique(computed);
  return computed;
}

CornerData continuousData(const AdaptiveTree& tree) {
  CornerData data;
  resize(data, tree.octree.blockCount(), tree.data.isTricubic());
  // Large cells first: a leaf must have its own values before smaller ones take them over.
  std::vector<std::vector<std::uint32_t>> levels(static_cast<std::size_t>(tree.octree.depth()) + 1);
  for (std::uint32_t block = 0; block < tree.octree.blockCount(); ++block)
    levels[static_cast<std::size_t>(tree.octree.parent(block).level)].push_back(block);
  for (auto blocks = levels.rbegin(); blocks != levels.rend(); ++blocks)
    tbb::parallel_for(std::size_t{0}, blocks->size(),
                      [&](std::size_t k) { fill(tree, (*blocks)[k], data); });
  return data;
}

}  // namespace levelset
