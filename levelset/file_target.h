#pragma once

#include <filesystem>
#include <string>

namespace levelset {

/// Writes an output file atomically. The data goes to a temporary file beside the target. commit()
/// renames the temporary file over the target. Without commit(), the destructor removes the
/// temporary file. An existing target keeps its permissions. A symbolic link stays, and the file
/// that it points to is replaced.
///
/// A file cannot be renamed over a pipe or device, including standard output ("-"). commit() copies
/// the temporary file into such a target. Writers may therefore seek on any target, and a reader
/// receives no data from a job that failed.
class FileTarget {
 public:
  /// @throws IoError when the folder is missing or not writable, or when the target is a directory,
  ///         a read-only file or a device that accepts no data. Also throws when the target exists
  ///         and `clobber` (or setClobberDefault) is false.
  explicit FileTarget(const std::filesystem::path& target, bool clobber = true);
  ~FileTarget();
  FileTarget(const FileTarget&) = delete;
  FileTarget& operator=(const FileTarget&) = delete;

  /// Path of the temporary file, which the caller opens and writes. It exists already and is empty.
  /// Its extension differs from that of the target, so choose the file format by the name of the
  /// target.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Flushes the temporary file to disk and renames it to the target, or copies it into a pipe or
  /// device. The caller closes its own streams on path() first.
  /// @throws IoError when the disk is full, the pipe has no reader or the rename fails
  /// @throws Cancelled after removeTemporaryFiles()
  void commit();

 private:
  void createTemporary(const std::filesystem::path& folder, std::string name);
  void copyToTarget();

  std::filesystem::path target_;     ///< target as the caller named it, for messages
  std::filesystem::path finalPath_;  ///< target with all links resolved
  std::filesystem::path path_;
  int descriptor_ = -1;  ///< descriptor of this process that the target names (/dev/stdout), or -1
  bool clobber_ = true;
  bool copiesToTarget_ = false;
  bool committed_ = false;
};

/// Returns true when the name stands for standard output: "-", /dev/stdout, /dev/fd/1 or a link to
/// one of these.
[[nodiscard]] bool isStandardOutput(const std::filesystem::path& target);

/// Canonical path of a file that need not exist, with all links and folders resolved. Empty for
/// "-", and for folders and devices. Several writers may share a device.
[[nodiscard]] std::filesystem::path canonicalFile(const std::filesystem::path& file);

/// Returns true when both names lead to the same file. The files need not exist. If one name is
/// "-", returns true when both stand for standard output. Otherwise returns false for devices,
/// which several writers may share.
[[nodiscard]] bool isSameFile(const std::filesystem::path& a, const std::filesystem::path& b);

/// Removes all temporary files of this process. A thread that handles a signal may call it while
/// other threads write. Afterwards constructor and commit() of every FileTarget throw Cancelled.
void removeTemporaryFiles() noexcept;

/// Allows or forbids to overwrite existing files in the entire process. With false
/// (`--no-clobber`), every FileTarget refuses an existing target, whatever its own `clobber`
/// argument.
void setClobberDefault(bool clobber);
[[nodiscard]] bool clobberDefault();

}  // namespace levelset
