#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "levelset/progress.h"

namespace render {

/// A grey picture as numbers, without any curve of tones.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<double> values;  ///< height × width, 0 (black) … 1 (white), the first row on top
  std::vector<double> alpha;   ///< of the same size, 0 … 1; empty: all is opaque
};

/// Reads a PNG of 1 to 16 bits, with or without alpha or a transparent grey.
/// @throws IoError when it cannot be read; InvalidInput for what is no PNG, is damaged, promises
///         more than its bytes can hold, or has colours; ResourceLimit, before it allocates, for
///         one that passes `maxMemory`
[[nodiscard]] GreyImage readGreyPng(const std::filesystem::path& path,
                                    std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Throws InvalidInput for a PNG whose chunks reach beyond the file: libpng takes memory for what
/// they claim.
void requirePngChunks(const std::filesystem::path& path);

/// Throws InvalidInput for a PNG of more pixels than a file of its size can hold, before memory is
/// taken for them.
void requirePngPixels(const std::filesystem::path& path, double width, double height);

}  // namespace render
