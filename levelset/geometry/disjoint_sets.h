#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace levelset {

/// Union-find structure: disjoint sets of numbers that can be joined. The lowest number of a set
/// represents it. Internal.
class DisjointSets {
 public:
  /// The numbers 0 … count − 1, each in a set of its own.
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  [[nodiscard]] std::size_t size() const { return parent_.size(); }

  /// Adds one number in a set of its own and returns it.
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  /// Lowest number of the set that contains i.
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
