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

// Private to levelset/files, mesh_files, point_files, volume_files and terrain: reads and writes
// complete files in memory, with or without gzip compression.

namespace levelset {

/// A block of bytes that grows in place, without initialisation.
class Bytes {
 public:
  [[nodiscard]] const char* data() const { return data_.get(); }
  [[nodiscard]] char* data() { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::string_view view() const { return {data_.get(), size_}; }
  /// @throws ResourceLimit when the memory cannot be allocated
  void resize(std::size_t size);

 private:
  struct Free {
    void operator()(char* p) const { std::free(p); }
  };
  std::unique_ptr<char, Free> data_;
  std::size_t size_ = 0;
};

/// Reads a file, or standard input for "-". Detects gzip data by its first bytes and decompresses
/// it.
/// @throws IoError when the file cannot be opened or read
/// @throws InvalidInput when the file is empty or its compressed data is damaged
/// @throws ResourceLimit as soon as the bytes exceed `maxMemory` or the machine's memory
[[nodiscard]] Bytes readBytes(const std::filesystem::path& path, std::size_t maxMemory);

/// A file mapped into memory, so that only the pages in use are loaded. Reads the file as readBytes
/// does where mapping is impossible (pipes, standard input, gzip data).
class MappedFile {
 public:
  /// @throws as readBytes
  /// @param inflates  false: leaves gzip data as it is in the file
  explicit MappedFile(const std::filesystem::path& path, std::size_t maxMemory = kNoMemoryLimit,
                      bool inflates = true);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  [[nodiscard]] std::string_view view() const;
  /// Returns false if the bytes were read into memory.
  [[nodiscard]] bool isMapped() const { return mapped_ != nullptr; }
  /// Releases the pages before a byte offset from memory. They are loaded again when they are read
  /// again. Does nothing until many pages have been passed since the last call.
  void release(std::size_t end);

 private:
  Bytes read_;
  void* mapped_ = nullptr;
  std::size_t size_ = 0, released_ = 0;
};

/// The first bytes of a file, decompressed if necessary. Damage behind these bytes is not detected.
struct FirstBytes {
  Bytes bytes;
  std::size_t fileSize = 0;  ///< size of the complete data, decompressed, in bytes; 0 when unknown
};
/// Reads the first bytes of a file.
/// @param count  maximum number of bytes
[[nodiscard]] FirstBytes readFirstBytes(const std::filesystem::path& path, std::size_t count);

/// Decompresses gzip or zlib data, up to a number of bytes. Data behind these bytes is ignored.
/// @param name   name of the input in messages
/// @param count  maximum number of bytes of the result
/// @throws InvalidInput when the compressed data is damaged
/// @throws ResourceLimit when the memory cannot be allocated
[[nodiscard]] Bytes decompress(std::string_view compressed, const std::string& name,
                               std::size_t count);
/// Returns true when the bytes begin as gzip data does.
[[nodiscard]] bool isGzipData(std::string_view bytes);

/// Name of the input in messages: the file name in quotes, or "standard input".
[[nodiscard]] std::string inputName(const std::filesystem::path& path);

/// Buffered, checked writer to a FileTarget, with optional gzip compression. Equal input gives
/// equal bytes: the gzip header contains neither time stamp nor name.
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
  /// Writes the shortest text that reads back as `value`, in any locale.
  void writeNumber(double value);
  void writeNumber(float value);
  void writeNumber(std::uint64_t value);

  /// Writes the bytes still in the buffer and completes the file. @throws IoError
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
