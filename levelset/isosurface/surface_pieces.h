#pragma once

// Internal header of levelset: public headers must not include it. Parts that the surfaces of
// volumes share: pieces are collected slab by slab and found by a tree of their boxes.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/geometry/search/overlap_tree.h"
#include "levelset/isosurface/isosurface.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// Limits of a range. The solid is where sign × (value − limit) > 0 for all of them.
struct ValueLimits {
  int count = 0;
  std::array<double, 2> limit{}, sign{};

  explicit ValueLimits(const ValueRange& range) {
    if (range.low) add(*range.low, 1);
    if (range.high) add(*range.high, -1);
  }

 private:
  void add(double limit_, double sign_) {
    limit[static_cast<std::size_t>(count)] = limit_;
    sign[static_cast<std::size_t>(count++)] = sign_;
  }
};

/// Pieces of the cells of a slab between two planes of grid points.
template <typename Piece>
struct SlabOf {
  std::vector<Piece> pieces;
  std::uint64_t cells = 0;  ///< cells that hold a part of the surface
};

/// Appends the pieces of all slabs in order, some slabs at a time.
/// @param collect  called with the number of a slab and its SlabOf<Piece>, on several threads
/// @param bytesPerPiece  memory of a piece with its part of the tree
/// @return number of cells that hold a part of the surface
/// @throws ResourceLimit, Cancelled
template <typename Piece, typename Collect>
std::uint64_t collectSlabs(int slabs, double bytesPerPiece, std::size_t maxMemory,
                           const Progress& progress, std::vector<Piece>& pieces,
                           const Collect& collect) {
  constexpr int kSlice = 16;
  std::uint64_t cells = 0;
  std::vector<SlabOf<Piece>> slice(kSlice);
  for (int from = 0; from < slabs; from += kSlice) {
    const int count = std::min(kSlice, slabs - from);
    tbb::parallel_for(0, count, [&](int n) {
      slice[static_cast<std::size_t>(n)] = {};
      collect(from + n, slice[static_cast<std::size_t>(n)]);
    });
    for (int n = 0; n < count; ++n) {
      const SlabOf<Piece>& slab = slice[static_cast<std::size_t>(n)];
      pieces.insert(pieces.end(), slab.pieces.begin(), slab.pieces.end());
      cells += slab.cells;
    }
    requireMemory(static_cast<double>(pieces.size()) * bytesPerPiece, maxMemory);
    report(progress, static_cast<double>(from + count) / slabs);
  }
  return cells;
}

/// Box of a part of a surface, with the number of the part.
struct BoxItem {
  using Number = float;
  static constexpr bool kHasExtent = true;
  ItemBox<float> bounds;
  std::uint32_t index;

  [[nodiscard]] const ItemBox<float>& box() const { return bounds; }
  [[nodiscard]] float centre(int axis) const { return bounds.centre(axis); }
  /// Several parts may have one box.
  [[nodiscard]] bool isSameAs(const BoxItem&) const { return false; }
};
using PieceTree = OverlapTree<BoxItem>;

/// Tree of the bounds of the first items of a surface. @param count  number of these items
/// @throws ResourceLimit when the surface has too many items
template <typename Surface>
PieceTree treeOf(const Surface& surface, std::size_t count) {
  if (surface.itemCount() >= std::size_t{1} << 29)
    throw ResourceLimit("the surface has more than 500 million pieces; crop the volume");
  std::vector<BoxItem> items(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    openvdb::Vec3d low, high;
    surface.bound(i, low, high);
    items[i] = {floatBox(toImath(low), toImath(high)), static_cast<std::uint32_t>(i)};
  });
  return PieceTree(std::move(items));
}

}  // namespace levelset
