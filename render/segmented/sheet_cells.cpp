#include "render/segmented/sheet_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "levelset/error.h"
#include "levelset/progress.h"
#include "render/segmented/sheet_surface.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;

constexpr double kCellMargin = 1e-6;  // voxels

/// Calls add(cell) for the cells that a triangle may touch.
template <typename Add>
void forEachCell(const std::array<V3d, 3>& corners, const Add& add) {
  V3i low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
    low[axis] = static_cast<int>(std::floor(least - kCellMargin));
    high[axis] = static_cast<int>(std::floor(most + kCellMargin));
  }
  V3i cell;
  for (cell.x = low.x; cell.x <= high.x; ++cell.x)
    for (cell.y = low.y; cell.y <= high.y; ++cell.y)
      for (cell.z = low.z; cell.z <= high.z; ++cell.z) add(cell);
}

}  // namespace

std::vector<SheetEntry> addSheetTriangles(InterfaceTables& tables, std::size_t maxBytes) {
  const SheetSurface& sheets = *tables.sheets;
  // A triangle is listed in three cells on average.
  constexpr double kBytesPerTriangle = 3 * (sizeof(SheetEntry) + 4) + 16 + 36 + 12;
  levelset::requireMemory(kBytesPerTriangle * static_cast<double>(sheets.triangles.size()),
                          maxBytes);
  std::vector<V3d> places;
  places.reserve(sheets.positions.size());
  for (const V3d& world : sheets.positions) {
    V3d place;
    tables.worldToIndex.multVecMatrix(world, place);
    places.push_back(place);
    tables.sheetVertices.insert(tables.sheetVertices.end(), {place.x, place.y, place.z});
  }
  std::vector<SheetEntry> entries;
  for (std::uint32_t t = 0; t < sheets.triangles.size(); ++t) {
    const SheetSurface::Triangle& triangle = sheets.triangles[t];
    for (const std::uint32_t v : triangle.corners)
      tables.sheetTriangles.push_back(static_cast<std::int32_t>(v));
    tables.sheetTriangles.push_back(triangle.label);
    for (const Imath::V3f& world : triangle.normals) {
      V3d normal;
      tables.worldToIndex.multDirMatrix(V3d(world), normal);
      normal.normalize();
      for (int axis = 0; axis < 3; ++axis)
        tables.sheetNormals.push_back(static_cast<float>(normal[axis]));
    }
    const auto& c = triangle.corners;
    forEachCell({places[c[0]], places[c[1]], places[c[2]]}, [&](const V3i& cell) {
      entries.push_back(
          {V3i(cell.x >> 3, cell.y >> 3, cell.z >> 3),
           static_cast<std::uint16_t>((cell.x & 7) << 6 | (cell.y & 7) << 3 | (cell.z & 7)), t});
    });
  }
  if (entries.size() > std::size_t{std::numeric_limits<std::int32_t>::max()} / 2)
    throw levelset::ResourceLimit("the sheets have too many triangles; use larger voxels");
  std::sort(entries.begin(), entries.end(), [](const SheetEntry& a, const SheetEntry& b) {
    return std::tie(a.block.x, a.block.y, a.block.z, a.voxel, a.triangle) <
           std::tie(b.block.x, b.block.y, b.block.z, b.voxel, b.triangle);
  });
  return entries;
}

void addSheetBlock(InterfaceTables& tables, const SheetEntry* first, const SheetEntry* last,
                   std::uint32_t* mask) {
  std::array<std::uint32_t, 32> words{};
  const SheetEntry* entry = first;
  for (std::uint32_t word = 0; word < 16; ++word) {
    words[16 + word] = static_cast<std::uint32_t>(tables.sheetLists.size());
    while (entry != last && entry->voxel >> 5 == word) {
      const std::uint16_t voxel = entry->voxel;
      words[word] |= 1u << (voxel & 31);
      tables.sheetLists.push_back(static_cast<std::int32_t>(tables.sheetEntries.size()));
      for (; entry != last && entry->voxel == voxel; ++entry)
        tables.sheetEntries.push_back(static_cast<std::int32_t>(entry->triangle));
    }
    mask[word] |= words[word];
  }
  tables.sheetCells.insert(tables.sheetCells.end(), words.begin(), words.end());
}

void finishSheetLists(InterfaceTables& tables) {
  tables.sheetLists.push_back(static_cast<std::int32_t>(tables.sheetEntries.size()));
  const auto offset = static_cast<std::int32_t>(tables.sheetLists.size());
  for (std::int32_t& first : tables.sheetLists) first += offset;
  tables.sheetLists.insert(tables.sheetLists.end(), tables.sheetEntries.begin(),
                           tables.sheetEntries.end());
  tables.sheetEntries = {};
}

}  // namespace render
