#pragma once

// Private to the ray casting of segmented fields: data of an InterfaceCaster for the kernel.

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/segmented/segmented_field.h"

namespace render {

struct SheetSurface;

/// Arrays of a field that the kernel reads as they are, without a copy. See
/// levelset::SegmentedData.
struct FieldArray {
  const char* data = nullptr;
  std::size_t bytes = 0;
};

struct InterfaceTables {
  std::shared_ptr<const levelset::SegmentedData> field;  ///< owner of the arrays
  FieldArray blocks, words, distances, extras, palettes;
  double background = 0;  ///< world units
  Imath::V3i origin{0};   ///< grid point with the coordinates 0 in the kernel
  Imath::V3i points{0};   ///< grid points along each axis
  Imath::V3i groups{0};   ///< groups of 8³ blocks along each axis
  /// For each group the first of its entries in `table`, or −1 − label of a group of one label.
  std::vector<std::int32_t> groupEntries = {};
  /// Two entries for each block of a group: its number in the field, or −1 − label; and the number
  /// of its mask, or −1 if all its cells have one label.
  std::vector<std::int32_t> table = {};
  std::vector<std::uint32_t> masks = {};  ///< 16 words each: cells with corners of several labels
  std::vector<std::uint32_t> shown = {};  ///< bits by label: 1 for regions that are drawn
  Imath::M44d worldToIndex = {};          ///< to the kernel's coordinates
  std::size_t mixedCells = 0;             ///< cells with corners of several labels
  /// Sheets; null for a field without them. Then the arrays below are empty.
  std::shared_ptr<const SheetSurface> sheets = nullptr;
  /// 32 words for each mask: cells with sheets, which are in the mask too; and for each of these 16
  /// words the number of the first list of its cells.
  std::vector<std::uint32_t> sheetCells = {};
  /// For each list the place of its first entry in this array, and one more for the end; then the
  /// entries, which are numbers of triangles.
  std::vector<std::int32_t> sheetLists = {};
  std::vector<std::int32_t> sheetEntries = {};    ///< used while the lists are made
  std::vector<std::int32_t> sheetTriangles = {};  ///< 4 each: vertices and label
  std::vector<double> sheetVertices = {};         ///< 3 each: kernel's coordinates
  std::vector<float> sheetNormals = {};           ///< 9 each: at the corners, kernel's coordinates

  [[nodiscard]] bool isShown(int label) const {
    return (shown[static_cast<std::size_t>(label >> 5)] >> (label & 31) & 1u) != 0;
  }
  /// Memory beside that of the field.
  [[nodiscard]] std::size_t bytes() const {
    return (groupEntries.size() + table.size() + masks.size() + shown.size() + sheetCells.size() +
            sheetLists.size() + sheetTriangles.size() + 2 * sheetVertices.size() +
            sheetNormals.size()) *
           4;
  }
};

/// Makes the tables of a field.
/// @param hidden  labels of regions that are not drawn, beside the void
/// @pre the field is not empty
/// @throws levelset::ResourceLimit when the tables exceed `maxBytes`
[[nodiscard]] InterfaceTables makeInterfaceTables(const levelset::SegmentedField& field,
                                                  const std::vector<levelset::RegionLabel>& hidden,
                                                  std::size_t maxBytes);

/// Extents of the drawn interfaces and the sheets: for each direction the largest p·direction over
/// the crossings p of edges of the grid and the vertices p of sheets, world units; −∞ without any.
[[nodiscard]] std::vector<double> interfaceExtents(const InterfaceTables& tables,
                                                   const std::vector<Imath::V3d>& directions);

/// A ray in the kernel's coordinates, clipped to the grid points of the tables.
struct InterfaceStart {
  Imath::V3d from{0}, step{0};  ///< position at the distance 0; its derivative by the distance
  double t = 0, end = 0;        ///< distances, world units
  double begin = 0;             ///< distance beyond which sheets are seen
  Imath::V3i cell{0};           ///< at t
  int label = -1;               ///< region at t; −1: not known
  bool isInside = false;        ///< false: the ray misses the grid
};

}  // namespace render
