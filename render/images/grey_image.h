#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "levelset/progress.h"

namespace render {

/// A grey picture as numbers; the stored values are used without a tone curve.
struct GreyImage {
  int width = 0, height = 0;   ///< pixels
  std::vector<double> values;  ///< height × width, 0 (black) … 1 (white), top row first
  std::vector<double> alpha;   ///< same size, 0 … 1; empty: opaque
};

/// Reads a grey PNG of 1 to 16 bits, with or without an alpha channel or a transparent grey value.
/// @throws IoError when the file cannot be read
/// @throws InvalidInput when it is not a PNG, is damaged, announces more pixels than its bytes can
///         hold, or has colours
/// @throws ResourceLimit, before memory is allocated, for a picture that exceeds `maxMemory`
[[nodiscard]] GreyImage readGreyPng(const std::filesystem::path& path,
                                    std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Writes a grey PNG of 8 bits.
/// @param topRow      first pixel of the top row
/// @param rowStep     distance from a row to the one below, pixels; negative if the bottom row is
/// the
///                    first one in memory
/// @param zeroIsClear pixels of 0 are transparent
/// @throws InvalidInput for more than a million pixels along a side
/// @throws IoError when the file cannot be written; an old file of that name stays then
void writeGreyPng(const std::filesystem::path& path, int width, int height,
                  const std::uint8_t* topRow, std::ptrdiff_t rowStep, bool zeroIsClear);

/// Checks that the chunks of a PNG lie within the file, because libpng allocates memory for any
/// chunk size that a file claims. Does nothing for a pipe.
/// @throws InvalidInput for a chunk beyond the end of the file
void requirePngChunks(const std::filesystem::path& path);

/// Checks that a PNG file can hold the size that it announces, before memory is allocated for its
/// pixels.
/// @throws InvalidInput for more pixels than the bytes of the file can hold
void requirePngPixels(const std::filesystem::path& path, double width, double height);

}  // namespace render
