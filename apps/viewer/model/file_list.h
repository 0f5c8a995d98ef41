#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace viewer {

/// Dialog that lists the subfolders of a folder, and those of its files that the viewer can open.
class FileList {
 public:
  /// Opens the dialog in the folder `place`, or in the folder of the file `place`. If that folder
  /// does not exist, it opens in the working directory.
  void show(const std::filesystem::path& place);
  /// Draws the dialog if it is open. @param isEscaped  the user pressed Escape, which closes it
  /// @return the file that the user has just chosen, or nothing
  std::optional<std::filesystem::path> draw(bool isEscaped);

 private:
  void enter(const std::filesystem::path& folder);

  bool isToOpen_ = false;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> folders_, files_;
  std::string error_;
};

}  // namespace viewer
