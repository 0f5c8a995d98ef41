#pragma once

// Bands of distances given by a formula, for the .cpp files of this library.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// Fills the tree of a band with the values of a distance function, whose slope is at most 1.
///
/// A block holds no voxel of the band if its centre lies far enough from the zero set: further than
/// the half width plus the distance from centre to corner. Such a block becomes a tile; only blocks
/// near the surface are evaluated point by point. Blocks are independent, so the result does not
/// depend on the number of threads.
/// @tparam Phi  double(double i, double j, double k): world distance at an index position
template <typename Phi>
class BlockFiller {
 public:
  using Leaf = openvdb::FloatTree::LeafNodeType;

  BlockFiller(openvdb::FloatGrid& grid, const Phi& phi)
      : tree_(grid.tree()),
        phi_(phi),
        voxelSize_(grid.voxelSize()[0]),
        background_(grid.background()) {}

  /// Limits the creation of leaves to blocks that meet this index box.
  void limitTo(const openvdb::CoordBBox& blocks) { limit_ = blocks; }

  /// Fills all nodes of 128³ grid points that meet the index box `domain`; the rest of the tree
  /// stays unchanged.
  /// @return true when a grid point lies inside the solid
  bool fill(const openvdb::CoordBBox& domain, const Progress& progress) {
    const openvdb::Coord first = domain.min() & ~(kRoot - 1);
    for (int x = first[0]; x <= domain.max()[0]; x += kRoot)
      for (int y = first[1]; y <= domain.max()[1]; y += kRoot)
        for (int z = first[2]; z <= domain.max()[2]; z += kRoot)
          descend(openvdb::Coord(x, y, z), kRoot, domain);
    // Refines the nodes in slices, so that cancelling takes effect quickly and the reports come
    // from one thread.
    constexpr std::size_t kSlice = 64;
    std::vector<Filled> slice(std::min(kSlice, surfaceBlocks_.size()));
    for (std::size_t from = 0; from < surfaceBlocks_.size(); from += kSlice) {
      const std::size_t count = std::min(kSlice, surfaceBlocks_.size() - from);
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
        slice[i] = {};
        refine(surfaceBlocks_[from + i], kLower, slice[i]);
      });
      for (std::size_t i = 0; i < count; ++i) insert(slice[i]);
      report(progress,
             static_cast<double>(from + count) / static_cast<double>(surfaceBlocks_.size()));
    }
    return anyInside_;
  }

 private:
  // Edge lengths of the tree's nodes, voxels.
  static constexpr int kRoot = 4096, kLower = 128, kLeaf = 8;
  enum class Side { Inside, Outside, Near };

  struct Filled {
    std::vector<std::unique_ptr<Leaf>> leaves;
    std::vector<openvdb::Coord> inside;  ///< origins of 8³ tiles inside the solid
    bool anyInside = false;
  };

  [[nodiscard]] Side sideOf(const openvdb::Coord& origin, int edge) const {
    const double half = 0.5 * (edge - 1);
    const double value = phi_(origin[0] + half, origin[1] + half, origin[2] + half);
    if (std::abs(value) - half * std::sqrt(3.0) * voxelSize_ < static_cast<double>(background_))
      return Side::Near;
    return value < 0 ? Side::Inside : Side::Outside;
  }

  /// Descends from blocks of kRoot³ to blocks of kLower³ grid points, serially, because there are
  /// few such blocks.
  void descend(const openvdb::Coord& origin, int edge, const openvdb::CoordBBox& domain) {
    if (!domain.hasOverlap(openvdb::CoordBBox::createCube(origin, edge))) return;
    const Side side = sideOf(origin, edge);
    if (side == Side::Outside) return;
    if (side == Side::Inside && (edge == kRoot || edge == kLower)) {
      tree_.addTile(edge == kRoot ? 3 : 2, origin, -background_, false);
      anyInside_ = true;
    } else if (edge == kLower) {
      surfaceBlocks_.push_back(origin);
    } else {
      forOctants(origin, edge, [&](const openvdb::Coord& c) { descend(c, edge / 2, domain); });
    }
  }

  void refine(const openvdb::Coord& origin, int edge, Filled& out) const {
    if (limit_ && !limit_->hasOverlap(openvdb::CoordBBox::createCube(origin, edge))) return;
    const Side side = sideOf(origin, edge);
    if (side == Side::Outside) return;
    if (edge > kLeaf) {
      forOctants(origin, edge, [&](const openvdb::Coord& c) { refine(c, edge / 2, out); });
    } else if (side == Side::Inside) {
      out.inside.push_back(origin);
      out.anyInside = true;
    } else {
      sample(origin, out);
    }
  }

  void sample(const openvdb::Coord& origin, Filled& out) const {
    auto leaf = std::make_unique<Leaf>(origin, background_, false);
    float* values = leaf->buffer().data();
    bool inside = false;
    openvdb::Index n = 0;
    for (int x = 0; x < kLeaf; ++x)
      for (int y = 0; y < kLeaf; ++y)
        for (int z = 0; z < kLeaf; ++z, ++n) {
          const auto value = static_cast<float>(phi_(origin[0] + x, origin[1] + y, origin[2] + z));
          inside |= value < 0;
          if (std::abs(value) < background_) {
            values[n] = value;
            leaf->setValueOn(n);
          } else {
            values[n] = std::copysign(background_, value);
          }
        }
    out.anyInside |= inside;
    if (!leaf->isEmpty())
      out.leaves.push_back(std::move(leaf));
    else if (inside)
      out.inside.push_back(origin);
  }

  void insert(Filled& filled) {
    for (const openvdb::Coord& c : filled.inside) tree_.addTile(1, c, -background_, false);
    for (auto& leaf : filled.leaves) tree_.addLeaf(leaf.release());
    anyInside_ |= filled.anyInside;
    filled = {};
  }

  template <typename Visit>
  static void forOctants(const openvdb::Coord& origin, int edge, const Visit& visit) {
    const int half = edge / 2;
    for (int i = 0; i < 8; ++i)
      visit(origin.offsetBy((i & 4) ? half : 0, (i & 2) ? half : 0, (i & 1) ? half : 0));
  }

  openvdb::FloatTree& tree_;
  const Phi& phi_;
  double voxelSize_;
  float background_;
  std::optional<openvdb::CoordBBox> limit_;
  std::vector<openvdb::Coord> surfaceBlocks_;
  bool anyInside_ = false;
};

}  // namespace levelset
