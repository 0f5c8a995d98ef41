#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>

#include "apps/viewer/viewer.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "mapping/patches/patch_file.h"

// Members of Viewer for the mode in which the user makes a patch.
namespace viewer {

std::shared_ptr<const Model> Viewer::shownModel() const {
  return editor_ && preview_ && preview_->model ? preview_->model : model_;
}

void Viewer::togglePatchEditor() {
  if (editor_) {
    editor_ = nullptr;
    worker_ = nullptr;
    preview_ = nullptr;
    showMessage("The patch was put away.");
    return;
  }
  if (!model_) return;
  if (const std::string why = whyNoPatch(*model_); !why.empty()) return showMessage(why);
  editor_ = std::make_unique<PatchEditor>(model_);
  worker_ = std::make_unique<PatchWorker>(model_, Window::wake);
  preview_ = nullptr;
  showMessage("Press on the surface to place a corner, and drag it. Four corners make a patch.");
}

void Viewer::restartPatchEditor(bool keepsDesign) {
  if (!editor_) return;
  const PatchDesign design = editor_->design();
  editor_ = nullptr;
  worker_ = nullptr;
  preview_ = nullptr;
  if (!keepsDesign || !whyNoPatch(*model_).empty()) return;
  editor_ = std::make_unique<PatchEditor>(model_, design);
  worker_ = std::make_unique<PatchWorker>(model_, Window::wake);
  requestPreview();
}

void Viewer::requestPreview() {
  if (worker_) worker_->request(editor_->design(), editor_->isDragging());
}

void Viewer::takePreview() {
  if (!worker_) return;
  const std::shared_ptr<const PatchPreview> preview = worker_->preview();
  if (!preview || preview == preview_) return;
  preview_ = preview;
  // The preview may be of an older design, with other corners.
  const PatchDesign& design = editor_->design();
  if (preview->design.corners == design.corners && preview->design.sides == design.sides)
    editor_->setSides(preview->sides);
  if (!preview->failure.empty())
    showMessage(preview->failure);
  else if (preview->isFine && preview->patch)
    showMessage(fmt::format("The patch has {} particles and a height of {:.4g}.",
                            preview->patch->particleCount(), preview->height));
  else if (!preview->design.isWhole())
    showMessage(fmt::format("{} of 4 corners.", preview->design.corners.size()));
}

void Viewer::copyPatch(bool isChain) {
  if (!preview_) return;
  const std::string& text = isChain ? preview_->chainText : preview_->patchText;
  if (text.empty())
    return showMessage(isChain ? "A chain needs four corners, a texture, and a model from a level "
                                 "set or a mesh."
                               : "A patch needs four corners.");
  window_.setClipboard(text);
  showMessage(isChain ? "The chain of actions was copied to the clipboard."
                      : "The action 'patch' was copied to the clipboard.");
}

void Viewer::saveResult() {
  const std::filesystem::path name(resultName_.data());
  try {
    if (!preview_ || !preview_->isFine || !preview_->patch)
      throw levelset::InvalidInput("the patch is not finished yet; wait for it");
    if (mapping::isPatchFormat(name.string())) {
      mapping::writePatches(name, {&*preview_->patch, 1});
    } else if (levelset::isBandFormat(name)) {
      if (!preview_->model)
        throw levelset::InvalidInput("the patch has no texture; choose one, or name a .patch file");
      levelset::writeBand(name, preview_->model->scene.solids.front().band);
    } else {
      throw levelset::UsageError(fmt::format(
          "'{}' has no supported extension; use .vdb or .nvdb for the textured solid, or .patch",
          name.string()));
    }
    showMessage(fmt::format("{} was written.", name.string()));
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

void Viewer::drawPatchEditorPart() {
  if (!model_ || !ImGui::CollapsingHeader("New patch", ImGuiTreeNodeFlags_DefaultOpen)) return;
  if (!editor_) {
    if (ImGui::Button("Make a patch")) togglePatchEditor();
    return;
  }
  PatchDesign changed = editor_->design();
  if (ImGui::BeginCombo("texture", textureName(changed.texture))) {
    for (const TextureKind kind : kTextureKinds)
      if (ImGui::Selectable(textureName(kind), kind == changed.texture)) changed.texture = kind;
    ImGui::EndCombo();
  }
  if (changed.texture != TextureKind::None)
    ImGui::SliderInt("columns", &changed.columns, 1, 40, "%d", ImGuiSliderFlags_AlwaysClamp);
  constexpr double kLow = 0.1, kHigh = 3;
  ImGui::SliderScalar("height", ImGuiDataType_Double, &changed.relief, &kLow, &kHigh, "%.2f",
                      ImGuiSliderFlags_AlwaysClamp);
  if (!(changed == editor_->design())) {
    editor_->setTexture(changed);
    requestPreview();
  }
  if (ImGui::Button("Copy as command")) copyPatch(false);
  ImGui::SameLine();
  if (ImGui::Button("Copy chain")) copyPatch(true);
  if (ImGui::Button("Write")) asksResult_ = true;
  ImGui::SameLine();
  if (ImGui::Button("Put away")) togglePatchEditor();
}

void Viewer::drawPatchLines(int width, int height) {
  if (!editor_) return;
  const render::Camera camera = camera_.camera(width, height);
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const auto placeOf = [&](const Imath::V2d& at) {
    return ImVec2(static_cast<float>(at.x) * window.x / static_cast<float>(width),
                  static_cast<float>(at.y) * window.y / static_cast<float>(height));
  };
  const bool isWrong = preview_ && !preview_->failure.empty();
  const auto lineColour = [&](bool isBehind) {
    const int alpha = isBehind ? 50 : 255;
    return isWrong ? IM_COL32(235, 64, 52, alpha) : IM_COL32(12, 158, 153, alpha);
  };
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (const PatchEditor::Stroke& stroke : editor_->strokes(camera))
    list.AddLine(placeOf(stroke.from), placeOf(stroke.to), lineColour(stroke.isBehind), 2.5f);
  for (const PatchEditor::Mark& mark : editor_->marks(camera)) {
    const int alpha = mark.isBehind ? 70 : 255;
    const float radius = mark.isCorner ? 6 : 4.5f;
    list.AddCircleFilled(placeOf(mark.place), radius + 1.5f, IM_COL32(20, 20, 20, alpha));
    list.AddCircleFilled(
        placeOf(mark.place), radius,
        mark.isSelected ? IM_COL32(255, 196, 60, alpha) : IM_COL32(240, 240, 235, alpha));
  }
}

void Viewer::drawResultDialog() {
  constexpr const char* kTitle = "Write the patch or the textured solid";
  if (asksResult_) ImGui::OpenPopup(kTitle);
  asksResult_ = false;
  if (!ImGui::BeginPopupModal(kTitle, nullptr, ImGuiWindowFlags_AlwaysAutoResize)) return;
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  ImGui::InputText("name (.vdb, .patch)", resultName_.data(), resultName_.size());
  if (ImGui::Button("Write") || isEntered_) {
    saveResult();
    ImGui::CloseCurrentPopup();
  }
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || isEscaped_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

}  // namespace viewer
