#pragma once

#include <cstddef>
#include <filesystem>

#include "mapping/generators/heightmap.h"

namespace pipeline {

/// Heights from a file: a grey PNG, black 0 and white 1, what is transparent as much nearer to the
/// ground; or lines of numbers with blanks, commas or semicolons between them, the least 0 and the
/// largest 1. The first row has the largest y.
/// @param invert  white, or the largest number, becomes the ground
/// @throws IoError, InvalidInput, ResourceLimit, telling the line of what cannot be used
[[nodiscard]] mapping::HeightGrid readHeights(const std::filesystem::path& path, bool invert,
                                              std::size_t maxMemory);

}  // namespace pipeline
