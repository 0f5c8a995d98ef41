#pragma once

// Internal header of levelset: public headers must not include it.

#include <optional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Leaf blocks of a tree. Default: all.
struct BlockSelection {
  std::optional<openvdb::CoordBBox> box = {};  ///< only blocks that intersect it; empty: no limit
  const openvdb::MaskTree* leaves = nullptr;   ///< only blocks with a leaf there; null: no limit
  /// Grid points whose closest points are searched; null: no limit.
  const openvdb::MaskTree* gridPoints = nullptr;
  /// Cells, by their lowest corner, in which edges of the surface are searched; null: no limit.
  const openvdb::MaskTree* edgeCells = nullptr;

  /// @param block  index box of a leaf block
  [[nodiscard]] bool holdsBlock(const openvdb::CoordBBox& block) const {
    return (!box || box->hasOverlap(block)) && (!leaves || leaves->probeConstLeaf(block.min()));
  }
  [[nodiscard]] bool holds(const openvdb::Coord& gridPoint) const {
    return (!box || box->isInside(gridPoint)) && (!leaves || leaves->probeConstLeaf(gridPoint));
  }
};

}  // namespace levelset::eikonal
