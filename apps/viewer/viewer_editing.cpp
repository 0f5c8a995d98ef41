#include <fmt/core.h>
#include <imgui/imgui.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "apps/viewer/viewer.h"
#include "levelset/error.h"

// Members of Viewer that the modes share in which the user makes a patch or deforms the solid.
namespace viewer {

std::shared_ptr<const Model> Viewer::shownModel() const {
  if (patchEditor_ && patchPreview_ && patchPreview_->model) return patchPreview_->model;
  if (deformEditor_ && deformPreview_ && deformPreview_->model) return deformPreview_->model;
  if (sculptModel_) return sculptModel_;
  return model_;
}

void Viewer::restartEditors(bool keepsDesign) {
  if (patchEditor_) {
    const PatchDesign design = patchEditor_->design();
    patchEditor_ = nullptr;
    patchWorker_ = nullptr;
    patchPreview_ = nullptr;
    if (keepsDesign && whyNoPatch(*model_).empty()) {
      patchEditor_ = std::make_unique<PatchEditor>(model_, design);
      patchWorker_ = std::make_unique<PatchWorker>(model_, Window::wake);
      requestPatchPreview();
    }
  }
  if (deformEditor_) {
    deformWorker_ = nullptr;
    deformPreview_ = nullptr;
    if (keepsDesign && whyNoDeformation(*model_).empty()) {
      deformWorker_ = std::make_unique<DeformWorker>(model_, Window::wake);
      requestDeformPreview();
    } else {
      deformEditor_ = nullptr;
    }
  }
  if (sculptEditor_) {
    // Strokes belong to the heights before them, which may have changed.
    const std::string kept = keepUnsavedStrokes();
    sculptEditor_ = nullptr;
    sculptModel_ = nullptr;
    if (keepsDesign && whyNoSculpting(*model_).empty()) startSculpting();
    if (!kept.empty()) showMessage(kept);
  }
  startGivenDeformation();
}

bool Viewer::pressEditor(const Imath::V2d& place, const render::Camera& camera, bool isAdding) {
  if (patchEditor_ && !isAdding && patchEditor_->press(place, camera)) {
    requestPatchPreview();
    return true;
  }
  if (sculptEditor_ && !isAdding) return pressSculpting(place, camera);
  return deformEditor_ && deformEditor_->press(place, camera, isAdding);
}

void Viewer::moveEditor(const Imath::V2d& place, const render::Camera& camera) {
  if (patchEditor_ && patchEditor_->moveTo(place, camera)) requestPatchPreview();
  if (deformEditor_ && deformEditor_->moveTo(place, camera)) requestDeformPreview();
  if (sculptEditor_) moveSculpting(place, camera);
}

void Viewer::releaseEditor() {
  if (sculptEditor_) sculptEditor_->release();
  if (patchEditor_) {
    patchEditor_->release();
    requestPatchPreview();
  }
  if (deformEditor_) {
    deformEditor_->release();
    // A click that only selects leaves the finished solid.
    if (!deformPreview_ || !deformPreview_->isFine ||
        deformPreview_->design.points() != deformEditor_->design().points())
      requestDeformPreview();
  }
}

bool Viewer::pressForEditor(unsigned character) {
  if (sculptEditor_) return pressForSculpting(character);
  if (!deformEditor_) return false;
  if (deformEditor_->isDragging() && character >= 'x' && character <= 'z') {
    const int axis = static_cast<int>(character - 'x');
    deformEditor_->setAxis(deformEditor_->axis() == axis ? std::optional<int>() : axis);
    return true;
  }
  if (character != 'a') return false;
  deformEditor_->selectedCount() > 0 ? deformEditor_->selectNone() : deformEditor_->selectAll();
  return true;
}

bool Viewer::pressForEditor(const KeyPress& key) {
  if (patchEditor_ && key.key == GLFW_KEY_BACKSPACE) {
    if (patchEditor_->removeSelected()) requestPatchPreview();
    return true;
  }
  if (sculptEditor_ && key.withControl && (key.key == GLFW_KEY_Z || key.key == GLFW_KEY_Y)) {
    stepSculpting(key.key == GLFW_KEY_Z);
    return true;
  }
  if (!deformEditor_) return false;
  if (key.key == GLFW_KEY_BACKSPACE && !deformEditor_->design().hasRestPoints())
    showMessage("A lattice with weights has no control points at rest; undo moves them back.");
  const bool isUndo = key.withControl && key.key == GLFW_KEY_Z,
             isRedo = key.withControl && key.key == GLFW_KEY_Y;
  if (key.key == GLFW_KEY_BACKSPACE ? deformEditor_->reset()
      : isUndo                      ? deformEditor_->undo()
                                    : isRedo && deformEditor_->redo())
    requestDeformPreview();
  return isUndo || isRedo || key.key == GLFW_KEY_BACKSPACE;
}

void Viewer::takePreviews() {
  takePatchPreview();
  takeDeformPreview();
}

void Viewer::copyCommand(bool isChain) {
  if (patchEditor_) copyPatch(isChain);
  if (deformEditor_) copyDeformation(isChain);
  if (sculptEditor_) copySculpting(isChain);
}

void Viewer::saveResult() {
  if (!isEditing()) return;
  const std::filesystem::path name(resultName_.data());
  try {
    if (patchEditor_) savePatch(name);
    if (deformEditor_) saveDeformation(name);
    if (sculptEditor_) saveSculpting(name);
    showMessage(fmt::format("{} was written.", name.string()));
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

void Viewer::drawControls(int width, int height) {
  if (!isEditing()) return;
  const render::Camera camera = camera_.camera(width, height);
  if (patchEditor_)
    drawMarksOf(patchEditor_->strokes(camera), patchEditor_->marks(camera),
                patchPreview_ && !patchPreview_->failure.empty(), width, height);
  if (sculptEditor_) drawMarksOf(sculptEditor_->strokes(camera), {}, false, width, height);
  if (!deformEditor_) return;
  const bool isRefused = deformPreview_ && deformPreview_->isRefused();
  drawMarksOf(deformEditor_->strokes(camera), deformEditor_->marks(camera), isRefused, width,
              height);
  if (!isRefused || deformPreview_->certificate->verdict == levelset::FoldVerdict::Certified)
    return;
  // The place of the fold, after the deformation.
  const Imath::V3d place =
      deformPreview_->design.deformation()->at(deformPreview_->certificate->place);
  const std::optional<Imath::V2d> at = seenAt(place, camera);
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  if (at)
    ImGui::GetBackgroundDrawList()->AddCircle(
        {static_cast<float>(at->x) * window.x / static_cast<float>(width),
         static_cast<float>(at->y) * window.y / static_cast<float>(height)},
        11, IM_COL32(235, 64, 52, 255), 0, 3);
}

void Viewer::drawMarksOf(const std::vector<PictureStroke>& strokes,
                         const std::vector<PictureMark>& marks, bool isWrong, int width,
                         int height) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const auto placeOf = [&](const Imath::V2d& at) {
    return ImVec2(static_cast<float>(at.x) * window.x / static_cast<float>(width),
                  static_cast<float>(at.y) * window.y / static_cast<float>(height));
  };
  const auto lineColour = [&](bool isBehind) {
    const int alpha = isBehind ? (deformEditor_ ? 110 : 50) : 255;
    return isWrong ? IM_COL32(235, 64, 52, alpha) : IM_COL32(12, 158, 153, alpha);
  };
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (const PictureStroke& stroke : strokes)
    list.AddLine(placeOf(stroke.from), placeOf(stroke.to), lineColour(stroke.isBehind),
                 deformEditor_ ? 1.5f : 2.5f);
  for (const PictureMark& mark : marks) {
    const int alpha = mark.isBehind ? 70 : 255;
    const float radius = mark.isCorner ? 6 : 4.5f;
    list.AddCircleFilled(placeOf(mark.place), radius + 1.5f, IM_COL32(20, 20, 20, alpha));
    list.AddCircleFilled(
        placeOf(mark.place), radius,
        mark.isSelected ? IM_COL32(255, 196, 60, alpha) : IM_COL32(240, 240, 235, alpha));
  }
}

void Viewer::drawResultDialog() {
  constexpr const char* kTitle = "Write the result";
  if (asksResult_) ImGui::OpenPopup(kTitle);
  asksResult_ = false;
  if (!ImGui::BeginPopupModal(kTitle, nullptr, ImGuiWindowFlags_AlwaysAutoResize)) return;
  // A file that was dropped, or has changed, ends the mode while the dialog is open.
  if (!isEditing()) {
    ImGui::CloseCurrentPopup();
    return ImGui::EndPopup();
  }
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  const char* label = patchEditor_    ? "name (.vdb, .patch)"
                      : deformEditor_ ? "name (.json, .ply, .vdb)"
                                      : "name (.edits)";
  ImGui::InputText(label, resultName_.data(), resultName_.size());
  if (ImGui::Button("Write") || isEntered_) {
    saveResult();
    ImGui::CloseCurrentPopup();
  }
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || isEscaped_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

}  // namespace viewer
