#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "levelset/file_target.h"
#include "levelset/progress.h"

// Private to levelset/files: whole files into memory and out again, compressed or not.

namespace levelset {

/// A block of bytes that grows in place, without being filled first.
class Bytes {
 public:
  [[nodiscard]] const char* data() const { return data_.get(); }
  [[nodiscard]] char* data() { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::string_view view() const { return {data_.get(), size_}; }
  /// @throws ResourceLimit when the memory cannot be had
  void resize(std::size_t size);

 private:
  struct Free {
    void operator()(char* p) const { std::free(p); }
  };
  std::unique_ptr<char, Free> data_;
  std::size_t size_ = 0;
};

/// Reads a file, or standard input for "-"; gzip data is told by its first bytes and inflated.
/// @throws IoError when it cannot be opened or read; InvalidInput when it is empty or the
/// compressed
///         data is damaged; ResourceLimit as soon as the bytes pass `maxMemory` or the machine's
///         memory
[[nodiscard]] Bytes readBytes(const std::filesystem::path& path, std::size_t maxMemory);

/// The bytes of a file without those that nobody looks at: mapped into memory, or read as by
/// readBytes where that cannot be (pipes, standard input, gzip data).
class MappedFile {
 public:
  /// @throws as readBytes
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  [[nodiscard]] std::string_view view() const;

 private:
  Bytes read_;
  void* mapped_ = nullptr;
  std::size_t size_ = 0;
};

/// The beginning of a file, inflated likewise; damage further on is not seen.
struct FirstBytes {
  Bytes bytes;
  std::size_t whole = 0;  ///< bytes of all of the file; 0 when only reading it would tell
};
/// @param count  as many at most
[[nodiscard]] FirstBytes readFirstBytes(const std::filesystem::path& path, std::size_t count);

/// What messages call the file: its name in quotes, or standard input.
[[nodiscard]] std::string inputName(const std::filesystem::path& path);

/// Buffered, checked writing into a FileTarget, gzip-compressed on demand. The same bytes come out
/// for the same input: no time stamp, no name.
class ByteWriter {
 public:
  ByteWriter(const std::filesystem::path& target, bool compressed);
  ~ByteWriter();
  ByteWriter(const ByteWriter&) = delete;
  ByteWriter& operator=(const ByteWriter&) = delete;

  void write(const void* data, std::size_t size) {
    if (size > kCapacity - used_) return writeSlowly(static_cast<const char*>(data), size);
    std::memcpy(buffer_.get() + used_, data, size);
    used_ += size;
  }
  void write(std::string_view text) { write(text.data(), text.size()); }
  template <typename T>
  void writeValue(T value) {
    write(&value, sizeof value);
  }
  /// The shortest text that reads back as `value`, whatever the locale.
  void writeNumber(double value);
  void writeNumber(float value);
  void writeNumber(std::uint64_t value);

  /// Writes what is left and puts the file in place. @throws IoError
  void commit();

 private:
  static constexpr std::size_t kCapacity = 1 << 20;
  void writeSlowly(const char* data, std::size_t size);
  void flush();
  void deflateBuffer(bool finish);
  void put(const char* data, std::size_t size);

  struct Deflater;
  FileTarget target_;
  std::string name_;
  int fd_ = -1;
  std::unique_ptr<char[]> buffer_;
  std::size_t used_ = 0;
  std::unique_ptr<Deflater> deflater_;
};

}  // namespace levelset
