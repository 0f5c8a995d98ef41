#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
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

/// Writes a grey PNG of 8 bits, row by row from the top. Without commit(), an old file of that name
/// stays.
class GreyPngWriter {
 public:
  /// @param zeroIsClear  pixels of 0 are transparent
  /// @throws levelset::InvalidInput for more than a million pixels along a side
  /// @throws levelset::IoError when the file cannot be written, as the other functions
  GreyPngWriter(const std::filesystem::path& path, int width, int height, bool zeroIsClear);
  ~GreyPngWriter();
  GreyPngWriter(const GreyPngWriter&) = delete;
  GreyPngWriter& operator=(const GreyPngWriter&) = delete;

  /// @param pixels  as many as the width
  void add(std::span<const std::uint8_t> pixels);
  /// Completes the file, after the last row.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Checks that the chunks of a PNG lie within the file, because libpng allocates memory for any
/// chunk size that a file claims. Does nothing for a pipe.
/// @throws InvalidInput for a chunk beyond the end of the file
void requirePngChunks(const std::filesystem::path& path);

/// Checks that a PNG file can hold the size that it announces, before memory is allocated for its
/// pixels.
/// @throws InvalidInput for more pixels than the bytes of the file can hold
void requirePngPixels(const std::filesystem::path& path, double width, double height);

}  // namespace render
