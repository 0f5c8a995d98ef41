#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace viewer {

/// Folders and files that can be opened, to choose from in the window.
class FileList {
 public:
  /// Begins in a folder, or beside a file; in the current folder where that does not exist.
  void show(const std::filesystem::path& place);
  /// Draws the dialog while it is open. @return the file that was chosen
  std::optional<std::filesystem::path> draw(bool isEscaped);

 private:
  void enter(const std::filesystem::path& folder);

  bool isToOpen_ = false;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> folders_, files_;
  std::string error_;
};

}  // namespace viewer
