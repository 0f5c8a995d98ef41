#include "levelset/terrain/sculpt/ground_edits.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mix_hash.h"

namespace levelset {
namespace {

static_assert(std::endian::native == std::endian::little, "files of edits are little endian");

constexpr std::string_view kMagic = "LSEDITS1";

/// Numbers of samples of a tile along x and y; a tile is cut at the end of the field.
std::pair<std::size_t, std::size_t> tileSize(const GroundEdits& edits, std::uint32_t column,
                                             std::uint32_t row) {
  const auto samples = [](std::uint32_t tile, int count) {
    const std::int64_t left = count - static_cast<std::int64_t>(tile) * kEditTile;
    return static_cast<std::size_t>(std::clamp<std::int64_t>(left, 0, kEditTile));
  };
  return {samples(column, edits.columns), samples(row, edits.rows)};
}

/// First height of a row of a tile in the field.
template <typename Field>
auto heightsOfTile(Field& field, const GroundEdits::Tile& tile, std::size_t row) {
  const std::size_t at =
      field.index(static_cast<int>(tile.column) * kEditTile,
                  static_cast<int>(tile.row) * kEditTile + static_cast<int>(row));
  return field.heights.begin() + static_cast<std::ptrdiff_t>(at);
}

/// Bytes of a file, with the name of the file for messages.
class EditsReader {
 public:
  EditsReader(std::string_view bytes, const std::filesystem::path& path)
      : bytes_(bytes), path_(path) {}

  template <typename T>
  T take() {
    T value;
    copy(&value, sizeof value);
    return value;
  }
  void copy(void* to, std::size_t size) {
    if (size > left()) fail("the file is cut; copy it again");
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw InvalidInput(fmt::format("{}: {}", inputName(path_), what));
  }

 private:
  std::string_view bytes_;
  const std::filesystem::path& path_;
  std::size_t at_ = 0;
};

}  // namespace

GroundChanges::GroundChanges(const HeightField& base)
    : baseHash_(base.contentHash()),
      tileColumns_(static_cast<std::size_t>((base.columns - 1) / kEditTile + 1)),
      hasChanged_(tileColumns_ * static_cast<std::size_t>((base.rows - 1) / kEditTile + 1)) {}

void GroundChanges::add(const SampleRange& changed) {
  if (changed.isEmpty()) return;
  for (int row = changed.firstRow / kEditTile; row <= changed.lastRow / kEditTile; ++row)
    for (int column = changed.firstColumn / kEditTile; column <= changed.lastColumn / kEditTile;
         ++column)
      hasChanged_[static_cast<std::size_t>(row) * tileColumns_ + static_cast<std::size_t>(column)] =
          true;
}

void GroundChanges::add(const GroundEdits& edits) {
  for (const GroundEdits::Tile& tile : edits.tiles)
    if (tile.column < tileColumns_ && tile.row < hasChanged_.size() / tileColumns_)
      hasChanged_[tile.row * tileColumns_ + tile.column] = true;
}

GroundEdits GroundChanges::edits(const HeightField& field, std::size_t maxMemory) const {
  const auto tiles = std::count(hasChanged_.begin(), hasChanged_.end(), true);
  requireMemory(static_cast<double>(tiles) * kEditTile * kEditTile * sizeof(float),
                memoryLeft(memoryLimit(maxMemory)));
  GroundEdits edits{
      .baseHash = baseHash_, .columns = field.columns, .rows = field.rows, .tiles = {}};
  for (std::size_t n = 0; n < hasChanged_.size(); ++n) {
    if (!hasChanged_[n]) continue;
    GroundEdits::Tile& tile = edits.tiles.emplace_back();
    tile.column = static_cast<std::uint32_t>(n % tileColumns_);
    tile.row = static_cast<std::uint32_t>(n / tileColumns_);
    const auto [width, height] = tileSize(edits, tile.column, tile.row);
    for (std::size_t row = 0; row < height; ++row) {
      const auto first = heightsOfTile(field, tile, row);
      tile.heights.insert(tile.heights.end(), first, first + static_cast<std::ptrdiff_t>(width));
    }
  }
  return edits;
}

void applyEdits(HeightField& field, const GroundEdits& edits) {
  if (field.columns != edits.columns || field.rows != edits.rows)
    throw InvalidInput(
        fmt::format("the edits are those of a terrain of {}x{} samples, but this one "
                    "has {}x{}; use the terrain for which they were made",
                    edits.columns, edits.rows, field.columns, field.rows));
  if (field.contentHash() != edits.baseHash)
    throw InvalidInput(
        "the edits are those of a terrain with other heights or another place; use the terrain for "
        "which they were made");
  for (const GroundEdits::Tile& tile : edits.tiles)
    if (const auto [width, height] = tileSize(edits, tile.column, tile.row);
        width * height == 0 || tile.heights.size() != width * height)
      throw InvalidInput(
          fmt::format("tile ({}, {}) of the edits has {} heights, but {} samples; "
                      "make the edits again",
                      tile.column, tile.row, tile.heights.size(), width * height));
  for (const GroundEdits::Tile& tile : edits.tiles) {
    const auto [width, height] = tileSize(edits, tile.column, tile.row);
    for (std::size_t row = 0; row < height; ++row)
      std::copy_n(tile.heights.begin() + static_cast<std::ptrdiff_t>(row * width), width,
                  heightsOfTile(field, tile, row));
  }
}

void writeGroundEdits(const std::filesystem::path& path, const GroundEdits& edits) {
  ByteWriter out(path, false);
  std::uint64_t hash = 0;
  const auto put = [&](const auto* data, std::size_t count) {
    out.write(data, count * sizeof *data);
    hash = mixBytes(hash, data, count);
  };
  put(kMagic.data(), kMagic.size());
  put(&edits.baseHash, 1);
  const std::uint32_t sizes[] = {static_cast<std::uint32_t>(edits.columns),
                                 static_cast<std::uint32_t>(edits.rows),
                                 static_cast<std::uint32_t>(edits.tiles.size())};
  put(sizes, std::size(sizes));
  for (const GroundEdits::Tile& tile : edits.tiles) {
    const std::uint32_t place[] = {tile.column, tile.row};
    put(place, std::size(place));
    put(tile.heights.data(), tile.heights.size());
  }
  out.writeValue(hash);
  out.commit();
}

GroundEdits readGroundEdits(const std::filesystem::path& path, std::size_t maxMemory) {
  const MappedFile file(path, maxMemory, false);
  EditsReader in(file.view(), path);
  std::uint64_t hash = 0;
  const auto get = [&](auto* data, std::size_t count) {
    in.copy(data, count * sizeof *data);
    hash = mixBytes(hash, data, count);
  };
  char magic[kMagic.size()];
  if (in.left() < sizeof magic) in.fail("this is no file of terrain edits; give an .edits file");
  get(magic, sizeof magic);
  if (std::string_view(magic, sizeof magic) != kMagic)
    in.fail("this is no file of terrain edits, or one of another version; give an .edits file");
  GroundEdits edits;
  std::uint32_t sizes[3];
  get(&edits.baseHash, 1);
  get(sizes, std::size(sizes));
  constexpr std::uint32_t kMostSamples = std::uint32_t{1} << 30;
  if (sizes[0] < 1 || sizes[1] < 1 || sizes[0] > kMostSamples || sizes[1] > kMostSamples)
    in.fail(fmt::format("the terrain has {}x{} samples; copy the file again", sizes[0], sizes[1]));
  edits.columns = static_cast<int>(sizes[0]);
  edits.rows = static_cast<int>(sizes[1]);
  // A tile has a place and one height at least.
  if (sizes[2] > in.left() / 12) in.fail("the file is cut; copy it again");
  requireMemory(
      static_cast<double>(in.left()) + static_cast<double>(sizes[2]) * sizeof(GroundEdits::Tile),
      memoryLeft(memoryLimit(maxMemory)));
  edits.tiles.resize(sizes[2]);
  for (std::size_t n = 0; n < edits.tiles.size(); ++n) {
    GroundEdits::Tile& tile = edits.tiles[n];
    std::uint32_t place[2];
    get(place, 2);
    tile.column = place[0];
    tile.row = place[1];
    const auto [width, height] = tileSize(edits, tile.column, tile.row);
    const GroundEdits::Tile* before = n > 0 ? &edits.tiles[n - 1] : nullptr;
    if (width * height == 0 ||
        (before && std::pair(before->row, before->column) >= std::pair(tile.row, tile.column)))
      in.fail(fmt::format("tile {} is at ({}, {}), out of place; copy the file again", n + 1,
                          tile.column, tile.row));
    if (width * height * sizeof(float) > in.left()) in.fail("the file is cut; copy it again");
    tile.heights.resize(width * height);
    get(tile.heights.data(), tile.heights.size());
    for (const float z : tile.heights)
      if (std::isinf(z)) in.fail("a height is infinite; copy the file again");
  }
  if (in.take<std::uint64_t>() != hash || in.left() > 0)
    in.fail("the hash at its end is not that of its content; copy the file again");
  return edits;
}

}  // namespace levelset
