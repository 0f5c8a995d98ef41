#pragma once

// Private to levelset/mesh_files and levelset/point_files: values of the elements of a PLY file.

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "levelset/mesh_files/mesh_parts.h"
#include "levelset/mesh_files/ply_header.h"

namespace levelset::ply {

template <typename T>
T load(const char* p, bool swap) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, p, sizeof(T));
  if (swap) std::reverse(bytes, bytes + sizeof(T));
  return std::bit_cast<T>(bytes);
}

/// Reads the values of a binary file.
template <bool kSwap>
class BinarySource {
 public:
  BinarySource(std::string_view data, std::size_t, const std::string& name)
      : p_(data.data()), end_(data.data() + data.size()), name_(name) {}

  void begin(const Element& element, std::size_t index) {
    element_ = &element;
    index_ = index;
  }
  void end() {}
  [[nodiscard]] FilePosition place() const { return {element_->name.c_str(), index_}; }
  [[nodiscard]] const char* at() const { return p_; }

  double value(Type type) {
    require(sizeOf(type));
    const char* p = p_;
    p_ += sizeOf(type);
    switch (type) {
      case Type::Int8:
        return static_cast<signed char>(*p);
      case Type::Uint8:
        return static_cast<unsigned char>(*p);
      case Type::Int16:
        return load<std::int16_t>(p, kSwap);
      case Type::Uint16:
        return load<std::uint16_t>(p, kSwap);
      case Type::Int32:
        return load<std::int32_t>(p, kSwap);
      case Type::Uint32:
        return load<std::uint32_t>(p, kSwap);
      case Type::Float:
        return static_cast<double>(load<float>(p, kSwap));
      case Type::Double:
        return load<double>(p, kSwap);
    }
    return 0;
  }
  void skip(Type type, std::size_t count) {
    requireList(type, count);
    p_ += count * sizeOf(type);
  }
  /// Checks that a list of `count` values is present.
  void requireList(Type type, std::size_t count) {
    if (count > static_cast<std::size_t>(end_ - p_) / sizeOf(type)) failShort();
  }

 private:
  void require(std::size_t size) {
    if (static_cast<std::size_t>(end_ - p_) < size) failShort();
  }
  [[noreturn]] void failShort() const {
    failAt(name_, place(),
           "the file ends within this element; it is truncated or damaged: download or export it "
           "again");
  }

  const char* p_;
  const char* end_;
  const std::string& name_;
  const Element* element_ = nullptr;
  std::size_t index_ = 0;
};

/// Reads one element per line. Refuses a line with too many values, which would shift the values of
/// all later elements.
class AsciiSource {
 public:
  AsciiSource(std::string_view data, std::size_t headerLines, const std::string& name)
      : cursor_(data, name, headerLines + 1), name_(name) {}

  void begin(const Element& element, std::size_t) { element_ = &element; }
  void end() {
    if (cursor_.skipBlanks(0))
      failAt(
          name_, place(),
          fmt::format(
              "there are more values on the line than an element '{}' has; export the mesh again",
              element_->name));
  }
  [[nodiscard]] FilePosition place() const { return cursor_.place(); }
  [[nodiscard]] const char* at() const { return cursor_.at(); }

  double value(Type type) {
    if (!cursor_.skipToToken(0)) failEnd();
    const double number = cursor_.number("a number");
    // A value declared float is rounded to float. A number beyond the range of float is returned as
    // written, so that the caller can refuse it.
    const bool isFloat =
        type == Type::Float && std::abs(number) <= std::numeric_limits<float>::max();
    return isFloat ? static_cast<double>(static_cast<float>(number)) : number;
  }
  void skip(Type, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!cursor_.skipToToken(0)) failEnd();
      static_cast<void>(cursor_.token());
    }
  }
  void requireList(Type, std::size_t count) {
    if (count > cursor_.remaining()) failEnd();
  }

 private:
  [[noreturn]] void failEnd() const {
    failAt(name_, place(),
           fmt::format(
               "the file ends within the elements '{}'; it is truncated or damaged: download or "
               "export it again",
               element_->name));
  }

  TextCursor cursor_;
  const std::string& name_;
  const Element* element_ = nullptr;
};

/// Returns an integer colour as a fraction of the maximum of its type (255 or 65535), rounded to
/// float.
/// @throws InvalidInput for a number outside the range of the type
[[nodiscard]] double colorShare(double value, Type type, const std::string& name,
                                FilePosition place);

/// Returns a number that must be an integer from 0 to 1e15.
/// @param what  meaning of the number in the message: "the length of a list"
/// @throws InvalidInput for other numbers
[[nodiscard]] std::uint64_t wholeNumber(double value, const char* what, const std::string& name,
                                        FilePosition place);

}  // namespace levelset::ply
