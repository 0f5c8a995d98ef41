#pragma once

// Volume files for tests, written byte by byte: no reader or writer of the library takes part.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace support {

/// Appends or overwrites numbers in either byte order. The machine is little-endian.
struct ByteText {
  std::string bytes;
  bool isBigEndian = false;

  template <typename T>
  void put(std::size_t at, T value) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));
    if (isBigEndian) std::reverse(raw.begin(), raw.end());
    if (bytes.size() < at + sizeof(T)) bytes.resize(at + sizeof(T), '\0');
    std::copy(raw.begin(), raw.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
  }
  template <typename T>
  void append(T value) {
    put(bytes.size(), value);
  }
};

/// Numbers of a small volume of 3 × 2 × 2 points: all fit a signed byte, and none repeats.
inline std::vector<int> smallNumbers(bool isSigned) {
  std::vector<int> numbers;
  for (int n = 0; n < 12; ++n) numbers.push_back(7 * n + (isSigned ? -40 : 5));
  return numbers;
}

template <typename T>
std::string numberBytes(const std::vector<int>& numbers, bool isBigEndian) {
  ByteText text{{}, isBigEndian};
  for (const int number : numbers) text.append(static_cast<T>(number));
  return text.bytes;
}

/// Map from index to world space as NIfTI's sform has it: three rows of four numbers.
using SformRows = std::array<std::array<double, 4>, 3>;
/// An oblique, anisotropic map with a mirrored axis.
inline constexpr SformRows kOblique = {
    {{-1.2, 0.3, 0.1, 10}, {0.2, 0.9, -0.4, -20}, {0.05, 0.25, 2.5, 30}}};

/// A NIfTI-1 file of 3 × 2 × 2 numbers, with an sform.
inline ByteText nifti1(int datatype, int bits, bool isBigEndian, const SformRows& sform) {
  ByteText h{std::string(352, '\0'), isBigEndian};
  h.put<std::int32_t>(0, 348);
  const std::array<std::int16_t, 8> dim = {3, 3, 2, 2, 1, 1, 1, 1};
  for (std::size_t n = 0; n < 8; ++n) {
    h.put<std::int16_t>(40 + 2 * n, dim[n]);
    h.put<float>(76 + 4 * n, 1);
  }
  h.put<std::int16_t>(70, static_cast<std::int16_t>(datatype));
  h.put<std::int16_t>(72, static_cast<std::int16_t>(bits));
  h.put<float>(108, 352);
  h.put<std::int8_t>(123, 2);  // millimetres
  h.put<std::int16_t>(254, 1);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      h.put<float>(280 + 16 * row + 4 * column, static_cast<float>(sform[row][column]));
  h.bytes.replace(344, 4, std::string("n+1\0", 4));
  return h;
}

/// A NIfTI-2 header of 3 × 2 × 2 numbers, with an sform.
inline ByteText nifti2(int datatype, bool isBigEndian, const SformRows& sform) {
  ByteText h{std::string(544, '\0'), isBigEndian};
  h.put<std::int32_t>(0, 540);
  h.bytes.replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
  h.put<std::int16_t>(12, static_cast<std::int16_t>(datatype));
  const std::array<std::int64_t, 8> dim = {3, 3, 2, 2, 1, 1, 1, 1};
  for (std::size_t n = 0; n < 8; ++n) {
    h.put<std::int64_t>(16 + 8 * n, dim[n]);
    h.put<double>(104 + 8 * n, 1);
  }
  h.put<std::int64_t>(168, 544);
  h.put<std::int32_t>(348, 1);
  h.put<std::int32_t>(500, 2);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      h.put<double>(400 + 32 * row + 8 * column, sform[row][column]);
  return h;
}

/// An MRC header of 3 × 2 × 2 numbers, spacing 1.5 along all axes, axes in their natural order.
inline ByteText mrc(int mode, bool isBigEndian) {
  ByteText h{std::string(1024, '\0'), isBigEndian};
  const std::array<std::int32_t, 3> size = {3, 2, 2};
  for (std::size_t n = 0; n < 3; ++n) {
    h.put<std::int32_t>(4 * n, size[n]);
    h.put<std::int32_t>(28 + 4 * n, size[n]);
    h.put<float>(40 + 4 * n, 1.5f * static_cast<float>(size[n]));
    h.put<float>(52 + 4 * n, 90);
    h.put<std::int32_t>(64 + 4 * n, static_cast<std::int32_t>(n + 1));
  }
  h.put<std::int32_t>(12, mode);
  h.bytes.replace(208, 4, "MAP ");
  h.bytes[212] = isBigEndian ? 0x11 : 0x44;
  h.bytes[213] = isBigEndian ? 0x11 : 0x44;
  return h;
}

}  // namespace support
