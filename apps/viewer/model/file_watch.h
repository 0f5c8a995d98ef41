#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace viewer {

/// Detects changes of files on disk by their time and size.
class FileWatch {
 public:
  FileWatch() = default;
  /// Starts to watch files. Changes are relative to their present state.
  explicit FileWatch(std::vector<std::filesystem::path> files);

  /// Returns true once after a file has been written or replaced. It waits until no file has
  /// changed since the previous call, because a program may still be writing. A removed file counts
  /// as changed when it exists again.
  [[nodiscard]] bool hasChanged();
  /// True when a file did not exist in the last call of hasChanged().
  [[nodiscard]] bool isAnyMissing() const;

 private:
  struct State {
    std::filesystem::file_time_type time{};
    std::uintmax_t size = 0;
    bool isThere = false;
    bool operator==(const State&) const = default;
  };
  [[nodiscard]] static State stateOf(const std::filesystem::path& file);

  std::vector<std::filesystem::path> files_;
  std::vector<State> known_, last_;
};

}  // namespace viewer
