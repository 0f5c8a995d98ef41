#pragma once

#include <openvdb/io/Compression.h>

#include <cstdint>
#include <cstring>
#include <limits>

#include "levelset/files/vdb_layout.h"

// Private to levelset/files and levelset/point_files: locates the values of a node in a .vdb file
// and checks their sizes. Include it from .cpp files only.

namespace levelset {

/// Number of components of a value type. The file may store each component as a half float.
template <typename T>
inline constexpr std::size_t kComponents = 1;
template <>
inline constexpr std::size_t kComponents<openvdb::Vec3s> = 3;
template <>
inline constexpr std::size_t kComponents<openvdb::Vec3d> = 3;

template <typename T>
T fromHalves(const openvdb::math::half* halves) {
  if constexpr (kComponents<T> == 1)
    return static_cast<T>(static_cast<float>(halves[0]));
  else
    return T(static_cast<float>(halves[0]), static_cast<float>(halves[1]),
             static_cast<float>(halves[2]));
}

/// Storage format of the values of one tree.
template <typename T>
struct Storage {
  std::uint32_t compression;
  bool half;
  T background;
};

/// Values of one node as stored in the file, with checked sizes.
template <typename T, typename Mask>
struct ValueBlock {
  T inactive[2];         // replacements for inactive values that are not stored
  Mask selection;        // for each inactive value: on for inactive[1], off for inactive[0]
  openvdb::Index count;  // number of stored values
  bool activeOnly;
  const char* data;  // stored values; if compressed, their length precedes them
  std::size_t size;
};

template <typename Mask>
Mask takeMask(VdbBytes& bytes) {
  Mask mask;
  const char* words = bytes.take(Mask::SIZE / 8);
  for (openvdb::Index i = 0; i < Mask::SIZE / 64; ++i)
    std::memcpy(&mask.template getWord<openvdb::Index64>(i), words + 8 * i, 8);
  return mask;
}

/// Checks the sizes in Blosc's own header, which Blosc trusts although the file supplies them.
inline void checkBloscHeader(const VdbBytes& bytes, const char* block, std::size_t stored,
                             std::size_t expected) {
  constexpr std::size_t kHeaderSize = 16;
  std::uint32_t plain = 0, packed = 0;
  if (stored >= kHeaderSize) {
    std::memcpy(&plain, block + 4, 4);
    std::memcpy(&packed, block + 12, 4);
  }
  if (stored < kHeaderSize || plain != expected || packed != stored)
    bytes.fail("the header of a compressed block states a wrong size");
}

/// Skips stored data that unpack to `expected` bytes. Returns the stored size in bytes, with the
/// length field.
inline std::size_t takeData(VdbBytes& bytes, std::uint32_t compression, std::size_t expected) {
  namespace io = openvdb::io;
  if ((compression & (io::COMPRESS_BLOSC | io::COMPRESS_ZIP)) == 0) {
    static_cast<void>(bytes.take(expected));
    return expected;
  }
  const auto length = bytes.value<std::int64_t>();  // negative: stored uncompressed
  if (length <= 0) {
    if (length == std::numeric_limits<std::int64_t>::min() ||
        static_cast<std::size_t>(-length) != expected)
      bytes.fail("a block of values has the wrong size");
    static_cast<void>(bytes.take(expected));
    return sizeof length + expected;
  }
  const auto stored = static_cast<std::size_t>(length);
  const char* block = bytes.take(stored);
  if (expected > 0 && (compression & io::COMPRESS_BLOSC))
    checkBloscHeader(bytes, block, stored, expected);
  return sizeof length + stored;
}

template <typename T, typename Mask>
ValueBlock<T, Mask> takeValues(VdbBytes& bytes, const Storage<T>& storage, const Mask& active) {
  namespace io = openvdb::io;
  ValueBlock<T, Mask> block;
  const auto kind = bytes.value<std::int8_t>();
  if (kind < io::NO_MASK_OR_INACTIVE_VALS || kind > io::NO_MASK_AND_ALL_VALS)
    bytes.fail(fmt::format("a node stores its values in the unknown layout {}", kind));
  block.inactive[1] = storage.background;
  block.inactive[0] =
      kind == io::NO_MASK_OR_INACTIVE_VALS ? storage.background : T(-storage.background);
  if (kind == io::NO_MASK_AND_ONE_INACTIVE_VAL || kind == io::MASK_AND_ONE_INACTIVE_VAL ||
      kind == io::MASK_AND_TWO_INACTIVE_VALS)
    block.inactive[0] = bytes.value<T>();
  if (kind == io::MASK_AND_TWO_INACTIVE_VALS) block.inactive[1] = bytes.value<T>();
  if (kind == io::MASK_AND_NO_INACTIVE_VALS || kind == io::MASK_AND_ONE_INACTIVE_VAL ||
      kind == io::MASK_AND_TWO_INACTIVE_VALS)
    block.selection = takeMask<Mask>(bytes);
  block.activeOnly =
      (storage.compression & io::COMPRESS_ACTIVE_MASK) && kind != io::NO_MASK_AND_ALL_VALS;
  block.count = block.activeOnly ? active.countOn() : Mask::SIZE;
  block.data = bytes.rest().data();
  block.size = storage.half && block.count == 0
                   ? 0  // with half floats, an empty list of values takes no bytes
                   : takeData(bytes, storage.compression,
                              block.count * (storage.half ? 2 * kComponents<T> : sizeof(T)));
  return block;
}

}  // namespace levelset
