#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/value.h"

namespace pipeline {

/// Path and state of a regular file at one moment. A comparison with a later stamp shows if the
/// file changed in between.
struct FileStamp {
  std::string path;  ///< absolute path
  std::uint64_t size = 0, inode = 0, device = 0;
  std::int64_t changed = 0;  ///< modification time, ns
  [[nodiscard]] bool operator==(const FileStamp&) const = default;
};
/// @return the current stamp of a regular file; empty if the path names anything else
[[nodiscard]] std::optional<FileStamp> stampOf(const std::filesystem::path& file);

/// Everything that a run of a node produced, except its value.
struct CachedStep {
  std::string action;
  StepNotes notes;
  std::string output;            ///< text that the action printed for the user
  std::vector<FileStamp> files;  ///< files that the node wrote
};

/// A folder of results, each stored under a key that hashes all inputs of the result. Several
/// processes may share the folder. Each entry is written to a temporary file and renamed when
/// complete. A damaged entry counts as absent.
class Cache {
 public:
  struct Entry {
    std::string key, action;
    std::uint64_t bytes = 0;
    std::int64_t used = 0;  ///< time of last use, ns since 1970
  };

  /// Opens the folder, or creates it.
  /// @throws levelset::IoError if it cannot be created or written
  explicit Cache(std::filesystem::path folder);

  /// Decides if values of a kind can be stored: meshes, level sets and fields can.
  [[nodiscard]] static bool canHold(Kind kind);
  [[nodiscard]] bool has(const std::string& key) const;
  /// Reads everything that was stored with a result, except its value.
  /// @return empty if there is no entry or the entry is damaged
  [[nodiscard]] std::optional<CachedStep> step(const std::string& key) const;
  /// Reads the value of a result.
  /// @param maxMemory  limit for the value, bytes
  /// @return empty if there is no value or the entry is damaged
  /// @throws levelset::ResourceLimit if the value exceeds the limit
  [[nodiscard]] std::optional<Value> value(const std::string& key, std::size_t maxMemory) const;
  /// Stores a result. A write failure is returned as a message and does not fail the run.
  /// @param value  null for a node without a value
  /// @return       error message; empty if the result was stored
  [[nodiscard]] std::string put(const std::string& key, const CachedStep& step,
                                const Value* value) const;

  /// Reads a short text that remember() stored under a name; empty if there is none. Such a text is
  /// the digest of an input file, which saves reading the file again.
  [[nodiscard]] std::optional<std::string> memo(const std::string& name) const;
  /// Stores a short text under a name. Ignores write failures.
  void remember(const std::string& name, const std::string& text) const;

  /// Lists the entries, most recently used first.
  [[nodiscard]] std::vector<Entry> list() const;
  /// Removes the least recently used entries until at most `mostBytes` remain. Also removes damaged
  /// entries and temporary files of processes that no longer run.
  /// @return number of removed entries
  std::size_t shrink(std::uint64_t mostBytes) const;

 private:
  [[nodiscard]] std::filesystem::path entryPath(const std::string& key,
                                                const char* extension) const;
  [[nodiscard]] std::filesystem::path temporary() const;

  std::filesystem::path folder_;
};

}  // namespace pipeline
