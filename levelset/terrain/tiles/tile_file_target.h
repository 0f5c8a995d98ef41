#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "levelset/file_target.h"

namespace levelset::terrain {

/// A file that grows at its end, and whose bytes can be read again before it is complete. It
/// replaces the target on commit() only.
class TileFileTarget {
 public:
  /// @throws IoError
  explicit TileFileTarget(const std::filesystem::path& target);
  ~TileFileTarget();
  TileFileTarget(const TileFileTarget&) = delete;
  TileFileTarget& operator=(const TileFileTarget&) = delete;

  /// Number of bytes so far.
  [[nodiscard]] std::uint64_t size() const { return written_ + waiting_.size(); }
  /// Appends bytes. @throws IoError
  void append(std::string_view bytes);
  /// Writes the bytes that wait in memory. @throws IoError
  void flush();
  /// Reads bytes that are flushed. Several threads may read. @throws IoError
  [[nodiscard]] std::string read(std::uint64_t offset, std::size_t bytes) const;
  /// Replaces the first bytes, and completes the file. @throws IoError, Cancelled
  void commit(std::string_view firstBytes);

 private:
  void writeAt(std::uint64_t offset, std::string_view bytes);
  [[noreturn]] void fail(const char* what) const;

  FileTarget target_;
  std::string name_;
  std::string waiting_;
  std::uint64_t written_ = 0;
  int descriptor_ = -1;
};

}  // namespace levelset::terrain
