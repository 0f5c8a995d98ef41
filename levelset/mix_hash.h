#pragma once

// For the .cpp files of this library only.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace levelset {

[[nodiscard]] inline std::uint64_t mixHash(std::uint64_t hash, std::uint64_t word) {
  hash ^= word + 0x9e3779b97f4a7c15ull + (hash << 6) + (hash >> 2);
  hash *= 0xff51afd7ed558ccdull;
  return hash ^ (hash >> 32);
}

template <typename T>
[[nodiscard]] std::uint64_t mixBytes(std::uint64_t hash, const T* data, std::size_t count) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(data);
  const std::size_t size = count * sizeof(T);
  for (std::size_t i = 0; i < size; i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + i, std::min<std::size_t>(8, size - i));
    hash = mixHash(hash, word);
  }
  return hash;
}

}  // namespace levelset
