#include "levelset/volume_files/volume_header.h"

#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"

namespace levelset::volume_files {
namespace {

struct StoredTypeEntry {
  const char* name;
  std::size_t size;
};
// In the order of StoredType.
constexpr std::array<StoredTypeEntry, 11> kStoredTypes = {{{"u8", 1},
                                                           {"i8", 1},
                                                           {"u16", 2},
                                                           {"i16", 2},
                                                           {"u32", 4},
                                                           {"i32", 4},
                                                           {"u64", 8},
                                                           {"i64", 8},
                                                           {"f16", 2},
                                                           {"f32", 4},
                                                           {"f64", 8}}};

}  // namespace

const char* storedTypeName(StoredType type) {
  return kStoredTypes[static_cast<std::size_t>(type)].name;
}

std::size_t storedTypeSize(StoredType type) {
  return kStoredTypes[static_cast<std::size_t>(type)].size;
}

std::optional<StoredType> storedTypeOf(std::string_view name) {
  for (std::size_t n = 0; n < kStoredTypes.size(); ++n)
    if (name == kStoredTypes[n].name) return static_cast<StoredType>(n);
  return {};
}

void refuseFile(const std::string& name, const std::string& reason) {
  throw InvalidInput(name + " " + reason);
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace(" \t\r\n\v\f\0", 7);
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string lowered(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string_view takeWord(std::string_view& text, std::string_view separators) {
  const auto ends = [&](char c) {
    return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0' ||
           separators.find(c) != std::string_view::npos;
  };
  std::size_t from = 0;
  while (from < text.size() && ends(text[from])) ++from;
  std::size_t to = from;
  while (to < text.size() && !ends(text[to])) ++to;
  const std::string_view word = text.substr(from, to - from);
  while (to < text.size() && ends(text[to])) ++to;
  text.remove_prefix(to);
  return word;
}

void turnLpsIntoRas(Imath::M44d& indexToWorld) {
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 2; ++column)
      if (indexToWorld[row][column] != 0) indexToWorld[row][column] = -indexToWorld[row][column];
}

Imath::M44d affineMap(const Imath::V3d& i, const Imath::V3d& j, const Imath::V3d& k,
                      const Imath::V3d& origin) {
  return {i.x, i.y, i.z, 0, j.x, j.y, j.z, 0, k.x, k.y, k.z, 0, origin.x, origin.y, origin.z, 1};
}

}  // namespace levelset::volume_files
