#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/adaptive/octree/cell_key.h"

namespace levelset {

/// Octree without pointers: a hash table finds cells by their keys [Sigg06, chapter 3]. The eight
/// children of a cell form a block, and the table holds the cells that have children. So a cell
/// takes 3 to 4 bytes. The thesis stores one entry for each cell and needs 25 bytes. Access costs
/// one search at any depth.
class HashedOctree {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Makes a tree of the root alone.
  /// @param depth  level of the root, from 1 to kMaxOctreeDepth
  explicit HashedOctree(int depth);

  [[nodiscard]] int depth() const { return depth_; }
  [[nodiscard]] CellKey root() const { return {0, 0, 0, depth_}; }
  [[nodiscard]] std::size_t blockCount() const { return parents_.size(); }
  [[nodiscard]] std::size_t cellCount() const { return 8 * parents_.size() + 1; }
  [[nodiscard]] std::size_t leafCount() const { return 7 * parents_.size() + 1; }
  [[nodiscard]] std::size_t memoryUse() const;

  /// Number of the block that holds the children of a cell; kNone for a leaf, and for a cell that
  /// the tree does not have. Blocks are numbered in the order of their creation.
  [[nodiscard]] std::uint32_t block(const CellKey& cell) const;
  /// Cell whose children a block holds.
  [[nodiscard]] CellKey parent(std::uint32_t block) const {
    return CellKey::unpacked(parents_[block]);
  }
  [[nodiscard]] bool isSplit(const CellKey& cell) const { return block(cell) != kNone; }
  [[nodiscard]] bool contains(const CellKey& cell) const {
    return cell.level == depth_ || isSplit(cell.parent());
  }
  /// Gives a leaf eight children. Returns the number of their block.
  /// @pre the cell is a leaf above level 0, and there are fewer than 2³² − 1 blocks
  std::uint32_t split(const CellKey& leaf);

  /// Finds the leaf that contains a finest cell, by a binary search over the levels.
  /// @param cell  each coordinate in [0, 2^depth)
  [[nodiscard]] CellKey leafAt(const Imath::V3i& cell) const {
    return findLeaf(cell, [this](const CellKey& key) { return block(key); }).leaf;
  }
  /// Finds the neighbour across a face: the cell of the same size, or else the larger leaf there.
  /// Empty beyond the root.
  /// @param axis  0 to 2
  /// @param side  −1 or 1
  [[nodiscard]] std::optional<CellKey> neighbour(const CellKey& cell, int axis, int side) const;
  /// Returns true if a point is a corner of a cell. Needs one to four searches: the eight cells of
  /// the size that the position allows have at most four different parents.
  /// @param point  each coordinate in [0, 2^depth]
  [[nodiscard]] bool hasNode(const Imath::V3i& point) const;
  /// Finds the largest leaf that touches a point and does not have it as a corner. Empty for a node
  /// that is no hanging one.
  [[nodiscard]] std::optional<CellKey> leafWithout(const Imath::V3i& point) const;

  /// Leaf, and the block that holds it; kNone for the root.
  struct Place {
    CellKey leaf;
    std::uint32_t block;
  };
  /// Finds the leaf that contains a finest cell.
  /// @param block  function that returns the block of a cell, as block() does
  template <class Block>
  [[nodiscard]] Place findLeaf(const Imath::V3i& cell, const Block& block) const {
    const CellKey finest{std::uint32_t(cell.x), std::uint32_t(cell.y), std::uint32_t(cell.z), 0};
    // If a cell has children, so do its ancestors. Find the smallest one.
    int low = 1, high = depth_ + 1;  // the ancestor at `high` has children, or lies above the root
    std::uint32_t found = kNone;
    while (low < high) {
      const int middle = (low + high) / 2;
      const std::uint32_t number = block(finest.ancestor(middle));
      if (number == kNone) {
        low = middle + 1;
      } else {
        high = middle;
        found = number;
      }
    }
    return {finest.ancestor(high - 1), found};
  }

 private:
  void insert(std::uint64_t key, std::uint32_t block);
  void grow();

  int depth_;
  std::vector<std::uint64_t> parents_;  ///< key of the parent of each block
  // Open addressing with linear probing.
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> blocks_;  ///< kNone: free
};

/// Searches in an octree with a direct-mapped cache in front [Sigg06, 3.4.2]. Cheap to construct;
/// use one per thread. The tree must not change.
class CachedOctree {
 public:
  explicit CachedOctree(const HashedOctree& tree) : tree_(tree) { keys_.fill(kEmpty); }

  [[nodiscard]] std::uint32_t block(const CellKey& cell) const;
  [[nodiscard]] HashedOctree::Place findLeaf(const Imath::V3i& cell) const {
    return tree_.findLeaf(cell, [this](const CellKey& key) { return block(key); });
  }
  /// Share of the searches that the cache answered.
  [[nodiscard]] double hitRate() const {
    return searches_ > 0 ? double(hits_) / double(searches_) : 0;
  }

 private:
  static constexpr std::size_t kLines = 127;  // a prime: keys differ in few bits
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  const HashedOctree& tree_;
  mutable std::array<std::uint64_t, kLines> keys_;
  mutable std::array<std::uint32_t, kLines> blocks_;
  mutable std::size_t hits_ = 0, searches_ = 0;
};

}  // namespace levelset
