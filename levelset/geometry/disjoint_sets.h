#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace levelset {

/// Sets of numbers that are joined one by one; the lowest of a set stands for it (internal).
class DisjointSets {
 public:
  /// 0 … count − 1, each alone.
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  [[nodiscard]] std::size_t size() const { return parent_.size(); }

  /// One more, alone.
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  /// The lowest of the set of i.
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t i, std::uint32_t j) {
    const std::uint32_t a = find(i), b = find(j);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace levelset
