#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace viewer {

/// Detects changes of files.
class FileWatch {
 public:
  FileWatch() = default;
  /// Starts to watch these files from their present state on.
  explicit FileWatch(std::vector<std::filesystem::path> files);

  /// Returns true once after a file has been written or replaced and has not changed since the
  /// previous call. Otherwise it may still be in the middle of being written. A removed file counts
  /// as changed when it is back.
  [[nodiscard]] bool hasChanged();
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
