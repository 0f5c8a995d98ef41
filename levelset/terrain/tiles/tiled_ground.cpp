#include "levelset/terrain/tiles/tiled_ground.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/terrain/files/grid_header.h"
#include "levelset/terrain/pyramid_parts.h"
#include "levelset/terrain/tiles/patch_codec.h"
#include "levelset/terrain/tiles/tile_format.h"

namespace levelset {
namespace {

using terrain::StoredPatch;
using terrain::TileHeader;
using terrain::TileIndex;

/// A mapped file with its header and its index.
struct TileFile {
  TileFile(const std::filesystem::path& path, std::size_t maxMemory);

  std::string name;
  MappedFile file;
  TileHeader header;
  TileIndex index;
};

TileFile::TileFile(const std::filesystem::path& path, std::size_t maxMemory)
    : name(inputName(path)), file(path, maxMemory, false) {
  withContext(name, [&] {
    header = terrain::parseTileHeader(file.view());
    GroundLayout& layout = header.layout;
    const int cells = layout.pyramid.cells;
    const double patches = terrain::patchCount(layout.columns, layout.rows, cells);
    requireMemory(patches * (sizeof(PyramidPatch) + sizeof(StoredPatch)) +
                      static_cast<double>(header.indexLength) +
                      static_cast<double>(file.isMapped() ? 0 : file.view().size()),
                  memoryLeft(memoryLimit(maxMemory)));
    layout.pyramid = terrain::emptyPyramid(layout.columns, layout.rows, cells);
    // One byte more than stated is asked for, so that a longer index is noticed.
    const Bytes bytes = decompress(file.view().substr(header.indexOffset), "the index",
                                   static_cast<std::size_t>(header.indexLength) + 1);
    if (bytes.size() != header.indexLength)
      throw InvalidInput(
          fmt::format("the index has {} bytes in place of {}; copy or write the file again",
                      bytes.size(), header.indexLength));
    index = terrain::parseTileIndex(bytes.view(), header, layout.pyramid);
  });
}

class TiledGround final : public PatchStore {
 public:
  TiledGround(const std::filesystem::path& path, std::size_t maxMemory) : tiles_(path, maxMemory) {}

  const GroundLayout& layout() const override { return tiles_.header.layout; }
  void readPatch(int level, int column, int row, std::span<float> heights) const override;

 private:
  /// Patch of a number; null: it has no data.
  [[nodiscard]] const StoredPatch* find(int level, std::uint64_t number) const;
  [[noreturn]] void refusePatch(int level, int column, int row, const char* why) const {
    throw InvalidInput(
        fmt::format("{}: patch {},{} of level {} is damaged, as {}; copy or write the file again",
                    tiles_.name, column, row, level, why));
  }

  TileFile tiles_;
};

const StoredPatch* TiledGround::find(int level, std::uint64_t number) const {
  const std::vector<StoredPatch>& patches = tiles_.index[static_cast<std::size_t>(level)];
  const auto found =
      std::lower_bound(patches.begin(), patches.end(), number,
                       [](const StoredPatch& patch, std::uint64_t n) { return patch.number < n; });
  return found != patches.end() && found->number == number && found->bytes > 0 ? &*found : nullptr;
}

/// Number of samples of a patch along an axis, which the border of the ground may cut.
int patchSamples(int samples, int level, int cells, int patch) {
  const std::int64_t all = ((std::int64_t{samples} - 2) >> level) + 2;  // samples of the level
  return static_cast<int>(std::min<std::int64_t>(cells + 1, all - std::int64_t{patch} * cells));
}

void TiledGround::readPatch(int level, int column, int row, std::span<float> heights) const {
  const GroundLayout& ground = layout();
  const auto side = static_cast<std::size_t>(ground.pyramid.cells) + 1;
  if (level < 0 || level >= static_cast<int>(ground.pyramid.levels.size()) || column < 0 ||
      row < 0 || column >= ground.pyramid.levels[static_cast<std::size_t>(level)].columns ||
      row >= ground.pyramid.levels[static_cast<std::size_t>(level)].rows)
    throw UsageError(fmt::format("there is no patch {},{} of level {}", column, row, level));
  if (heights.size() != side * side)
    throw UsageError(
        fmt::format("{} heights are given for a patch of {}", heights.size(), side * side));
  const int width = ground.pyramid.levels[static_cast<std::size_t>(level)].columns;
  const StoredPatch* patch =
      find(level, static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(width) +
                      static_cast<std::uint64_t>(column));
  if (!patch) {
    std::fill(heights.begin(), heights.end(), kMissingHeight);
    return;
  }
  const std::string_view bytes = tiles_.file.view().substr(patch->offset, patch->bytes);
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
  if (terrain::checksumOf(bytes) != patch->checksum)
    refusePatch(level, column, row, "its checksum differs");
#endif
  const auto across = static_cast<std::size_t>(
                 patchSamples(ground.columns, level, ground.pyramid.cells, column)),
             along = static_cast<std::size_t>(
                 patchSamples(ground.rows, level, ground.pyramid.cells, row));
  if (!terrain::decodeHeights(bytes, static_cast<int>(across), tiles_.header.step,
                              heights.first(across * along)))
    refusePatch(level, column, row, "its heights cannot be decoded");
  // A patch that the border cuts repeats its last samples. From the end, so that each is read
  // before its place is overwritten.
  if (across == side && along == side) return;
  for (std::size_t j = side; j-- > 0;)
    for (std::size_t i = side; i-- > 0;)
      heights[j * side + i] = heights[std::min(j, along - 1) * across + std::min(i, across - 1)];
}

}  // namespace

TiledGroundInfo tiledGroundInfo(const std::filesystem::path& path, std::size_t maxMemory) {
  TileFile tiles(path, maxMemory);
  TiledGroundInfo info{.layout = std::move(tiles.header.layout),
                       .tolerance = tiles.header.tolerance,
                       .fileBytes = tiles.header.fileBytes,
                       .indexBytes = tiles.header.indexBytes,
                       .hash = terrain::tileHeaderChecksum(tiles.file.view()),
                       .levels = {}};
  for (std::size_t n = 0; n < tiles.index.size(); ++n) {
    TileLevelInfo level{.patches = info.layout.pyramid.levels[n].patches.size(),
                        .known = tiles.index[n].size()};
    for (const StoredPatch& patch : tiles.index[n]) level.bytes += patch.bytes;
    info.levels.push_back(level);
  }
  return info;
}

std::uint64_t tiledGroundHash(const std::filesystem::path& path) {
  const MappedFile file(path, kNoMemoryLimit, false);
  return withContext(inputName(path), [&] {
    static_cast<void>(terrain::parseTileHeader(file.view()));
    return terrain::tileHeaderChecksum(file.view());
  });
}

std::unique_ptr<PatchStore> openTiledGround(const std::filesystem::path& path,
                                            std::size_t maxMemory) {
  return std::make_unique<TiledGround>(path, maxMemory);
}

bool isTiledGroundFormat(const std::filesystem::path& nameOrFormat) {
  return terrain::heightFormatOf(nameOrFormat) == "lst";
}

}  // namespace levelset
