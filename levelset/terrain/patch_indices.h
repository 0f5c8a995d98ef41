#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Triangles of a square patch of a terrain at any level of detail, with borders that fit finer
/// neighbours [Brodersen07, section 4.4].
namespace levelset {

/// Number of levels of a patch: the coarsest has 2 cells a side.
/// @param cells  cells along a side at level 0: a power of two from 2 to 128
/// @throws UsageError for another number of cells
[[nodiscard]] int patchLevelCount(int cells);

/// For each side of a patch, by how many levels its neighbour there is finer; 0: not finer.
struct FinerNeighbours {
  int south = 0, east = 0, north = 0, west = 0;
};

using PatchTriangle = std::array<std::uint16_t, 3>;

/// Makes the triangles of a patch. Sample (column, row) has the number row × (cells + 1) + column.
/// A patch of level l uses every 2^l-th sample, in the triangles of HeightField. On a side with a
/// finer neighbour, it also uses the samples of that neighbour, so the common border has the same
/// edges. The triangle at such a border is divided from its opposite corner. Its points move by at
/// most the error of the level, so that the border cells have at most twice that error.
/// @param finer  each from 0 to level
/// @throws UsageError for a level or a neighbour out of range
[[nodiscard]] std::vector<PatchTriangle> patchTriangles(int cells, int level,
                                                        const FinerNeighbours& finer = {});

/// Memory of a patch in the layout of the thesis, bytes: 16-bit heights, a 16-bit error for each
/// level but the finest, and a header of 20 bytes (two 32-bit addresses beside the heights', level,
/// bounds). @throws as patchLevelCount
[[nodiscard]] std::size_t publishedPatchBytes(int cells);

}  // namespace levelset
