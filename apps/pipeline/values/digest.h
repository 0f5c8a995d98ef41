#pragma once

#include <string>
#include <string_view>

namespace pipeline {

/// 128-bit XXH3 hash of the bytes, as 32 hexadecimal digits. The hash is not cryptographic: equal
/// digests of different texts can be constructed on purpose.
[[nodiscard]] std::string digestOf(std::string_view bytes);

}  // namespace pipeline
