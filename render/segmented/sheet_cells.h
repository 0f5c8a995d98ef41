#pragma once

// Private to the ray casting of segmented fields: sheets by cell, for the kernel.

#include "render/segmented/interface_tables.h"

namespace render {

/// A triangle of a sheet in a cell.
struct SheetEntry {
  Imath::V3i block;  ///< block of 8³ cells, kernel's coordinates
  std::uint16_t voxel;
  std::uint32_t triangle;
};

/// Puts the triangles and vertices of `tables.sheets` into the tables, and lists them by cell: in
/// every cell that they touch, or that is less than 1e-6 voxels away. So a ray finds them in the
/// cell that it visits, whatever its rounding.
/// @pre tables.sheets is not null; worldToIndex is set
/// @return by block, voxel and triangle
/// @throws levelset::ResourceLimit when the tables exceed `maxBytes`
[[nodiscard]] std::vector<SheetEntry> addSheetTriangles(InterfaceTables& tables,
                                                        std::size_t maxBytes);

/// Appends the lists of the cells of a block to the tables.
/// @param first, last  entries of the block; none for a block without sheets
/// @param mask  16 words, in which the cells are set
void addSheetBlock(InterfaceTables& tables, const SheetEntry* first, const SheetEntry* last,
                   std::uint32_t* mask);

/// Puts the lists behind their places. Call it once, after the last block.
void finishSheetLists(InterfaceTables& tables);

}  // namespace render
