#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace levelset {

/// Where an output file goes until it is whole: a temporary file beside the target, renamed over it
/// by commit() and removed by the destructor otherwise. Pipes, devices and symbolic links are written
/// through. "-" is standard output.
class FileTarget {
 public:
  /// @throws IoError when the folder is missing or not writable, the target is a directory, or it
  ///         exists and `clobber` is false
  explicit FileTarget(const std::filesystem::path& target, bool clobber = true);
  ~FileTarget();
  FileTarget(const FileTarget&) = delete;
  FileTarget& operator=(const FileTarget&) = delete;

  /// What to open and write: the temporary file, or the target itself when it is written through.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Flushes to disk and renames. @throws IoError when the disk is full or the rename fails
  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  bool writtenThrough_ = false;
  bool committed_ = false;
};

/// Removes every temporary file of this process at once. Safe to call from a thread that handles
/// a signal while others write; nothing is renamed afterwards.
void removeTemporaryFiles() noexcept;

/// True once every FileTarget should refuse to overwrite (`--no-clobber`).
void setClobberDefault(bool clobber);

}  // namespace levelset
