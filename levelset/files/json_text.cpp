#include "levelset/files/json_text.h"

#include <fmt/core.h>

#include <fstream>
#include <iterator>
#include <system_error>

#include "levelset/error.h"
#include "levelset/progress.h"

namespace levelset {

std::string readJsonText(const std::filesystem::path& file, const char* wanted,
                         std::size_t maxMemory) {
  std::error_code failed;
  if (std::filesystem::is_directory(file, failed))
    throw IoError(fmt::format("{} is a folder; give {}", file.string(), wanted));
  const auto size = std::filesystem::file_size(file, failed);
  if (!failed) requireMemory(kJsonBytesPerCharacter * static_cast<double>(size), maxMemory);
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream)
    throw IoError(fmt::format("{} cannot be read; check its name and permissions", file.string()));
  return text;
}

}  // namespace levelset
