#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/volume_files/volume_file.h"

namespace levelset::volume_files {

/// Type of the numbers in a file.
enum class StoredType { U8, I8, U16, I16, U32, I32, U64, I64, F16, F32, F64 };
[[nodiscard]] const char* storedTypeName(StoredType type);
[[nodiscard]] std::size_t storedTypeSize(StoredType type);
/// Returns the type of that name; empty: there is none.
[[nodiscard]] std::optional<StoredType> storedTypeOf(std::string_view name);

enum class Encoding {
  Raw,
  Compressed,      ///< the numbers alone are compressed, as gzip or zlib
  CompressedFile,  ///< the complete file is compressed
  Text
};

/// Description of the numbers in a file, read from the header.
struct VolumeHeader {
  const char* format = "";
  std::array<std::int64_t, 3> size{};
  Imath::M44d indexToWorld = Imath::M44d();
  StoredType stored = StoredType::U8;
  bool isBigEndian = false;
  VolumeScale scale = {};
  std::filesystem::path dataFile;  ///< file with the numbers
  /// Position of the first number, bytes; in the decompressed file if the complete file is
  /// compressed.
  std::uint64_t offset = 0;
  bool isAtEnd = false;     ///< true: the numbers are the last bytes of the file, not at `offset`
  std::uint64_t lines = 0;  ///< number of lines between `offset` and the numbers
  std::uint64_t behindLines = 0;  ///< number of bytes between these lines and the numbers
  Encoding encoding = Encoding::Raw;
  bool mustFill = false;  ///< true: no byte may follow the numbers
  std::vector<std::string> notes = {};
};

/// Largest header that is read, bytes. It holds a text header with long comments.
inline constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 20;

// Each function reads the header of one format. `bytes` are the first bytes of the file,
// decompressed; `name` is the name of the file in messages.
[[nodiscard]] VolumeHeader readNiftiHeader(const std::filesystem::path& path,
                                           std::string_view bytes, const std::string& name,
                                           int frame);
[[nodiscard]] VolumeHeader readMetaImageHeader(const std::filesystem::path& path,
                                               std::string_view bytes, const std::string& name);
[[nodiscard]] VolumeHeader readNrrdHeader(const std::filesystem::path& path, std::string_view bytes,
                                          const std::string& name);
[[nodiscard]] VolumeHeader readMrcHeader(const std::filesystem::path& path, std::string_view bytes,
                                         const std::string& name);

/// Type of the numbers in memory.
[[nodiscard]] VolumeType typeInMemory(StoredType stored);
/// Grid of the volume. @throws InvalidInput when a size is below 1 or the number of bytes overflows
[[nodiscard]] VolumeGrid gridOf(const VolumeHeader& header, const std::string& name);
/// Loads the numbers that a header describes.
/// @throws as readVolume
[[nodiscard]] Volume loadNumbers(const VolumeHeader& header, const ReadVolumeOptions& options);

/// Throws the refusal of a file: "NAME REASON".
[[noreturn]] void refuseFile(const std::string& name, const std::string& reason);

/// Numbers of a binary header, in either byte order.
class BinaryHeader {
 public:
  BinaryHeader(std::string_view bytes, bool isSwapped) : bytes_(bytes), isSwapped_(isSwapped) {}

  /// @pre the number lies in the header
  template <typename T>
  [[nodiscard]] T at(std::size_t offset) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
    if (isSwapped_)
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    return std::bit_cast<T>(raw);
  }

 private:
  std::string_view bytes_;
  bool isSwapped_;
};

// === Text headers

[[nodiscard]] std::string_view trimmed(std::string_view text);
[[nodiscard]] std::string lowered(std::string_view text);
/// Takes the first word off the text. Spaces, tabs and any of `separators` end a word.
[[nodiscard]] std::string_view takeWord(std::string_view& text, std::string_view separators = "");
/// Reads a number that fills the whole word; empty: it is none.
template <typename T>
[[nodiscard]] std::optional<T> numberIn(std::string_view word) {
  T value{};
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}
/// Reads exactly `count` numbers, and nothing else; empty: the text has others.
template <typename T>
[[nodiscard]] std::vector<T> numbersIn(std::string_view text, std::size_t count,
                                       std::string_view separators = "") {
  std::vector<T> numbers;
  while (!(text = trimmed(text)).empty()) {
    const std::optional<T> number = numberIn<T>(takeWord(text, separators));
    if (!number || numbers.size() == count) return {};
    numbers.push_back(*number);
  }
  if (numbers.size() != count) numbers.clear();
  return numbers;
}

/// Turns an affine map to LPS coordinates into one to RAS coordinates, by negating x and y.
void turnLpsIntoRas(Imath::M44d& indexToWorld);

/// Affine map with the given images of the index axes and of index 0.
[[nodiscard]] Imath::M44d affineMap(const Imath::V3d& i, const Imath::V3d& j, const Imath::V3d& k,
                                    const Imath::V3d& origin);

}  // namespace levelset::volume_files
