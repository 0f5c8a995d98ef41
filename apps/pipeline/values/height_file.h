#pragma once

#include <cstddef>
#include <filesystem>

#include "mapping/generators/heightmap.h"

namespace pipeline {

/// Reads heights from a grey PNG or from lines of numbers. In a PNG, black is 0 and white is 1, and
/// the alpha channel scales the height. Numbers are separated by blanks, commas or semicolons; the
/// smallest becomes 0 and the largest 1. The first row has the largest y.
/// @param invert  white, or the largest number, becomes 0
/// @param maxMemory  limit for the heights, bytes
/// @throws IoError if the file cannot be read
/// @throws InvalidInput if a line has a word that is no number, or another count of numbers than
///         the lines before (the message names the line), or if there are fewer than two rows or
///         columns
/// @throws ResourceLimit if the heights exceed the limit
[[nodiscard]] mapping::HeightGrid readHeights(const std::filesystem::path& path, bool invert,
                                              std::size_t maxMemory);

}  // namespace pipeline
