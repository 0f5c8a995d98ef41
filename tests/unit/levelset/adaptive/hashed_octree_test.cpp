// Hashed octree against a tree that is searched from the root.

#include "levelset/adaptive/octree/hashed_octree.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <vector>

namespace hashed_octree_test {

using namespace levelset;
using Imath::V3i;

constexpr int kDepth = 7;

/// Cells of a tree by brute force.
class Reference {
 public:
  explicit Reference(const CellKey& root) : leaves_{{root.packed(), root}} {}
  void split(const CellKey& leaf) {
    leaves_.erase(leaf.packed());
    split_.insert(leaf.packed());
    for (int octant = 0; octant < 8; ++octant) {
      const CellKey child = leaf.child(octant);
      leaves_[child.packed()] = child;
      all_.insert(child.packed());
    }
  }
  [[nodiscard]] bool isSplit(const CellKey& cell) const { return split_.contains(cell.packed()); }
  [[nodiscard]] bool contains(const CellKey& cell) const {
    return cell.level == kDepth || all_.contains(cell.packed());
  }
  [[nodiscard]] CellKey leafAt(const V3i& cell, const CellKey& root) const {
    CellKey at = root;
    while (isSplit(at)) {
      for (int octant = 0; octant < 8; ++octant)
        if (holds(at.child(octant), cell)) {
          at = at.child(octant);
          break;
        }
    }
    return at;
  }
  [[nodiscard]] std::vector<CellKey> leaves() const {
    std::vector<CellKey> result;
    for (const auto& [bits, leaf] : leaves_) result.push_back(leaf);
    return result;
  }
  static bool holds(const CellKey& cell, const V3i& p) {
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] < cell.low()[axis] || p[axis] >= cell.low()[axis] + int(cell.edge()))
        return false;
    return true;
  }

 private:
  std::map<std::uint64_t, CellKey> leaves_;
  std::set<std::uint64_t> split_, all_;
};

/// Splits random leaves, more often those around a point.
class HashedOctreeTest : public testing::Test {
 protected:
  void SetUp() override {
    for (int k = 0; k < 400; ++k) {
      const V3i p(within(1 << kDepth), within(1 << kDepth) / 3, within(1 << kDepth) / 5);
      const CellKey leaf = reference.leafAt(p, octree.root());
      if (leaf.level == 0) continue;
      const std::uint32_t block = octree.split(leaf);
      EXPECT_EQ(block, octree.blockCount() - 1);
      EXPECT_EQ(octree.parent(block), leaf);
      reference.split(leaf);
    }
  }
  void expectLeavesOfRandomPoints(int count);
  void expectKnownCells(int count);
  void expectNeighbours(int count);
  void expectNodes(int count);
  int within(int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); }

  std::mt19937 random{5};
  HashedOctree octree{kDepth};
  Reference reference{CellKey{0, 0, 0, kDepth}};
};

TEST_F(HashedOctreeTest, KeysKeepTheirMembers) {
  for (int k = 0; k < 10000; ++k) {
    const int level = within(kMaxOctreeDepth + 1), side = 1 << kMaxOctreeDepth;
    const CellKey key = CellKey{std::uint32_t(within(side)), std::uint32_t(within(side)),
                                std::uint32_t(within(side)), 0}
                            .ancestor(level);
    EXPECT_EQ(CellKey::unpacked(key.packed()), key);
    if (level == 0) continue;
    for (int octant = 0; octant < 8; ++octant) {
      EXPECT_EQ(key.child(octant).octant(), octant);
      EXPECT_EQ(key.child(octant).parent(), key);
    }
  }
}

void HashedOctreeTest::expectLeavesOfRandomPoints(int count) {
  const CachedOctree cached(octree);
  for (int k = 0; k < count; ++k) {
    const V3i p(within(1 << kDepth), within(1 << kDepth), within(1 << kDepth));
    const CellKey expected = reference.leafAt(p, octree.root());
    ASSERT_EQ(octree.leafAt(p), expected);
    const auto place = cached.findLeaf(p);
    ASSERT_EQ(place.leaf, expected);
    ASSERT_EQ(place.block, octree.block(expected.parent()));
  }
  EXPECT_GT(cached.hitRate(), 0.4);  // measured 0.62
}

TEST_F(HashedOctreeTest, FindsTheLeavesOfRandomPoints) {
  expectLeavesOfRandomPoints(100000);
}

void HashedOctreeTest::expectKnownCells(int count) {
  for (int k = 0; k < count; ++k) {
    const CellKey cell =
        CellKey{std::uint32_t(within(1 << kDepth)), std::uint32_t(within(1 << kDepth)),
                std::uint32_t(within(1 << kDepth)), 0}
            .ancestor(within(kDepth + 1));
    ASSERT_EQ(octree.contains(cell), reference.contains(cell));
    ASSERT_EQ(octree.isSplit(cell), reference.isSplit(cell));
  }
  EXPECT_EQ(octree.leafCount(), reference.leaves().size());
  EXPECT_EQ(octree.cellCount(), 8 * octree.blockCount() + 1);
}

TEST_F(HashedOctreeTest, KnowsItsCells) {
  expectKnownCells(100000);
}

/// Neighbours of random cells of all levels that are in the tree, across random faces.
void HashedOctreeTest::expectNeighbours(int count) {
  int larger = 0, outside = 0;
  for (int k = 0; k < count;) {
    const V3i inside(within(1 << kDepth), within(1 << kDepth), within(1 << kDepth));
    CellKey cell = reference.leafAt(inside, octree.root());
    cell = cell.ancestor(cell.level + within(kDepth - cell.level + 1));
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        ++k;
        V3i beside = cell.low();
        beside[axis] += side < 0 ? -1 : int(cell.edge());
        const auto found = octree.neighbour(cell, axis, side);
        if (!Reference::holds(octree.root(), beside)) {
          ASSERT_FALSE(found);
          ++outside;
          continue;
        }
        const CellKey leaf = reference.leafAt(beside, octree.root());
        ASSERT_TRUE(found);
        ASSERT_EQ(*found, leaf.level >= cell.level ? leaf : leaf.ancestor(cell.level));
        larger += leaf.level > cell.level;
      }
  }
  EXPECT_GT(larger, count / 100);
  EXPECT_GT(outside, count / 100);
}

TEST_F(HashedOctreeTest, FindsNeighboursAcrossFaces) {
  expectNeighbours(50000);
}

void HashedOctreeTest::expectNodes(int count) {
  const std::vector<CellKey> leaves = reference.leaves();
  std::set<std::array<int, 3>> nodes;
  for (const CellKey& leaf : leaves)
    for (int c = 0; c < 8; ++c) {
      const V3i p = leaf.low() + V3i(c & 1, c >> 1 & 1, c >> 2) * int(leaf.edge());
      nodes.insert({p.x, p.y, p.z});
    }
  int hanging = 0;
  for (int k = 0; k < count; ++k) {
    // Every second point is a node.
    V3i p(within((1 << kDepth) + 1), within((1 << kDepth) + 1), within((1 << kDepth) + 1));
    if (k % 2) {
      const CellKey& leaf = leaves[static_cast<std::size_t>(within(int(leaves.size())))];
      p = leaf.low() + V3i(within(2), within(2), within(2)) * int(leaf.edge());
    }
    ASSERT_EQ(octree.hasNode(p), nodes.contains({p.x, p.y, p.z}));
    int largest = -1;  // level of the largest leaf that touches p without having it as a corner
    for (int o = 0; o < 8; ++o) {
      const V3i cell = p - V3i(o & 1, o >> 1 & 1, o >> 2);
      if (!Reference::holds(octree.root(), cell)) continue;
      const CellKey leaf = reference.leafAt(cell, octree.root());
      const V3i inside = p - leaf.low();
      const bool isCorner = inside.x % int(leaf.edge()) == 0 && inside.y % int(leaf.edge()) == 0 &&
                            inside.z % int(leaf.edge()) == 0;
      if (!isCorner) largest = std::max(largest, leaf.level);
    }
    const auto found = octree.leafWithout(p);
    ASSERT_EQ(found ? found->level : -1, largest);
    hanging += largest >= 0 && octree.hasNode(p);
  }
  EXPECT_GT(hanging, 100);
}

TEST_F(HashedOctreeTest, TellsNodesAndHangingOnes) {
  expectNodes(20000);
}

using SlowHashedOctreeTest = HashedOctreeTest;

TEST_F(SlowHashedOctreeTest, AnswersAMillionQueries) {
  expectLeavesOfRandomPoints(1000000);
  expectKnownCells(1000000);
  expectNeighbours(1000000);
  expectNodes(1000000);
}

TEST(HashedOctree, TakesThreeToFourBytesForACell) {
  HashedOctree octree(kMaxOctreeDepth);
  octree.split(octree.root());
  double largest = 0;
  for (std::uint32_t block = 0; octree.blockCount() < 300000; ++block) {
    for (int octant = 0; octant < 8; octant += 3) octree.split(octree.parent(block).child(octant));
    if (octree.blockCount() > 1000)
      largest = std::max(largest, double(octree.memoryUse()) / double(octree.cellCount()));
  }
  // 8 to 16 bytes for the parent of a block, and 12 in a table that is two thirds full or fuller.
  EXPECT_LT(largest, 4.3);
}

}  // namespace hashed_octree_test
