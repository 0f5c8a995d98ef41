#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace viewer {

/// Tells when files were changed by somebody.
class FileWatch {
 public:
  FileWatch() = default;
  /// Watches these from their present state on.
  explicit FileWatch(std::vector<std::filesystem::path> files);

  /// True once after one of them has been written or replaced and lies still since the last call:
  /// it may be in the middle of being written otherwise. One that is removed counts when it is
  /// back.
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
