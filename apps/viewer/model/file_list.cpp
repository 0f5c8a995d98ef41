#include "apps/viewer/model/file_list.h"

#include <imgui/imgui.h>

#include <algorithm>
#include <system_error>

#include "apps/viewer/model/model.h"

namespace viewer {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOpenTitle = "Open a file";

}  // namespace

void FileList::show(const fs::path& place) {
  std::error_code wrong;
  const fs::path whole = fs::absolute(place.empty() ? "." : place, wrong);
  enter(fs::is_directory(whole, wrong)                 ? whole
        : fs::is_directory(whole.parent_path(), wrong) ? whole.parent_path()
                                                       : fs::path("."));
  isToOpen_ = true;
}

void FileList::enter(const fs::path& folder) {
  std::error_code wrong;
  fs::path whole = fs::weakly_canonical(folder, wrong);
  if (wrong) whole = folder;
  std::vector<fs::path> folders, files;
  fs::directory_iterator entry(whole, wrong);
  for (; !wrong && entry != fs::directory_iterator(); entry.increment(wrong)) {
    std::error_code ignored;
    const fs::path& path = entry->path();
    if (path.filename().string().starts_with(".")) continue;
    if (entry->is_directory(ignored))
      folders.push_back(path);
    else if (canOpen(path))
      files.push_back(path);
  }
  error_ = wrong ? "open: " + whole.string() + ": " + wrong.message() : "";
  if (wrong) return;  // keep the list of the previous folder
  std::sort(folders.begin(), folders.end());
  std::sort(files.begin(), files.end());
  folder_ = whole;
  folders_ = std::move(folders);
  files_ = std::move(files);
}

std::optional<fs::path> FileList::draw(bool isEscaped) {
  if (isToOpen_) ImGui::OpenPopup(kOpenTitle);
  isToOpen_ = false;
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowSize({std::min(560.0f, window.x), std::min(440.0f, window.y)},
                           ImGuiCond_Appearing);
  if (!ImGui::BeginPopupModal(kOpenTitle)) return std::nullopt;
  std::optional<fs::path> chosen, entered;
  ImGui::TextUnformatted(folder_.string().c_str());
  if (!error_.empty()) ImGui::TextWrapped("%s", error_.c_str());
  ImGui::BeginChild("entries", {0, -ImGui::GetFrameHeightWithSpacing()}, true);
  if (folder_.has_parent_path() && ImGui::Selectable("..")) entered = folder_.parent_path();
  for (const fs::path& folder : folders_)
    if (ImGui::Selectable((folder.filename().string() + "/").c_str())) entered = folder;
  for (const fs::path& file : files_)
    if (ImGui::Selectable(file.filename().string().c_str())) chosen = file;
  ImGui::EndChild();
  if (entered) enter(*entered);
  if (ImGui::Button("Cancel") || isEscaped || chosen) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
  return chosen;
}

}  // namespace viewer
