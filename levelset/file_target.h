#pragma once

#include <filesystem>
#include <string>

namespace levelset {

/// Where an output file goes until it is whole: a temporary file beside the target, renamed over it
/// by commit() and removed by the destructor otherwise. An existing target keeps its permissions; a
/// symbolic link stays, and the file that it points to is replaced.
///
/// Pipes and devices, standard output ("-") among them, cannot be renamed over: what is written
/// goes to a temporary file first and is copied into them by commit(), so writers may seek whatever
/// the target is, and a reader sees nothing of a job that failed.
class FileTarget {
 public:
  /// @throws IoError when the folder is missing or not writable, the target is a directory or
  ///         read-only, it is a device that takes nothing, or it exists and `clobber` (or
  ///         setClobberDefault) is false
  explicit FileTarget(const std::filesystem::path& target, bool clobber = true);
  ~FileTarget();
  FileTarget(const FileTarget&) = delete;
  FileTarget& operator=(const FileTarget&) = delete;

  /// What to open and write: an empty file that exists already. Its name does not end as the
  /// target's does, so tell the format by the target.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Flushes to disk and renames, or copies into a pipe or device. The caller's own streams on
  /// path() must be closed before.
  /// @throws IoError when the disk is full, the pipe has no reader or the rename fails; Cancelled
  ///         after removeTemporaryFiles()
  void commit();

 private:
  void createTemporary(const std::filesystem::path& folder, std::string name);
  void copyThrough();

  std::filesystem::path target_;     ///< as the caller named it, for messages
  std::filesystem::path finalPath_;  ///< behind all links
  std::filesystem::path path_;
  int descriptor_ = -1;  ///< of this process, when the target names one (/dev/stdout)
  bool clobber_ = true;
  bool writtenThrough_ = false;
  bool committed_ = false;
};

/// Does the name stand for standard output: "-", /dev/stdout, /dev/fd/1 or a link to one of these?
[[nodiscard]] bool isStandardOutput(const std::filesystem::path& target);

/// The one name of a file that need not exist, behind all links and folders; empty for devices,
/// which take from many, and for "-".
[[nodiscard]] std::filesystem::path canonicalFile(const std::filesystem::path& file);

/// Do both names, of files that need not exist, lead to one and the same? Never of devices, which
/// take from many.
[[nodiscard]] bool isSameFile(const std::filesystem::path& a, const std::filesystem::path& b);

/// Removes every temporary file of this process at once. Safe to call from a thread that handles
/// a signal while others write; nothing is renamed or begun afterwards.
void removeTemporaryFiles() noexcept;

/// With false, every FileTarget refuses to overwrite an existing file (`--no-clobber`).
void setClobberDefault(bool clobber);
[[nodiscard]] bool clobberDefault();

}  // namespace levelset
