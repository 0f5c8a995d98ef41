#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/terrain/tiles/patch_store.h"

/// Layout of tiled terrain files, `.lst`. docs/terrain.md describes the bytes.
namespace levelset::terrain {

inline constexpr std::uint32_t kTileVersion = 1;
/// Bytes of the header without the name of the coordinate system.
inline constexpr std::size_t kTileHeaderBytes = 128;
/// Longest name of a coordinate system, bytes.
inline constexpr std::size_t kMostSystemName = std::size_t{1} << 16;

/// Beginning of a file.
struct TileHeader {
  GroundLayout layout;   ///< the pyramid has the number of cells only
  double tolerance = 0;  ///< largest difference between a stored height and the true one
  double step = 0;       ///< heightStep() of the tolerance
  std::uint64_t fileBytes = 0;
  std::uint64_t indexOffset = 0, indexBytes = 0;  ///< place of the compressed index
  std::uint64_t indexLength = 0;                  ///< bytes of the index without compression
  std::uint64_t indexChecksum = 0;
};

/// A patch in the file that has at least one known sample.
struct StoredPatch {
  std::uint32_t number = 0;    ///< row × columns of the level + column
  std::uint32_t bytes = 0;     ///< 0: all samples of the patch are missing at its level
  std::uint64_t offset = 0;    ///< place in the file
  std::uint64_t checksum = 0;  ///< checksumOf() the bytes
};

/// Patches with data for each level, in the order of their numbers.
using TileIndex = std::vector<std::vector<StoredPatch>>;

/// Refuses a ground with more patches than numbers of 32 bits count.
/// @throws InvalidInput
void requireTileNumbers(int columns, int rows, int cells);

/// XXH3 of the bytes, 64 bits.
[[nodiscard]] std::uint64_t checksumOf(std::string_view bytes);

/// Writes a header, with its own checksum and the name of the coordinate system.
[[nodiscard]] std::string tileHeaderBytes(const TileHeader& header);

/// Reads a header, and checks it against the size of the file.
/// @param file  complete file
/// @throws InvalidInput
[[nodiscard]] TileHeader parseTileHeader(std::string_view file);
/// Checksum in a header. It tells files apart, as it covers the checksums of index and patches.
/// @pre parseTileHeader() has accepted the file
[[nodiscard]] std::uint64_t tileHeaderChecksum(std::string_view file);

/// Writes an index with the ranges and errors of its patches.
/// @param pyramid  complete but for the bounds
[[nodiscard]] std::string tileIndexBytes(const TileIndex& index, const HeightPyramid& pyramid);

/// Reads an index.
/// @param bytes    index without compression
/// @param header   header of the file
/// @param pyramid  emptyPyramid() of the layout; receives ranges, errors and bounds
/// @throws InvalidInput
[[nodiscard]] TileIndex parseTileIndex(std::string_view bytes, const TileHeader& header,
                                       HeightPyramid& pyramid);

/// Compresses bytes with zlib. @throws ResourceLimit
[[nodiscard]] std::string deflated(std::string_view bytes);

}  // namespace levelset::terrain
