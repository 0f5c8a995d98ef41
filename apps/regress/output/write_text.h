#pragma once

#include <filesystem>
#include <string>

namespace regress {

/// Replaces the complete file. @throws IoError
void writeText(const std::filesystem::path& path, const std::string& text);

}  // namespace regress
