#pragma once

#include <cstddef>
#include <string_view>

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

}  // namespace levelset
