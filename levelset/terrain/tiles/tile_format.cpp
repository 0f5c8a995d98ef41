#include "levelset/terrain/tiles/tile_format.h"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "levelset/error.h"
#include "levelset/terrain/pyramid_parts.h"
#include "levelset/terrain/tiles/patch_codec.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace levelset::terrain {
namespace {

/// Begins with a byte that is no text, and has both kinds of line ends: a file that was copied as
/// text is recognized.
constexpr std::string_view kMagic = "\x89LST\r\n\x1a\n";
constexpr std::size_t kChecksumAt = 120;
constexpr std::uint32_t kGeographic = 1;
constexpr float kInfiniteError = std::numeric_limits<float>::infinity();

[[noreturn]] void refuseTiles(const std::string& what) {
  throw InvalidInput(what + "; copy or write the file again");
}

/// Writes numbers with the lowest byte first.
class TileBytes {
 public:
  template <typename T>
  void number(T value) {
    for (std::size_t n = 0; n < sizeof(T); ++n)
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> 8 * n & 0xff);
  }
  void real(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  /// Seven bits a byte, the lowest first; all bytes but the last one have the highest bit.
  void varying(std::uint64_t value) {
    for (; value > 0x7f; value >>= 7) bytes_ += static_cast<char>((value & 0x7f) | 0x80);
    bytes_ += static_cast<char>(value);
  }
  /// All lowest bytes of a number of each patch, then all second ones and so on.
  template <typename NumberOf>
  void planes(const std::vector<StoredPatch>& patches, const NumberOf& numberOf) {
    for (std::size_t n = 0; n < sizeof(numberOf(patches[0])); ++n)
      for (const StoredPatch& patch : patches)
        bytes_ += static_cast<char>(numberOf(patch) >> 8 * n & 0xff);
  }
  void text(std::string_view text) { bytes_ += text; }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what TileBytes writes, and refuses to read beyond the end.
class TileReader {
 public:
  explicit TileReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  T number() {
    const std::string_view raw = take(sizeof(T));
    std::uint64_t value = 0;
    for (std::size_t n = sizeof(T); n-- > 0;)
      value = value << 8 | static_cast<unsigned char>(raw[n]);
    return static_cast<T>(value);
  }
  double real() { return std::bit_cast<double>(number<std::uint64_t>()); }
  std::uint64_t varying() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<unsigned char>(take(1)[0]);
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
    refuseTiles("a number of the index is too long");
  }
  template <typename T>
  std::vector<T> planes(std::size_t count) {
    if (count > bytes_.size() / sizeof(T)) refuseTiles("the index ends early");
    std::vector<T> numbers(count);
    for (std::size_t n = 0; n < sizeof(T); ++n) {
      const std::string_view raw = take(count);
      for (std::size_t k = 0; k < count; ++k)
        numbers[k] |= static_cast<T>(T{static_cast<unsigned char>(raw[k])} << 8 * n);
    }
    return numbers;
  }
  std::string_view take(std::size_t count) {
    if (count > bytes_.size()) refuseTiles("the index ends early");
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  [[nodiscard]] bool isAtEnd() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

/// Compares checksums, except in a fuzzer, which cannot make right ones.
bool isChecksum([[maybe_unused]] std::uint64_t stored, [[maybe_unused]] std::uint64_t computed) {
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
  return true;
#else
  return stored == computed;
#endif
}

std::uint64_t headerChecksum(std::string_view header) {
  std::string covered(header.substr(0, kChecksumAt));
  covered += header.substr(kTileHeaderBytes);
  return checksumOf(covered);
}

/// Checks the numbers of a header whose checksum is right.
void requireTileHeader(const TileHeader& header, std::size_t fileBytes) {
  const GroundLayout& layout = header.layout;
  constexpr int kMost = 1 << 30;
  const int cells = layout.pyramid.cells;
  if (layout.columns < 2 || layout.rows < 2 || layout.columns > kMost || layout.rows > kMost ||
      cells < 2 || cells > 128 || !std::has_single_bit(static_cast<unsigned>(cells)))
    refuseTiles(
        fmt::format("the header states {}x{} samples in patches of {} cells, which is no "
                    "tiled terrain",
                    layout.columns, layout.rows, cells));
  requireTileNumbers(layout.columns, layout.rows, cells);
  requireGrid({.columns = layout.columns,
               .rows = layout.rows,
               .origin = layout.origin,
               .spacing = layout.spacing});
  if (!(header.tolerance >= 0) || !std::isfinite(header.tolerance) ||
      header.step != heightStep(header.tolerance))
    refuseTiles(fmt::format("the tolerance is {}", header.tolerance));
  if (header.fileBytes != fileBytes)
    refuseTiles(fmt::format("the file has {} bytes of {} that it should have", fileBytes,
                            header.fileBytes));
  if (header.indexOffset > fileBytes || header.indexBytes != fileBytes - header.indexOffset)
    refuseTiles("the place of the index is not in the file");
  // Each byte of deflated data stands for 1032 bytes at most.
  if (header.indexLength / 1032 > header.indexBytes) refuseTiles("the index is too long");
}

/// Runs of patches with data: their number, and for each the patches before it without data, and
/// those in it.
void writeRuns(TileBytes& to, const std::vector<StoredPatch>& patches) {
  std::vector<std::uint64_t> numbers;  // alternately
  std::uint64_t end = 0;
  for (const StoredPatch& patch : patches) {
    if (numbers.empty() || patch.number != end) {
      numbers.push_back(patch.number - end);
      numbers.push_back(0);
    }
    ++numbers.back();
    end = std::uint64_t{patch.number} + 1;
  }
  to.varying(numbers.size() / 2);
  for (const std::uint64_t number : numbers) to.varying(number);
}

std::vector<StoredPatch> readRuns(TileReader& from, std::size_t patchesOfLevel) {
  std::vector<StoredPatch> patches;
  std::uint64_t end = 0;
  for (std::uint64_t run = from.varying(); run > 0; --run) {
    const std::uint64_t gap = from.varying(), length = from.varying();
    if (length == 0 || gap > patchesOfLevel - end || length > patchesOfLevel - end - gap)
      refuseTiles("the index has a patch outside the terrain");
    end += gap;
    for (std::uint64_t n = 0; n < length; ++n)
      patches.push_back({.number = static_cast<std::uint32_t>(end++)});
  }
  return patches;
}

std::uint64_t foldedSign(std::int64_t value) {
  return static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63);
}
std::int64_t unfoldedSign(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1 ^ (0 - (value & 1)));
}

/// Reads places and checksums of the patches of a level.
void readPlaces(TileReader& from, const TileHeader& header, std::size_t headerEnd,
                std::vector<StoredPatch>& patches) {
  const std::vector<std::uint64_t> checksums = from.planes<std::uint64_t>(patches.size());
  std::uint64_t end = headerEnd;
  for (std::size_t n = 0; n < patches.size(); ++n) {
    StoredPatch& patch = patches[n];
    patch.checksum = checksums[n];
    const std::uint64_t bytes = from.varying();
    patch.offset = end + static_cast<std::uint64_t>(unfoldedSign(from.varying()));
    if (bytes > std::numeric_limits<std::uint32_t>::max() || patch.offset < headerEnd ||
        patch.offset > header.indexOffset || bytes > header.indexOffset - patch.offset)
      refuseTiles("the index has a patch outside the file");
    patch.bytes = static_cast<std::uint32_t>(bytes);
    end = patch.offset + bytes;
  }
}

/// Reads ranges and errors of the patches of a level.
void readRanges(TileReader& from, const std::vector<StoredPatch>& patches, bool hasErrors,
                PyramidLevel& level) {
  const auto lowest = from.planes<std::uint32_t>(patches.size()),
             highest = from.planes<std::uint32_t>(patches.size());
  const auto errors = from.planes<std::uint32_t>(hasErrors ? patches.size() : 0);
  for (std::size_t n = 0; n < patches.size(); ++n) {
    PyramidPatch& patch = level.patches[patches[n].number];
    patch.lowest = std::bit_cast<float>(lowest[n]);
    patch.highest = std::bit_cast<float>(highest[n]);
    if (hasErrors) patch.error = std::bit_cast<float>(errors[n]);
    if (!std::isfinite(patch.lowest) || !std::isfinite(patch.highest) ||
        patch.lowest > patch.highest || !(patch.error >= 0))
      refuseTiles("the range or the error of a patch is no number");
  }
}

}  // namespace

void requireTileNumbers(int columns, int rows, int cells) {
  const auto patches = [&](int samples) { return std::ceil((samples - 1.0) / cells); };
  if (patches(columns) * patches(rows) > std::numeric_limits<std::uint32_t>::max())
    throw InvalidInput(fmt::format(
        "the terrain has {}x{} samples in patches of {} cells, more than 2^32 patches; give more "
        "cells",
        columns, rows, cells));
}

std::uint64_t checksumOf(std::string_view bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

std::string tileHeaderBytes(const TileHeader& header) {
  const GroundLayout& layout = header.layout;
  const std::string_view name =
      std::string_view(layout.coordinateSystem).substr(0, kMostSystemName);
  TileBytes to;
  to.text(kMagic);
  to.number(kTileVersion);
  for (const int number : {layout.columns, layout.rows, layout.pyramid.cells})
    to.number(static_cast<std::uint32_t>(number));
  for (const double number : {layout.origin.x, layout.origin.y, layout.spacing.x, layout.spacing.y,
                              header.tolerance, header.step})
    to.real(number);
  to.number(layout.isGeographic ? kGeographic : 0u);
  to.number(static_cast<std::uint32_t>(name.size()));
  for (const std::uint64_t number : {header.fileBytes, header.indexOffset, header.indexBytes,
                                     header.indexLength, header.indexChecksum})
    to.number(number);
  std::string bytes = to.take();
  bytes.resize(kTileHeaderBytes);
  bytes += name;
  TileBytes checksum;
  checksum.number(headerChecksum(bytes));
  return bytes.replace(kChecksumAt, sizeof(std::uint64_t), checksum.take());
}

TileHeader parseTileHeader(std::string_view file) {
  if (file.substr(0, kMagic.size()) != kMagic.substr(0, std::min(file.size(), kMagic.size())))
    throw InvalidInput("the file is no tiled terrain; check its name");
  if (file.size() < kTileHeaderBytes) refuseTiles("the file ends in its header");
  TileReader from(file.substr(kMagic.size()));
  if (const auto version = from.number<std::uint32_t>(); version != kTileVersion)
    throw InvalidInput(
        fmt::format("the file has version {}, but this program reads version {}; write the file "
                    "again with this program, or use the one that wrote it",
                    version, kTileVersion));
  TileHeader header;
  GroundLayout& layout = header.layout;
  for (int* number : {&layout.columns, &layout.rows, &layout.pyramid.cells})
    *number = static_cast<int>(
        std::min<std::uint32_t>(from.number<std::uint32_t>(), std::numeric_limits<int>::max()));
  for (double* number : {&layout.origin.x, &layout.origin.y, &layout.spacing.x, &layout.spacing.y,
                         &header.tolerance, &header.step})
    *number = from.real();
  layout.isGeographic = (from.number<std::uint32_t>() & kGeographic) != 0;
  const std::size_t nameBytes = from.number<std::uint32_t>();
  for (std::uint64_t* number : {&header.fileBytes, &header.indexOffset, &header.indexBytes,
                                &header.indexLength, &header.indexChecksum})
    *number = from.number<std::uint64_t>();
  if (nameBytes > kMostSystemName || nameBytes > file.size() - kTileHeaderBytes)
    refuseTiles("the file ends in its header");
  const std::string_view bytes = file.substr(0, kTileHeaderBytes + nameBytes);
  if (!isChecksum(tileHeaderChecksum(file), headerChecksum(bytes)))
    refuseTiles("the header is damaged, as its checksum differs");
  layout.coordinateSystem = bytes.substr(kTileHeaderBytes);
  requireTileHeader(header, file.size());
  if (header.indexOffset < bytes.size()) refuseTiles("the place of the index is not in the file");
  if (!isChecksum(header.indexChecksum, checksumOf(file.substr(header.indexOffset))))
    refuseTiles("the index is damaged, as its checksum differs");
  return header;
}

std::uint64_t tileHeaderChecksum(std::string_view file) {
  return TileReader(file.substr(kChecksumAt, sizeof(std::uint64_t))).number<std::uint64_t>();
}

std::string tileIndexBytes(const TileIndex& index, const HeightPyramid& pyramid) {
  TileBytes to;
  constexpr std::size_t kMostPatchBytes = 30;
  std::size_t count = 0;
  for (const std::vector<StoredPatch>& patches : index) count += patches.size();
  to.reserve(count * kMostPatchBytes);
  for (std::size_t level = 0; level < index.size(); ++level) {
    writeRuns(to, index[level]);
    const auto patchOf = [&](const StoredPatch& stored) -> const PyramidPatch& {
      return pyramid.levels[level].patches[stored.number];
    };
    to.planes(index[level], [&](const StoredPatch& stored) {
      return std::bit_cast<std::uint32_t>(patchOf(stored).lowest);
    });
    to.planes(index[level], [&](const StoredPatch& stored) {
      return std::bit_cast<std::uint32_t>(patchOf(stored).highest);
    });
    if (level > 0)
      to.planes(index[level], [&](const StoredPatch& stored) {
        return std::bit_cast<std::uint32_t>(patchOf(stored).error);
      });
    to.planes(index[level], [](const StoredPatch& stored) { return stored.checksum; });
    std::uint64_t end = kTileHeaderBytes;
    for (const StoredPatch& stored : index[level]) {
      to.varying(stored.bytes);
      to.varying(foldedSign(static_cast<std::int64_t>(stored.offset - end)));
      end = stored.offset + stored.bytes;
    }
  }
  return to.take();
}

TileIndex parseTileIndex(std::string_view bytes, const TileHeader& header, HeightPyramid& pyramid) {
  TileReader from(bytes);
  TileIndex index;
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n) {
    PyramidLevel& level = pyramid.levels[n];
    const PyramidPatch unknown{
        .lowest = kMissingHeight,
        .highest = kMissingHeight,
        .error = n == 0 ? heightRoundedUp(header.tolerance) : kInfiniteError};
    std::fill(level.patches.begin(), level.patches.end(), unknown);
    index.push_back(readRuns(from, level.patches.size()));
    readRanges(from, index[n], n > 0, level);
    readPlaces(from, header, kTileHeaderBytes, index[n]);
    for (PyramidPatch& patch : level.patches) patch.bound = patch.error;
    if (n > 0) takeBounds(level, pyramid.levels[n - 1]);
  }
  if (!from.isAtEnd()) refuseTiles("the index is longer than its patches");
  return index;
}

std::string deflated(std::string_view bytes) {
  z_stream stream{};
  if (deflateInit(&stream, 6) != Z_OK)
    throw ResourceLimit("not enough memory to compress; close other programs");
  std::string compressed;
  std::vector<char> part(std::size_t{1} << 16);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  std::size_t left = bytes.size();
  do {
    const std::size_t given = std::min(left, std::size_t{1} << 30);
    if (stream.avail_in == 0) {
      stream.avail_in = static_cast<uInt>(given);
      left -= given;
    }
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = static_cast<uInt>(part.size());
    deflate(&stream, left == 0 ? Z_FINISH : Z_NO_FLUSH);
    compressed.append(part.data(), part.size() - stream.avail_out);
  } while (left > 0 || stream.avail_out == 0);
  deflateEnd(&stream);
  return compressed;
}

}  // namespace levelset::terrain
