#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <cstring>

#include "levelset/volumes/volume.h"

namespace levelset {

/// Calls visit(T()) with the C++ type of the stored numbers.
template <typename Visit>
decltype(auto) withStoredType(VolumeType type, const Visit& visit) {
  if (type == VolumeType::U8) return visit(std::uint8_t());
  if (type == VolumeType::I8) return visit(std::int8_t());
  if (type == VolumeType::U16) return visit(std::uint16_t());
  if (type == VolumeType::I16) return visit(std::int16_t());
  return visit(float());
}

/// Reads a number at any alignment.
template <typename T>
T loadNumber(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

}  // namespace levelset
