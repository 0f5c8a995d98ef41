#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/terrain/terrain_patch.h"

namespace render {

/// Triangles of a patch for all combinations of sides with a coarser neighbour, in one list. On
/// such a side, every second vertex is left out, so that both patches have the same edges there.
/// All vertices are samples. The triangles are those of HeightField, except beside left out
/// vertices: there, the cells on both sides become a triangle over the longer edge and its
/// neighbours.
class PatchBorderSets {
 public:
  struct Range {
    std::size_t first = 0, count = 0;  ///< numbers in indices(); three for each triangle
  };
  /// @param cells  cells along a side: a power of two from 2 to 128
  explicit PatchBorderSets(int cells);

  /// Sample (column, row) of the patch has the number row × (cells + 1) + column.
  [[nodiscard]] const std::vector<std::uint16_t>& indices() const { return indices_; }
  /// @param coarserSides  set of PatchSide
  [[nodiscard]] const Range& range(unsigned coarserSides) const { return ranges_[coarserSides]; }
  [[nodiscard]] std::span<const std::uint16_t> triangles(unsigned coarserSides) const {
    return std::span(indices_).subspan(range(coarserSides).first, range(coarserSides).count);
  }

 private:
  void add(int cells, unsigned coarserSides);

  std::vector<std::uint16_t> indices_;
  std::array<Range, 16> ranges_;
};

/// For each side of a patch, in the order of kPatchSides: the largest vertical distance between the
/// triangles for a coarser neighbour there and those of the patch. It is rounded up. It is infinite
/// where samples beside the border are missing, since other triangles might exist then. With
/// coarser neighbours on several sides, the distance is the largest of theirs.
/// @param heights  of PatchStore::readPatch()
[[nodiscard]] std::array<float, 4> patchBorderErrors(const PatchGrid& grid,
                                                     const TerrainPatch& patch,
                                                     std::span<const float> heights);

}  // namespace render
