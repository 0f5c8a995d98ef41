#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace viewer {

/// Dialog that lists folders and readable files.
class FileList {
 public:
  /// Opens the dialog in a folder, or in the folder of a file; in the current folder if that does
  /// not exist.
  void show(const std::filesystem::path& place);
  /// Draws the dialog while it is open. @return the chosen file
  std::optional<std::filesystem::path> draw(bool isEscaped);

 private:
  void enter(const std::filesystem::path& folder);

  bool isToOpen_ = false;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> folders_, files_;
  std::string error_;
};

}  // namespace viewer
