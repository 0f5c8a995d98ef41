#pragma once

// For the .cpp files of levelset/curvature_flow only.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/vdb.h"

namespace levelset::flow {

/// One float for each grid point of a leaf block.
using Values = std::array<float, 512>;
/// Values of all leaf blocks of a tree, in tree order.
using Field = std::vector<Values>;

/// A leaf block with a border of two grid points on each side. Rows have 16 entries instead of 12,
/// so that vector instructions may read beyond the end of a row.
struct PaddedBlock : PaddedLeaf<2, 16> {
  /// Sum of the values at the six neighbours of a grid point, given by its offset in the leaf.
  [[nodiscard]] float neighbourSum(openvdb::Index offset) const {
    const auto n = static_cast<int>(offset);
    const float* p = at(n >> 6, n >> 3 & 7, n & 7);
    return p[kStepX] + p[-kStepX] + p[kStepY] + p[-kStepY] + p[1] + p[-1];
  }
};

/// The leaf blocks of a band and their neighbours. Fields on the blocks are plain arrays, so that
/// several can exist at the same time. The topology does not change.
class BandBlocks {
 public:
  using LeafNode = openvdb::FloatTree::LeafNodeType;
  using Mask = openvdb::util::NodeMask<3>;
  static constexpr std::uint32_t kNone = 0xffffffffu;

  explicit BandBlocks(const openvdb::FloatTree& tree);

  [[nodiscard]] std::size_t size() const { return origins_.size(); }
  [[nodiscard]] const openvdb::Coord& origin(std::size_t i) const { return origins_[i]; }
  [[nodiscard]] const Mask& active(std::size_t i) const { return active_[i]; }
  /// Number of a grid point: 512 × block + offset; kNone outside all blocks.
  [[nodiscard]] std::uint32_t find(const openvdb::Coord& gridPoint) const;

  /// Reads all leaf values of a tree of the same topology, divided by `unit` (the voxel size gives
  /// values in voxels).
  [[nodiscard]] Field read(const openvdb::FloatTree& tree, double unit) const;
  /// Writes the active values to the tree, multiplied by `unit`.
  void write(const Field& field, double unit, openvdb::FloatTree& tree) const;

  /// Copies block `i` of a field and a border of two grid points from its neighbours.
  /// @param outside  value at border points that no leaf block holds: positive outside the solid;
  /// inside it, the value is −outside
  void gather(const Field& field, std::size_t i, float outside, PaddedBlock& block) const;

  /// Calls work(i, scratch) for each block, in parallel. Each task has one `Scratch`.
  template <typename Scratch, typename Work>
  void forEach(const Work& work) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 16), [&](const auto& range) {
      const auto scratch = std::make_unique<Scratch>();
      for (std::size_t i = range.begin(); i != range.end(); ++i) work(i, *scratch);
    });
  }

  /// Sums work(i) over the blocks, computed in parallel and added in tree order.
  template <typename Sum, typename Work>
  [[nodiscard]] Sum sum(const Work& work) const {
    std::vector<Sum> parts(size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 16), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) parts[i] = work(i);
    });
    Sum total{};
    for (const Sum& part : parts) total += part;
    return total;
  }

 private:
  // Entries of neighbours_ for a missing block, outside and inside the solid.
  static constexpr std::int32_t kOutside = -1, kInside = -2;

  std::vector<openvdb::Coord> origins_;
  std::vector<Mask> active_;
  std::vector<std::array<std::int32_t, 27>> neighbours_;
  std::unordered_map<openvdb::Coord, std::uint32_t, std::hash<openvdb::Coord>> index_;
};

}  // namespace levelset::flow
