#include "levelset/terrain/tiles/write_tiled_ground.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/terrain/pyramid_parts.h"
#include "levelset/terrain/tiles/level_strip.h"
#include "levelset/terrain/tiles/patch_codec.h"
#include "levelset/terrain/tiles/pyramid_errors.h"
#include "levelset/terrain/tiles/tile_file_target.h"
#include "levelset/terrain/tiles/tile_format.h"

namespace levelset {
namespace {

using terrain::LevelStrip;
using terrain::PyramidErrors;
using terrain::StoredPatch;

/// Share of the time until all heights are written. Then errors are measured.
constexpr double kHeightsShare = 0.7;

/// Writes a file: first the heights of all levels, as the rows arrive, then the errors, from the
/// patches of level 0 that are read again.
class TileWriter {
 public:
  TileWriter(const std::filesystem::path& path, HeightRows& rows, const WriteTilesOptions& options);
  void write();

 private:
  /// Compressed patch; without bytes: all its samples are missing.
  struct Coded {
    std::string bytes;
    std::uint64_t checksum = 0;
    float lowest = kMissingHeight, highest = kMissingHeight;
  };

  void storeRow(int row, std::span<float> heights) const;
  void takeRow(int row, std::span<const float> heights);
  void setCorners(int row, std::span<const float> heights);
  void writeStrip(std::size_t level);
  [[nodiscard]] static Coded coded(const LevelStrip& strip, int column, double step);
  void takeRanges();
  void measureErrors();
  void sortIndex();
  [[nodiscard]] HeightField readAgain(const StoredPatch& patch) const;

  HeightRows& rows_;
  const WriteTilesOptions& options_;
  terrain::TileHeader header_;
  GroundLayout& layout_;
  HeightPyramid& pyramid_;
  PyramidErrors errors_;
  std::vector<LevelStrip> strips_;
  terrain::TileIndex index_;
  terrain::TileFileTarget file_;
};

terrain::TileHeader tileHeaderOf(const HeightField& grid, const WriteTilesOptions& options) {
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    throw UsageError(fmt::format("the tolerance of the heights is {}; give 0 or a positive number",
                                 options.tolerance));
  requireGrid(grid);
  terrain::requirePyramid(grid.columns, grid.rows, options.cells);
  terrain::requireTileNumbers(grid.columns, grid.rows, options.cells);
  const double patches = terrain::patchCount(grid.columns, grid.rows, options.cells);
  // The strips of all levels, and as much again for their compressed patches. A patch has about 30
  // bytes in the text of the index, and as much when it is compressed.
  constexpr double kIndexBytes = 2 * 30;
  const double strips = 4.0 * (options.cells + 1) * grid.columns * sizeof(float);
  requireMemory(patches * (sizeof(PyramidPatch) + sizeof(StoredPatch) + kIndexBytes) + strips +
                    PyramidErrors::memoryUse(grid.columns, grid.rows, options.cells),
                memoryLeft(memoryLimit(options.maxMemory)));
  terrain::TileHeader header;
  header.tolerance = options.tolerance;
  header.step = terrain::heightStep(options.tolerance);
  header.layout = {.columns = grid.columns,
                   .rows = grid.rows,
                   .origin = grid.origin,
                   .spacing = grid.spacing,
                   .coordinateSystem = grid.coordinateSystem.substr(0, terrain::kMostSystemName),
                   .isGeographic = grid.isGeographic,
                   .pyramid = terrain::emptyPyramid(grid.columns, grid.rows, options.cells)};
  return header;
}

TileWriter::TileWriter(const std::filesystem::path& path, HeightRows& rows,
                       const WriteTilesOptions& options)
    : rows_(rows),
      options_(options),
      header_(tileHeaderOf(rows.grid(), options)),
      layout_(header_.layout),
      pyramid_(layout_.pyramid),
      errors_(layout_.columns, layout_.rows, pyramid_),
      index_(pyramid_.levels.size()),
      file_(path) {
  for (std::size_t level = 0; level < pyramid_.levels.size(); ++level)
    strips_.emplace_back(static_cast<int>(level), layout_.columns, layout_.rows, options.cells);
  // Growing lists would take twice the memory. Pages that are not used take none.
  for (std::size_t level = 0; level < pyramid_.levels.size(); ++level)
    index_[level].reserve(pyramid_.levels[level].patches.size());
}

TileWriter::Coded TileWriter::coded(const LevelStrip& strip, int column, double step) {
  std::vector<float> heights;
  strip.copyPatch(column, heights);
  Coded patch;
  for (float height : heights) {
    if (std::isnan(height)) continue;
    height += 0.F;  // of the two zeros always the positive one, as in heightPyramid()
    patch.lowest = std::fmin(patch.lowest, height);
    patch.highest = std::fmax(patch.highest, height);
  }
  if (std::isnan(patch.lowest)) return patch;
  patch.bytes = terrain::encodeHeights(heights, strip.patchWidth(column), step);
  patch.checksum = terrain::checksumOf(patch.bytes);
  return patch;
}

/// Writes the row of patches that is complete.
void TileWriter::writeStrip(std::size_t level) {
  LevelStrip& strip = strips_[level];
  PyramidLevel& of = pyramid_.levels[level];
  std::vector<Coded> patches(static_cast<std::size_t>(of.columns));
  if (strip.hasData())
    tbb::parallel_for(std::size_t{0}, patches.size(), [&](std::size_t column) {
      patches[column] = coded(strip, static_cast<int>(column), header_.step);
    });
  const std::size_t first = static_cast<std::size_t>(strip.patchRow()) * patches.size();
  for (std::size_t column = 0; column < patches.size(); ++column) {
    const Coded& patch = patches[column];
    // Ranges are those of all samples, which are in level 0 only.
    if (level == 0) {
      of.patches[first + column].lowest = patch.lowest;
      of.patches[first + column].highest = patch.highest;
    }
    if (patch.bytes.empty()) continue;
    index_[level].push_back({.number = static_cast<std::uint32_t>(first + column),
                             .bytes = static_cast<std::uint32_t>(patch.bytes.size()),
                             .offset = file_.size(),
                             .checksum = patch.checksum});
    file_.append(patch.bytes);
  }
  strip.advance(rows_.isNorthFirst());
}

void TileWriter::setCorners(int row, std::span<const float> heights) {
  if (heights.empty() || (row % options_.cells != 0 && row != layout_.rows - 1)) return;
  const PyramidLevel& finest = pyramid_.levels[0];
  const int line = row == layout_.rows - 1 ? finest.rows : row / options_.cells;
  for (std::int64_t column = 0; column <= finest.columns; ++column)
    errors_.setCorner(static_cast<int>(column), line,
                      heights[static_cast<std::size_t>(
                          std::min<std::int64_t>(column * options_.cells, layout_.columns - 1))]);
}

/// Replaces heights by those that are stored.
void TileWriter::storeRow(int row, std::span<float> heights) const {
  for (float& height : heights) {
    if (std::isinf(height))
      throw InvalidInput(
          fmt::format("a height in row {} is infinite; mark missing heights as NaN", row));
    height = terrain::storedHeight(height, header_.step, options_.tolerance);
  }
}

/// @param heights  empty: all samples are missing
void TileWriter::takeRow(int row, std::span<const float> heights) {
  setCorners(row, heights);
  for (std::size_t level = 0; level < strips_.size(); ++level)
    if (strips_[level].has(row) && strips_[level].take(row, heights, rows_.isNorthFirst()))
      writeStrip(level);
}

/// Gives each patch the range of the patches below it.
void TileWriter::takeRanges() {
  for (std::size_t n = 1; n < pyramid_.levels.size(); ++n) {
    PyramidLevel& level = pyramid_.levels[n];
    const PyramidLevel& finer = pyramid_.levels[n - 1];
    for (PyramidPatch& patch : level.patches) patch.lowest = patch.highest = kMissingHeight;
    for (int row = 0; row < finer.rows; ++row)
      for (int column = 0; column < finer.columns; ++column) {
        const PyramidPatch& child = finer.at(column, row);
        PyramidPatch& patch = level.patches[static_cast<std::size_t>(row / 2) *
                                                static_cast<std::size_t>(level.columns) +
                                            static_cast<std::size_t>(column / 2)];
        patch.lowest = std::fmin(patch.lowest, child.lowest);
        patch.highest = std::fmax(patch.highest, child.highest);
      }
  }
}

/// Orders the patches of each level by number, and adds those whose samples are missing at their
/// level but not at a finer one. Level 0 has none of these.
void TileWriter::sortIndex() {
  for (std::size_t level = 0; level < index_.size(); ++level) {
    std::vector<StoredPatch>& stored = index_[level];
    std::sort(stored.begin(), stored.end(),
              [](const StoredPatch& a, const StoredPatch& b) { return a.number < b.number; });
    if (level == 0) continue;
    std::vector<StoredPatch> all;
    all.reserve(pyramid_.levels[level].patches.size());
    std::size_t next = 0;
    const std::vector<PyramidPatch>& patches = pyramid_.levels[level].patches;
    for (std::size_t number = 0; number < patches.size(); ++number) {
      if (next < stored.size() && stored[next].number == number)
        all.push_back(stored[next++]);
      else if (!std::isnan(patches[number].lowest))
        all.push_back({.number = static_cast<std::uint32_t>(number),
                       .bytes = 0,
                       .offset = all.empty() ? terrain::kTileHeaderBytes
                                             : all.back().offset + all.back().bytes});
    }
    stored = std::move(all);
  }
}

HeightField TileWriter::readAgain(const StoredPatch& patch) const {
  const auto width = static_cast<std::uint32_t>(pyramid_.levels[0].columns);
  const int column = static_cast<int>(patch.number % width),
            row = static_cast<int>(patch.number / width);
  HeightField window{
      .columns = std::min(options_.cells + 1, layout_.columns - column * options_.cells),
      .rows = std::min(options_.cells + 1, layout_.rows - row * options_.cells)};
  window.heights.resize(static_cast<std::size_t>(window.columns) *
                        static_cast<std::size_t>(window.rows));
  const std::string bytes = file_.read(patch.offset, patch.bytes);
  if (terrain::checksumOf(bytes) != patch.checksum ||
      !terrain::decodeHeights(bytes, window.columns, header_.step, window.heights))
    throw IoError("the file cannot be read as it was written; check the disk");
  return window;
}

/// Measures the errors of all levels, one row of patches of level 0 after another.
void TileWriter::measureErrors() {
  const PyramidLevel& finest = pyramid_.levels[0];
  const std::vector<StoredPatch>& stored = index_[0];
  const auto width = static_cast<std::size_t>(finest.columns);
  std::size_t next = 0;
  for (int row = 0; row < finest.rows; ++row) {
    const std::size_t first = next;
    while (next < stored.size() && stored[next].number / width == static_cast<std::size_t>(row))
      ++next;
    std::vector<PyramidErrors::PatchErrors> errors(next - first);
    tbb::parallel_for(first, next, [&](std::size_t n) {
      errors[n - first] =
          errors_.measure(static_cast<int>(stored[n].number % width), row, readAgain(stored[n]));
    });
    std::size_t at = first;
    for (int column = 0; column < finest.columns; ++column) {
      if (at < next && stored[at].number % width == static_cast<std::size_t>(column)) {
        errors_.add(column, row, errors[at - first]);
        ++at;
      } else {
        errors_.addUnknown(column, row);
      }
    }
    report(options_.progress,
           kHeightsShare + (1 - kHeightsShare) * (row + 1) / static_cast<double>(finest.rows));
  }
  errors_.finish(options_.tolerance, pyramid_);
}

void TileWriter::write() {
  file_.append(terrain::tileHeaderBytes(header_));
  std::vector<float> heights(static_cast<std::size_t>(layout_.columns));
  for (int n = 0; n < layout_.rows; ++n) {
    const int row = rows_.isNorthFirst() ? layout_.rows - 1 - n : n;
    const bool isKnown = rows_.next(heights);
    if (isKnown) storeRow(row, heights);
    takeRow(row, isKnown ? heights : std::span<const float>());
    report(options_.progress, kHeightsShare * (n + 1) / layout_.rows);
  }
  file_.flush();
  takeRanges();
  sortIndex();
  measureErrors();
  const std::string index = terrain::tileIndexBytes(index_, pyramid_);
  const std::string compressed = terrain::deflated(index);
  header_.indexOffset = file_.size();
  header_.indexBytes = compressed.size();
  header_.indexLength = index.size();
  header_.indexChecksum = terrain::checksumOf(compressed);
  file_.append(compressed);
  header_.fileBytes = file_.size();
  file_.commit(terrain::tileHeaderBytes(header_));
}

}  // namespace

void writeTiledGround(const std::filesystem::path& path, HeightRows& rows,
                      const WriteTilesOptions& options) {
  TileWriter(path, rows, options).write();
}

void writeTiledGround(const std::filesystem::path& path, const HeightField& field,
                      const WriteTilesOptions& options) {
  const std::unique_ptr<HeightRows> rows = rowsOf(field);
  writeTiledGround(path, *rows, options);
}

}  // namespace levelset
