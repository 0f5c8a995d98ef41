#include "levelset/adaptive/octree/hashed_octree.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace levelset {
namespace {

// The table grows by a fifth at this load, so the load stays between 2/3 and 4/5.
constexpr double kLargestLoad = 0.8, kGrowth = 1.2;

std::uint64_t mixed(std::uint64_t key) {
  key = (key ^ key >> 33) * 0xff51afd7ed558ccdull;
  key = (key ^ key >> 33) * 0xc4ceb9fe1a85ec53ull;
  return key ^ key >> 33;
}

std::size_t slotOf(std::uint64_t key, std::size_t slots) {
  return static_cast<std::size_t>((mixed(key) >> 32) * slots >> 32);
}

bool isInside(const Imath::V3i& p, int side) {
  return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < side && p.y < side && p.z < side;
}

CellKey keyAt(const Imath::V3i& p, int level) {
  return CellKey{std::uint32_t(p.x), std::uint32_t(p.y), std::uint32_t(p.z), 0}.ancestor(level);
}

/// Finest cell in an octant around a point.
Imath::V3i cellBeside(const Imath::V3i& p, int octant) {
  return {p.x - (octant & 1 ? 0 : 1), p.y - (octant & 2 ? 0 : 1), p.z - (octant & 4 ? 0 : 1)};
}

}  // namespace

HashedOctree::HashedOctree(int depth) : depth_(depth), keys_(16), blocks_(16, kNone) {
  assert(depth >= 1 && depth <= kMaxOctreeDepth);
}

std::size_t HashedOctree::memoryUse() const {
  return parents_.capacity() * sizeof(std::uint64_t) + keys_.capacity() * sizeof(std::uint64_t) +
         blocks_.capacity() * sizeof(std::uint32_t);
}

std::uint32_t HashedOctree::block(const CellKey& cell) const {
  const std::uint64_t key = cell.packed();
  const std::size_t slots = keys_.size();
  for (std::size_t slot = slotOf(key, slots);; slot = slot + 1 == slots ? 0 : slot + 1) {
    if (blocks_[slot] == kNone) return kNone;
    if (keys_[slot] == key) return blocks_[slot];
  }
}

void HashedOctree::insert(std::uint64_t key, std::uint32_t block) {
  const std::size_t slots = keys_.size();
  std::size_t slot = slotOf(key, slots);
  while (blocks_[slot] != kNone) slot = slot + 1 == slots ? 0 : slot + 1;
  keys_[slot] = key;
  blocks_[slot] = block;
}

void HashedOctree::grow() {
  const auto slots = static_cast<std::size_t>(kGrowth * double(keys_.size())) + 1;
  std::vector<std::uint64_t>(slots).swap(keys_);
  std::vector<std::uint32_t>(slots, kNone).swap(blocks_);
  for (std::uint32_t number = 0; number < parents_.size(); ++number)
    insert(parents_[number], number);
}

std::uint32_t HashedOctree::split(const CellKey& leaf) {
  assert(leaf.level > 0 && contains(leaf) && !isSplit(leaf));
  if (double(parents_.size() + 1) > kLargestLoad * double(keys_.size())) grow();
  const auto number = static_cast<std::uint32_t>(parents_.size());
  parents_.push_back(leaf.packed());
  insert(leaf.packed(), number);
  return number;
}

std::optional<CellKey> HashedOctree::neighbour(const CellKey& cell, int axis, int side) const {
  Imath::V3i low = cell.low();
  low[axis] += side * int(cell.edge());
  if (!isInside(low, 1 << depth_)) return {};
  const CellKey same = keyAt(low, cell.level);
  return contains(same) ? same : leafAt(low);
}

bool HashedOctree::hasNode(const Imath::V3i& point) const {
  int level = depth_;
  for (int axis = 0; axis < 3; ++axis)
    level = std::min(level, std::countr_zero(static_cast<unsigned>(point[axis])));
  if (level == depth_) return true;  // a corner of the root
  std::array<std::uint64_t, 8> tried;
  std::size_t count = 0;
  for (int octant = 0; octant < 8; ++octant) {
    const Imath::V3i cell = cellBeside(point, octant);
    if (!isInside(cell, 1 << depth_)) continue;
    const CellKey parent = keyAt(cell, level + 1);
    const auto end = tried.begin() + count;
    if (std::find(tried.begin(), end, parent.packed()) != end) continue;
    if (isSplit(parent)) return true;
    tried[count++] = parent.packed();
  }
  return false;
}

std::optional<CellKey> HashedOctree::leafWithout(const Imath::V3i& point) const {
  std::optional<CellKey> largest;
  for (int octant = 0; octant < 8; ++octant) {
    const Imath::V3i cell = cellBeside(point, octant);
    if (!isInside(cell, 1 << depth_)) continue;
    const CellKey leaf = leafAt(cell);
    const int mask = int(leaf.edge()) - 1;
    const bool isCorner = ((point.x | point.y | point.z) & mask) == 0;
    if (!isCorner && (!largest || leaf.level > largest->level)) largest = leaf;
  }
  return largest;
}

std::uint32_t CachedOctree::block(const CellKey& cell) const {
  const std::uint64_t key = cell.packed();
  const auto line = static_cast<std::size_t>(key % kLines);
  ++searches_;
  if (keys_[line] == key) {
    ++hits_;
  } else {
    keys_[line] = key;
    blocks_[line] = tree_.block(cell);
  }
  return blocks_[line];
}

}  // namespace levelset
