#pragma once

#include <cstddef>
#include <string_view>

namespace levelset {

/// As deep as no document of ours goes.
inline constexpr std::size_t kMostJsonDepth = 64;

/// Do lists and objects stand in each other deeper than kMostJsonDepth? To be asked before a text
/// is parsed: copying and writing such a document would run through the stack.
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
      if (++depth > kMostJsonDepth) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

}  // namespace levelset
