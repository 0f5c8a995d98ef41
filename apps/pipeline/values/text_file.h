#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace pipeline {

/// Reads a complete file.
/// @param file  path, or "-" for standard input
/// @param who   action or option that begins each error message
/// @throws levelset::IoError if the file cannot be read
/// @throws levelset::InvalidInput if the file is longer than `mostBytes`
[[nodiscard]] std::string readText(const std::filesystem::path& file, const std::string& who,
                                   std::size_t mostBytes);

/// Writes a file completely. On failure an old file of that name stays unchanged.
/// @param who  action or option that begins each error message
/// @throws levelset::IoError if the file cannot be written
void writeText(const std::filesystem::path& file, const std::string& text, const std::string& who);

}  // namespace pipeline
