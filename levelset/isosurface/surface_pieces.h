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
#include "levelset/geometry/box_tree.h"
#include "levelset/isosurface/isosurface.h"
#include "levelset/progress.h"

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

/// Tree of the bounds of the first items of a surface. @param count  number of these items
/// @throws ResourceLimit when the surface has too many items
template <typename Surface>
BoxTree treeOf(const Surface& surface, std::size_t count) {
  using openvdb::Vec3d;
  if (surface.itemCount() > std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit("the surface has more than 4 billion pieces; crop the volume");
  return BoxTree(
      count,
      [&](std::uint32_t item, Vec3d& low, Vec3d& high) {
        Vec3d from, to;
        surface.bound(item, from, to);
        low = openvdb::math::minComponent(low, from);
        high = openvdb::math::maxComponent(high, to);
      },
      [&](std::uint32_t item, int axis) {
        Vec3d from, to;
        surface.bound(item, from, to);
        return from[axis] + to[axis];
      });
}

}  // namespace levelset
