#include "levelset/terrain/tiles/read_ground.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

/// Samples of a level along an axis, from `first` to `last`.
struct AxisRange {
  int first = 0, last = 0;
  [[nodiscard]] int count() const { return last - first + 1; }
};

/// Part of a ground: samples of a level.
struct GroundPart {
  AxisRange columns, rows;
};

/// Samples of a level that are a whole number of its spacings from the first one.
int wholeSamples(int samples, int level) {
  return ((samples - 1) >> level) + 1;
}

GroundPart partOf(const GroundLayout& layout, const ReadGroundOptions& options) {
  const int levels = static_cast<int>(layout.pyramid.levels.size());
  if (options.level < 0 || options.level >= levels)
    throw UsageError(
        fmt::format("the terrain has no level {}; give 0 to {}", options.level, levels - 1));
  const int columns = wholeSamples(layout.columns, options.level),
            rows = wholeSamples(layout.rows, options.level);
  if (!options.box) return {{0, columns - 1}, {0, rows - 1}};
  const Imath::Box3d& box = *options.box;
  const Imath::V2d spacing = layout.spacing * static_cast<double>(std::int64_t{1} << options.level);
  const auto [firstColumn, lastColumn] =
      samplesBetween(layout.origin.x, spacing.x, columns, box.min.x, box.max.x);
  const auto [firstRow, lastRow] =
      samplesBetween(layout.origin.y, spacing.y, rows, box.min.y, box.max.y);
  if (firstColumn > lastColumn || firstRow > lastRow) {
    const Imath::V2d end =
        layout.origin + layout.spacing * Imath::V2d(layout.columns - 1, layout.rows - 1);
    throw InvalidInput(fmt::format(
        "the box from {:.9g},{:.9g} to {:.9g},{:.9g} has no sample of level {} of the terrain, "
        "which is from {:.9g},{:.9g} to {:.9g},{:.9g}; move or enlarge the box",
        box.min.x, box.min.y, box.max.x, box.max.y, options.level, layout.origin.x, layout.origin.y,
        end.x, end.y));
  }
  return {{firstColumn, lastColumn}, {firstRow, lastRow}};
}

HeightField partGrid(const GroundLayout& layout, const GroundPart& part, int level) {
  const Imath::V2d spacing = layout.spacing * static_cast<double>(std::int64_t{1} << level);
  return {.columns = part.columns.count(),
          .rows = part.rows.count(),
          .origin = layout.origin + spacing * Imath::V2d(part.columns.first, part.rows.first),
          .spacing = spacing,
          .coordinateSystem = layout.coordinateSystem,
          .isGeographic = layout.isGeographic};
}

/// Copies what a patch has of the part. @param heights  of the patch
void copyPatchInto(HeightField& field, const GroundPart& part, int column, int row, int cells,
                   const std::vector<float>& heights) {
  const int left = column * cells, south = row * cells;
  const int firstColumn = std::max(left, part.columns.first),
            lastColumn = std::min(left + cells, part.columns.last);
  const int firstRow = std::max(south, part.rows.first),
            lastRow = std::min(south + cells, part.rows.last);
  for (int j = firstRow; j <= lastRow; ++j)
    std::copy_n(
        heights.begin() + (j - south) * (cells + 1) + (firstColumn - left),
        std::max(0, lastColumn - firstColumn + 1),
        field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(
                                    firstColumn - part.columns.first, j - part.rows.first)));
}

}  // namespace

void requireGroundMemory(const HeightField& grid, std::size_t maxMemory) {
  const double bytes = static_cast<double>(grid.columns) * grid.rows * sizeof(float);
  const std::size_t left = memoryLeft(memoryLimit(maxMemory));
  if (bytes <= static_cast<double>(left)) return;
  throw ResourceLimit(fmt::format(
      "this part of the terrain has {}x{} samples, {:.3g} GB, but {:.3g} GB are left; give --box, "
      "or a coarser --level, or raise --max-memory",
      grid.columns, grid.rows, bytes * 1e-9, static_cast<double>(left) * 1e-9));
}

HeightField groundGrid(const GroundLayout& layout, const ReadGroundOptions& options) {
  return partGrid(layout, partOf(layout, options), options.level);
}

HeightField readGround(const PatchStore& store, const ReadGroundOptions& options) {
  const GroundLayout& layout = store.layout();
  const GroundPart part = partOf(layout, options);
  HeightField field = partGrid(layout, part, options.level);
  requireGroundMemory(field, options.maxMemory);
  field.heights.resize(static_cast<std::size_t>(field.columns) *
                       static_cast<std::size_t>(field.rows));
  const int cells = layout.pyramid.cells;
  const auto patchesOf = [&](const AxisRange& range, int patches) {
    return AxisRange{std::min(range.first / cells, patches - 1),
                     std::min(range.last / cells, patches - 1)};
  };
  const PyramidLevel& level = layout.pyramid.levels[static_cast<std::size_t>(options.level)];
  const AxisRange across = patchesOf(part.columns, level.columns),
                  along = patchesOf(part.rows, level.rows);
  const auto side = static_cast<std::size_t>(cells) + 1;
  ProgressGate gate(options.progress, static_cast<std::size_t>(along.count()));
  for (int row = along.first; row <= along.last; ++row) {
    // Patches side by side share a border. Only the eastern one writes it, so that no thread writes
    // where another one does.
    tbb::parallel_for(across.first, across.last + 1, [&](int column) {
      std::vector<float> heights(side * side);
      store.readPatch(options.level, column, row, heights);
      GroundPart own = part;
      if (column < across.last) own.columns.last = column * cells + cells - 1;
      copyPatchInto(field, own, column, row, cells, heights);
    });
    gate.advance(1);
  }
  report(options.progress, 1);
  return field;
}

}  // namespace levelset
