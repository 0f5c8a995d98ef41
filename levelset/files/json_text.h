#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "levelset/progress.h"

namespace levelset {

/// Maximum nesting depth of JSON documents. The documents that Levelsmith writes are less deep.
inline constexpr std::size_t kMaxJsonDepth = 64;

/// Returns true when lists and objects are nested deeper than kMaxJsonDepth. Call it before parsing
/// a text: copying or writing a document nested too deeply would overflow the stack.
[[nodiscard]] inline bool isJsonTooDeep(std::string_view text) {
  std::size_t depth = 0;
  bool isQuoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (isQuoted) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        isQuoted = false;
    } else if (c == '"') {
      isQuoted = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxJsonDepth) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

/// Finds a key that an object of a JSON text lists twice: readers of JSON would keep the last
/// entry.
/// @return the key; nullopt if there is none before the first syntax error
[[nodiscard]] std::optional<std::string> repeatedKey(const std::string& text);

/// Text of the member "format" of the document in a file. Reads the file up to that member only.
/// @return nullopt for a file without one, or that cannot be read
[[nodiscard]] std::optional<std::string> jsonFormat(const std::filesystem::path& file);

/// Memory for each character of a JSON text, bytes: the character itself, and its share of a node
/// with its list entry, which takes at least two characters.
inline constexpr double kJsonBytesPerCharacter = 20;

/// Reads the text of a JSON file.
/// @param wanted  for messages: "a lattice file"
/// @throws IoError        if the file is a folder or cannot be read
/// @throws ResourceLimit  if the parsed document would exceed `maxMemory`, bytes
[[nodiscard]] std::string readJsonText(const std::filesystem::path& file, const char* wanted,
                                       std::size_t maxMemory = kNoMemoryLimit);

}  // namespace levelset
