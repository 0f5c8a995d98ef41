#pragma once

#include <Imath/ImathVec.h>

#include <bit>
#include <cstdint>
#include <vector>

namespace levelset::convert {

/// Hash table with open addressing that finds equal points of two or three coordinates. −0 and +0
/// are equal.
template <typename Vector>
class ValueTable {
 public:
  /// @param points  positions of the entered indices; the caller keeps them alive
  /// @param expected  expected number of entries
  ValueTable(const std::vector<Vector>& points, std::size_t expected)
      : points_(points), slots_(std::bit_ceil(2 * expected + 2), kNone) {}

  /// Returns the index entered before for an equal position; otherwise enters `index` and returns
  /// it.
  /// @pre points[index] equals `p`, at the latest when the next position is entered
  std::uint32_t findOrInsert(const Vector& p, std::uint32_t index) {
    if (2 * entered_ >= slots_.size()) grow();
    std::uint32_t& slot = find(p);
    if (slot == kNone) {
      slot = index;
      ++entered_;
    }
    return slot;
  }

  [[nodiscard]] std::size_t bytes() const { return slots_.capacity() * sizeof(slots_[0]); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  static std::uint64_t hashOf(const Vector& p) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < static_cast<int>(Vector::dimensions()); ++axis) {
      const double value = p[axis] + 0.0;  // −0 + 0 = 0
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x9e3779b97f4a7c15ull;
      hash ^= hash >> 29;
    }
    return hash;
  }

  std::uint32_t& find(const Vector& p) {
    std::size_t i = hashOf(p) & (slots_.size() - 1);
    while (slots_[i] != kNone && points_[slots_[i]] != p) i = (i + 1) & (slots_.size() - 1);
    return slots_[i];
  }

  void grow() {
    std::vector<std::uint32_t> old(4 * slots_.size(), kNone);
    old.swap(slots_);
    for (const std::uint32_t index : old)
      if (index != kNone) find(points_[index]) = index;
  }

  const std::vector<Vector>& points_;
  std::vector<std::uint32_t> slots_;
  std::size_t entered_ = 0;
};

using PositionTable = ValueTable<Imath::V3d>;

}  // namespace levelset::convert
