#pragma once

#include <string>
#include <string_view>

namespace pipeline {

/// 128 bits of a hash of the bytes (XXH3), as 32 hexadecimal digits. No defence against those who
/// want two texts to have the same.
[[nodiscard]] std::string digestOf(std::string_view bytes);

}  // namespace pipeline
