#include "apps/pipeline/values/text_file.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <system_error>
#include <vector>

#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

std::string textOf(std::istream& in, const std::string& name, const std::string& who,
                   std::size_t mostBytes) {
  std::string text;
  std::vector<char> block(1 << 16);
  while (in) {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > mostBytes)
      throw levelset::InvalidInput(
          fmt::format("{}: '{}' is longer than {} MB, the limit for such files; use another file",
                      who, name, mostBytes >> 20));
  }
  return text;
}

}  // namespace

std::string readText(const std::filesystem::path& file, const std::string& who,
                     std::size_t mostBytes) {
  if (file == "-") return textOf(std::cin, "-", who, mostBytes);
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw levelset::IoError(
        fmt::format("{}: '{}' is a directory; give a file", who, file.string()));
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw levelset::IoError(
        fmt::format("{}: cannot read '{}': {}; check the path and the permissions", who,
                    file.string(), std::strerror(errno)));
  }
  return textOf(in, file.string(), who, mostBytes);
}

void writeText(const std::filesystem::path& file, const std::string& text, const std::string& who) {
  try {
    levelset::FileTarget target(file);
    std::FILE* out = std::fopen(target.path().c_str(), "wb");
    if (!out)
      throw levelset::IoError(
          fmt::format("cannot write '{}'; check the path and the permissions", file.string()));
    const bool whole = std::fwrite(text.data(), 1, text.size(), out) == text.size();
    if (std::fclose(out) != 0 || !whole)
      throw levelset::IoError(fmt::format(
          "writing '{}' failed before its end; check the free disk space", file.string()));
    target.commit();
  } catch (const levelset::Error& failure) {
    rethrowAs(who, failure);
  }
}

}  // namespace pipeline
