#include <Imath/half.h>
#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::volume_files {
namespace {

constexpr std::int64_t kMostPerAxis = std::numeric_limits<int>::max();

bool needsConversion(StoredType stored) {
  return storedTypeSize(stored) != volumeTypeSize(typeInMemory(stored)) ||
         stored == StoredType::U32 || stored == StoredType::I32;
}

bool isForeign(const VolumeHeader& header) {
  return storedTypeSize(header.stored) > 1 &&
         header.isBigEndian != (std::endian::native == std::endian::big);
}

/// Number of points of the grid.
/// @throws InvalidInput when it, or its number of bytes, overflows
std::size_t countOf(const VolumeHeader& header, const std::string& name) {
  std::size_t count = 1;
  for (const std::int64_t size : header.size) {
    if (size < 1 || size > kMostPerAxis)
      refuseFile(name, fmt::format("states the size {} x {} x {}, but each must be from 1 to {}; "
                                   "repair its header",
                                   header.size[0], header.size[1], header.size[2], kMostPerAxis));
    if (__builtin_mul_overflow(count, static_cast<std::size_t>(size), &count)) count = 0;
  }
  std::size_t bytes = 0;
  if (count == 0 || __builtin_mul_overflow(count, std::size_t{8}, &bytes) || bytes >> 60 != 0)
    refuseFile(name, fmt::format("states the size {} x {} x {}, which overflows; repair its header",
                                 header.size[0], header.size[1], header.size[2]));
  return count;
}

/// Bytes of the numbers in the file, and their owner.
struct StoredBytes {
  std::shared_ptr<const void> owner;
  std::string_view bytes;
  bool isMapped = false;
};

void requireBytes(double bytes, std::size_t limit, const std::string& name) {
  if (bytes <= static_cast<double>(limit)) return;
  throw ResourceLimit(fmt::format(
      "{} needs {:.3g} GB of memory, which exceeds the limit of {:.3g} GB; raise --max-memory, or "
      "crop or coarsen the volume",
      name, bytes * 1e-9, static_cast<double>(limit) * 1e-9));
}

[[noreturn]] void refuseLength(const VolumeHeader& header, const std::string& name,
                               std::size_t needed, std::size_t present) {
  refuseFile(name, fmt::format("has {} bytes for its {} x {} x {} numbers of type {}, which take "
                               "{}; {}",
                               present, header.size[0], header.size[1], header.size[2],
                               storedTypeName(header.stored), needed,
                               header.mustFill ? "check --size, --type and --skip"
                                               : "download or create the file again"));
}

std::string_view behindLines(std::string_view bytes, std::uint64_t lines, const std::string& name) {
  for (; lines > 0; --lines) {
    const std::size_t stop = bytes.find('\n');
    if (stop == std::string_view::npos)
      refuseFile(name, "ends inside the lines to skip; repair its header");
    bytes.remove_prefix(stop + 1);
  }
  return bytes;
}

/// Finds the bytes of the numbers, decompressed where needed. Checks their count before it
/// allocates memory.
StoredBytes findBytes(const VolumeHeader& header, std::size_t count, std::size_t limit,
                      const std::string& name) {
  const std::size_t size = count * storedTypeSize(header.stored);
  const auto file = std::make_shared<const MappedFile>(header.dataFile, limit,
                                                       header.encoding == Encoding::CompressedFile);
  const std::string_view all = file->view();
  std::string_view bytes = all;
  if (header.offset > bytes.size()) refuseLength(header, name, size, 0);
  bytes.remove_prefix(header.offset);
  bytes = behindLines(bytes, header.lines, name);
  if (header.behindLines > bytes.size()) refuseLength(header, name, size, 0);
  bytes.remove_prefix(header.behindLines);
  if (header.encoding == Encoding::Compressed) {
    requireBytes(static_cast<double>(size), limit, name);
    const auto inflated = std::make_shared<Bytes>(decompress(bytes, name, size));
    if (inflated->size() < size) refuseLength(header, name, size, inflated->size());
    return {inflated, inflated->view(), false};
  }
  if (header.encoding == Encoding::Text) return {file, bytes, file->isMapped()};
  if (bytes.size() < size || (header.mustFill && bytes.size() != size))
    refuseLength(header, name, size, bytes.size());
  bytes = header.isAtEnd ? bytes.substr(bytes.size() - size) : bytes.substr(0, size);
  return {file, bytes, file->isMapped()};
}

/// Decompresses a file in which everything is compressed, no further than the last number.
StoredBytes inflateFile(const VolumeHeader& header, std::size_t count, std::size_t limit,
                        const std::string& name) {
  const std::size_t size = count * storedTypeSize(header.stored);
  const MappedFile file(header.dataFile, limit, false);
  const double whole = static_cast<double>(header.offset) + static_cast<double>(size);
  requireBytes(whole, limit, name);
  if (!isGzipData(file.view()))
    refuseFile(name, "has a name that ends in .gz but is not compressed; rename it");
  const std::size_t needed = header.offset + size;
  const auto inflated =
      std::make_shared<Bytes>(decompress(file.view(), name, needed + (header.mustFill ? 1 : 0)));
  if (inflated->size() < needed || (header.mustFill && inflated->size() > needed))
    refuseLength(header, name, size, inflated->size() - std::min(inflated->size(), header.offset));
  return {inflated, inflated->view().substr(header.offset, size), false};
}

template <typename T>
T storedAt(const char* from, bool isSwapped) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), from, sizeof(T));
  if (isSwapped)
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
  return std::bit_cast<T>(raw);
}

/// Converts numbers to type To, in parallel.
template <typename From, typename To, typename Convert>
void convertAll(std::string_view bytes, bool isSwapped, char* out, const Convert& convert) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes.size() / sizeof(From), 1 << 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t n = range.begin(); n < range.end(); ++n) {
                        const To value =
                            convert(storedAt<From>(bytes.data() + n * sizeof(From), isSwapped));
                        std::memcpy(out + n * sizeof(To), &value, sizeof(To));
                      }
                    });
}

template <typename T>
void convertSame(std::string_view bytes, bool isSwapped, char* out) {
  convertAll<T, T>(bytes, isSwapped, out, [](T value) { return value; });
}

template <typename T>
void convertToFloat(std::string_view bytes, bool isSwapped, char* out) {
  // A double beyond the range of float becomes infinite, and Volume refuses it.
  convertAll<T, float>(bytes, isSwapped, out, [](T value) { return static_cast<float>(value); });
}

void convertStored(StoredType stored, std::string_view bytes, bool isSwapped, char* out) {
  switch (stored) {
    case StoredType::U8:
    case StoredType::I8:
      return convertSame<std::uint8_t>(bytes, false, out);
    case StoredType::U16:
    case StoredType::I16:
      return convertSame<std::uint16_t>(bytes, isSwapped, out);
    case StoredType::F32:
      return convertSame<std::uint32_t>(bytes, isSwapped, out);
    case StoredType::U32:
      return convertToFloat<std::uint32_t>(bytes, isSwapped, out);
    case StoredType::I32:
      return convertToFloat<std::int32_t>(bytes, isSwapped, out);
    case StoredType::U64:
      return convertToFloat<std::uint64_t>(bytes, isSwapped, out);
    case StoredType::I64:
      return convertToFloat<std::int64_t>(bytes, isSwapped, out);
    case StoredType::F64:
      return convertAll<double, float>(bytes, isSwapped, out, [](double value) {
        constexpr double kMost = std::numeric_limits<float>::max();
        return std::abs(value) <= kMost ? static_cast<float>(value)
                                        : std::numeric_limits<float>::infinity();
      });
    case StoredType::F16:
      return convertAll<std::uint16_t, float>(bytes, isSwapped, out, [](std::uint16_t bits) {
        Imath::half value;
        value.setBits(bits);
        return static_cast<float>(value);
      });
  }
}

template <typename T>
void parseNumbers(std::string_view text, std::size_t count, char* out, const std::string& name) {
  for (std::size_t n = 0; n < count; ++n) {
    const std::string_view word = takeWord(text, ",");
    if (word.empty())
      refuseFile(
          name, fmt::format("has {} numbers, but its header states {}; create it again", n, count));
    std::optional<T> value;
    if constexpr (std::is_same_v<T, float>) {
      // Read as double: float has no text form of numbers below its normal range.
      const std::optional<double> number = numberIn<double>(word);
      if (number) value = static_cast<float>(*number);
    } else {
      value = numberIn<T>(word);
    }
    if (!value)
      refuseFile(name, fmt::format("has the word '{}' in place of a number of its type; repair it",
                                   word.substr(0, 40)));
    std::memcpy(out + n * sizeof(T), &*value, sizeof(T));
  }
}

void parseText(VolumeType type, std::string_view text, std::size_t count, char* out,
               const std::string& name) {
  switch (type) {
    case VolumeType::U8:
      return parseNumbers<std::uint8_t>(text, count, out, name);
    case VolumeType::I8:
      return parseNumbers<std::int8_t>(text, count, out, name);
    case VolumeType::U16:
      return parseNumbers<std::uint16_t>(text, count, out, name);
    case VolumeType::I16:
      return parseNumbers<std::int16_t>(text, count, out, name);
    case VolumeType::F32:
      return parseNumbers<float>(text, count, out, name);
  }
}

}  // namespace

VolumeType typeInMemory(StoredType stored) {
  switch (stored) {
    case StoredType::U8:
      return VolumeType::U8;
    case StoredType::I8:
      return VolumeType::I8;
    case StoredType::U16:
      return VolumeType::U16;
    case StoredType::I16:
      return VolumeType::I16;
    default:
      return VolumeType::F32;
  }
}

VolumeGrid gridOf(const VolumeHeader& header, const std::string& name) {
  static_cast<void>(countOf(header, name));
  return {{static_cast<int>(header.size[0]), static_cast<int>(header.size[1]),
           static_cast<int>(header.size[2])},
          header.indexToWorld};
}

Volume loadNumbers(const VolumeHeader& header, const ReadVolumeOptions& options) {
  const std::string name = inputName(header.dataFile);
  const std::size_t count = countOf(header, name), limit = memoryLimit(options.maxMemory);
  const VolumeType type = typeInMemory(header.stored);
  const bool isText = header.encoding == Encoding::Text;
  const bool isCopied = isText || needsConversion(header.stored) || isForeign(header);
  StoredBytes stored = header.encoding == Encoding::CompressedFile
                           ? inflateFile(header, count, limit, name)
                           : findBytes(header, count, limit, name);
  // A number takes at least two characters of a text, except the last one.
  if (isText && stored.bytes.size() / 2 + 1 < count)
    refuseLength(header, name, 2 * count - 1, stored.bytes.size());
  Volume::Data data{stored.owner, stored.bytes.data(), stored.isMapped};
  if (isCopied) {
    const double held = stored.isMapped ? 0 : static_cast<double>(stored.bytes.size());
    requireBytes(held + static_cast<double>(count * volumeTypeSize(type)), limit, name);
    const auto copied = std::make_shared<Bytes>();
    copied->resize(count * volumeTypeSize(type));
    if (isText)
      parseText(type, stored.bytes, count, copied->data(), name);
    else
      convertStored(header.stored, stored.bytes, isForeign(header), copied->data());
    data = {copied, copied->data(), false};
  }
  return withContext(name, [&] {
    return Volume(gridOf(header, name), type, header.scale, std::move(data), options.progress);
  });
}

}  // namespace levelset::volume_files
