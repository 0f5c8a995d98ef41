#pragma once

#include <filesystem>
#include <string>

namespace regress {

/// Writes a text file, in place of an existing one.
/// @throws IoError if it cannot be written
void writeText(const std::filesystem::path& path, const std::string& text);

}  // namespace regress
