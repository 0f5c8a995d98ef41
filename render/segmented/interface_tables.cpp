#include "render/segmented/interface_tables.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/vdb.h"
#include "render/segmented/sheet_cells.h"
#include "render/segmented/sheet_surface.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;
using levelset::RegionLabel;
using levelset::SegmentedBlock;
using levelset::SegmentedData;
using levelset::SegmentedExtra;
using levelset::SegmentedReader;
using openvdb::Coord;

// The kernel reads these as words.
static_assert(sizeof(SegmentedBlock) == 32 && sizeof(SegmentedExtra) == 8);

constexpr int kGroupShift = 6;  // of grid points to groups of 8³ blocks
constexpr std::size_t kGroupBlocks = 512;
using Mask = std::array<std::uint32_t, 16>;

template <typename Number>
FieldArray arrayOf(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

/// Block coordinates of the blocks of a field, and of those before them, whose last cells have
/// corners in them. Ascending, each once.
std::vector<Coord> blocksAround(const SegmentedData& data) {
  std::vector<Coord> all;
  all.reserve(8 * data.blockCount());
  for (std::size_t b = 0; b < data.blockCount(); ++b) {
    const Coord coord = SegmentedData::blockCoord(data.blocks[b].origin);
    for (int n = 0; n < 8; ++n) all.push_back(coord - Coord(n >> 2, n >> 1 & 1, n & 1));
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

/// Adds the blocks of sheets, which are in the order of x, y and z.
void addBlocksOf(const std::vector<SheetEntry>& sheets, const V3i& origin,
                 std::vector<Coord>& blocks) {
  for (std::size_t n = 0; n < sheets.size(); ++n)
    if (n == 0 || sheets[n].block != sheets[n - 1].block)
      blocks.emplace_back((origin.x >> 3) + sheets[n].block.x, (origin.y >> 3) + sheets[n].block.y,
                          (origin.z >> 3) + sheets[n].block.z);
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
}

/// Cells of a block whose corners have several labels.
Mask mixedMask(SegmentedReader& reader, const Coord& block) {
  constexpr int kPoints = 9;
  std::array<RegionLabel, kPoints * kPoints * kPoints> labels;
  const Coord low(block[0] << 3, block[1] << 3, block[2] << 3);
  std::size_t n = 0;
  bool isMixed = false;
  for (int x = 0; x < kPoints; ++x)
    for (int y = 0; y < kPoints; ++y)
      for (int z = 0; z < kPoints; ++z) {
        labels[n] = reader.label(low + Coord(x, y, z));
        isMixed = isMixed || labels[n] != labels[0];
        ++n;
      }
  Mask mask{};
  if (!isMixed) return mask;
  const auto at = [&](int x, int y, int z) {
    return labels[static_cast<std::size_t>((x * kPoints + y) * kPoints + z)];
  };
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const RegionLabel first = at(x, y, z);
        bool differs = false;
        for (int c = 1; c < 8; ++c)
          differs = differs || at(x + (c >> 2), y + (c >> 1 & 1), z + (c & 1)) != first;
        const auto cell = static_cast<std::size_t>((x << 6) | (y << 3) | z);
        if (differs) mask[cell >> 5] |= 1u << (cell & 31);
      }
  return mask;
}

/// Position in a box of groups, by x, y and z.
std::size_t numberOf(const V3i& at, const V3i& size) {
  return (static_cast<std::size_t>(at.x) * static_cast<std::size_t>(size.y) +
          static_cast<std::size_t>(at.y)) *
             static_cast<std::size_t>(size.z) +
         static_cast<std::size_t>(at.z);
}

/// Places the tables around the blocks of a field, with a margin of a block.
void placeAround(InterfaceTables& tables, const SegmentedData& data) {
  openvdb::CoordBBox box;
  for (std::size_t b = 0; b < data.blockCount(); ++b)
    box.expand(SegmentedData::blockCoord(data.blocks[b].origin));
  box.expand(1);
  for (int axis = 0; axis < 3; ++axis) {
    const int first = box.min()[axis] >> 3, last = box.max()[axis] >> 3;  // groups
    tables.origin[axis] = first * (1 << kGroupShift);
    tables.groups[axis] = last - first + 1;
    tables.points[axis] = (box.max()[axis] + 1) * 8 - tables.origin[axis];
  }
}

}  // namespace

InterfaceTables makeInterfaceTables(const levelset::SegmentedField& field,
                                    const std::vector<RegionLabel>& hidden, std::size_t maxBytes) {
  const SegmentedData& data = *field.shared();
  InterfaceTables tables;
  tables.field = field.shared();
  tables.blocks = arrayOf(data.blocks);
  tables.words = arrayOf(data.words);
  tables.distances = arrayOf(data.distances);
  tables.extras = arrayOf(data.extras);
  tables.palettes = arrayOf(data.palettes);
  tables.background = static_cast<double>(data.background);
  tables.shown.assign((std::size_t{std::numeric_limits<RegionLabel>::max()} + 1) / 32, ~0u);
  const auto hide = [&](RegionLabel label) { tables.shown[label >> 5] &= ~(1u << (label & 31)); };
  hide(levelset::kVoid);
  for (const RegionLabel label : hidden) hide(label);
  placeAround(tables, data);
  tables.worldToIndex =
      field.indexToWorld().inverse() * Imath::M44d().setTranslation(-V3d(tables.origin));

  std::vector<Coord> around = blocksAround(data);
  std::vector<SheetEntry> sheets;
  tables.sheets = sheetSurface(field, maxBytes);
  if (tables.sheets) {
    sheets = addSheetTriangles(tables, maxBytes);
    addBlocksOf(sheets, tables.origin, around);
  }
  const Coord lowBlock(tables.origin.x >> 3, tables.origin.y >> 3, tables.origin.z >> 3);
  const double groupCount =
      static_cast<double>(tables.groups.x) * tables.groups.y * tables.groups.z;
  levelset::requireMemory(4 * groupCount + static_cast<double>(around.size()) * (sizeof(Mask) + 24),
                          maxBytes);
  std::vector<Mask> masks(around.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, around.size(), 32),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      SegmentedReader reader(data);
                      for (std::size_t n = range.begin(); n < range.end(); ++n)
                        masks[n] = mixedMask(reader, around[n]);
                    });

  const auto groupOf = [&](const Coord& block) {
    return numberOf(V3i((block[0] >> 3) - (tables.origin.x >> kGroupShift),
                        (block[1] >> 3) - (tables.origin.y >> kGroupShift),
                        (block[2] >> 3) - (tables.origin.z >> kGroupShift)),
                    tables.groups);
  };
  std::vector<char> isMixedGroup(static_cast<std::size_t>(groupCount), 0);
  for (const Coord& block : around) isMixedGroup[groupOf(block)] = 1;
  const double mixedGroups =
      static_cast<double>(std::count(isMixedGroup.begin(), isMixedGroup.end(), 1));
  levelset::requireMemory(4 * groupCount + mixedGroups * 8 * static_cast<double>(kGroupBlocks),
                          maxBytes);
  SegmentedReader reader(data);
  tables.groupEntries.reserve(isMixedGroup.size());
  std::size_t number = 0;
  for (int x = 0; x < tables.groups.x; ++x)
    for (int y = 0; y < tables.groups.y; ++y)
      for (int z = 0; z < tables.groups.z; ++z) {
        const Coord low(tables.origin.x + (x << kGroupShift), tables.origin.y + (y << kGroupShift),
                        tables.origin.z + (z << kGroupShift));
        if (!isMixedGroup[number++]) {
          tables.groupEntries.push_back(SegmentedData::tile(reader.label(low)));
          continue;
        }
        tables.groupEntries.push_back(static_cast<std::int32_t>(tables.table.size()));
        for (std::size_t b = 0; b < kGroupBlocks; ++b) {
          const Coord local = SegmentedData::localOf(static_cast<std::uint32_t>(b));
          tables.table.push_back(
              reader.blockOf(low + Coord(local[0] << 3, local[1] << 3, local[2] << 3)));
          tables.table.push_back(-1);
        }
      }
  std::size_t sheet = 0;
  for (std::size_t n = 0; n < around.size(); ++n) {
    std::size_t cells = 0;
    for (const std::uint32_t word : masks[n]) cells += SegmentedData::countBits(word);
    const Coord& block = around[n];
    const std::size_t firstSheet = sheet;
    const Coord local = block - lowBlock;
    while (sheet < sheets.size() && sheets[sheet].block == V3i(local[0], local[1], local[2]))
      ++sheet;
    if (cells == 0 && sheet == firstSheet) continue;
    tables.mixedCells += cells;
    if (tables.sheets)
      addSheetBlock(tables, sheets.data() + firstSheet, sheets.data() + sheet, masks[n].data());
    const std::size_t place =
        SegmentedData::offsetOf(Coord(block[0] & 7, block[1] & 7, block[2] & 7));
    const auto first = static_cast<std::size_t>(tables.groupEntries[groupOf(block)]);
    tables.table[first + 2 * place + 1] = static_cast<std::int32_t>(tables.masks.size() / 16);
    tables.masks.insert(tables.masks.end(), masks[n].begin(), masks[n].end());
  }
  if (tables.sheets) finishSheetLists(tables);
  return tables;
}

std::vector<double> interfaceExtents(const InterfaceTables& tables,
                                     const std::vector<V3d>& directions) {
  const SegmentedData& data = *tables.field;
  std::vector<double> none(directions.size(), -std::numeric_limits<double>::infinity());
  if (tables.sheets)
    for (std::size_t v = 0; v < tables.sheets->meshVertices; ++v)
      for (std::size_t d = 0; d < directions.size(); ++d)
        none[d] = std::max(none[d], tables.sheets->positions[v].dot(directions[d]));
  const auto addBlock = [&](SegmentedReader& reader, const SegmentedBlock& block,
                            std::vector<double>& all) {
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
      if (data.distanceIndex(block, n) < 0) continue;
      const Coord at = block.origin + SegmentedData::localOf(n);
      const SegmentedReader::Nearest a = reader.nearest(at);
      for (int axis = 0; axis < 3; ++axis) {
        Coord next = at;
        next[axis] += 1;
        const SegmentedReader::Nearest b = reader.nearest(next);
        if (a.label == b.label || (!tables.isShown(a.label) && !tables.isShown(b.label))) continue;
        const auto u = static_cast<double>(reader.distanceTo(at, a, b.label)),
                   v = static_cast<double>(reader.distanceTo(next, b, a.label));
        openvdb::Vec3d p = at.asVec3d();
        p[axis] += u + v > 0 ? u / (u + v) : 0.5;
        const V3d world = levelset::toImath(data.transform->indexToWorld(p));
        for (std::size_t d = 0; d < directions.size(); ++d)
          all[d] = std::max(all[d], world.dot(directions[d]));
      }
    }
  };
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, data.blockCount(), 64), none,
      [&](const tbb::blocked_range<std::size_t>& range, std::vector<double> all) {
        SegmentedReader reader(data);
        for (std::size_t b = range.begin(); b < range.end(); ++b)
          addBlock(reader, data.blocks[b], all);
        return all;
      },
      [](std::vector<double> a, const std::vector<double>& b) {
        for (std::size_t d = 0; d < a.size(); ++d) a[d] = std::max(a[d], b[d]);
        return a;
      });
}

}  // namespace render
