#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace pipeline {

/// A file as it is. @param file  or "-" for standard input
/// @param who  begins what is said when it cannot be read: an action or an option
/// @throws levelset::IoError when it cannot be read; levelset::InvalidInput for more than mostBytes
[[nodiscard]] std::string readText(const std::filesystem::path& file, const std::string& who,
                                   std::size_t mostBytes);

/// Whole, or not at all. @throws levelset::IoError
void writeText(const std::filesystem::path& file, const std::string& text, const std::string& who);

}  // namespace pipeline
