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

/// A file as a node left it: the same as long as nobody touched it.
struct FileStamp {
  std::string path;
  std::uint64_t size = 0, inode = 0, device = 0;
  std::int64_t changed = 0;  ///< ns
  [[nodiscard]] bool operator==(const FileStamp&) const = default;
};
/// @return nothing for what is no file
[[nodiscard]] std::optional<FileStamp> stampOf(const std::filesystem::path& file);

/// What running a node left behind, beside its value.
struct CachedStep {
  std::string action;
  StepNotes notes;
  std::string output;            ///< what it printed
  std::vector<FileStamp> files;  ///< that it wrote
};

/// Results by what they follow from, in a folder that several processes may share. Entries are
/// files that are written beside their place and renamed when whole; one that is damaged counts as
/// absent.
class Cache {
 public:
  struct Entry {
    std::string key, action;
    std::uint64_t bytes = 0;
    std::int64_t used = 0;  ///< ns since 1970
  };

  /// Makes the folder if there is none. @throws levelset::IoError
  explicit Cache(std::filesystem::path folder);

  /// Meshes, level sets and fields can be kept.
  [[nodiscard]] static bool canHold(Kind kind);
  [[nodiscard]] bool has(const std::string& key) const;
  /// @return nothing where there is none, or it is damaged
  [[nodiscard]] std::optional<CachedStep> step(const std::string& key) const;
  [[nodiscard]] std::optional<Value> value(const std::string& key, std::size_t maxMemory) const;
  /// Failures to write are told, and are none of the chain.
  /// @param value  none for what makes none
  /// @return       a sentence where it could not be kept
  [[nodiscard]] std::string put(const std::string& key, const CachedStep& step,
                                const Value* value) const;

  /// A text by a short name, for what is expensive to know of a file.
  [[nodiscard]] std::optional<std::string> memo(const std::string& name) const;
  void remember(const std::string& name, const std::string& text) const;

  /// The last used first.
  [[nodiscard]] std::vector<Entry> list() const;
  /// Removes the longest unused until no more than that are left, and what dead processes left.
  /// @return how many entries went
  std::size_t shrink(std::uint64_t mostBytes) const;

 private:
  [[nodiscard]] std::filesystem::path place(const std::string& key, const char* extension) const;
  [[nodiscard]] std::filesystem::path temporary() const;

  std::filesystem::path folder_;
};

}  // namespace pipeline
