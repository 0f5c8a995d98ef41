#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <cstdio>

#include "apps/viewer/viewer.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "mapping/patches/patch_file.h"

// Members of Viewer for the mode in which the user makes a patch.
namespace viewer {

void Viewer::togglePatchEditor() {
  if (patchEditor_) {
    patchEditor_ = nullptr;
    patchWorker_ = nullptr;
    patchPreview_ = nullptr;
    showMessage("The patch was put away.");
    return;
  }
  if (!model_) return;
  if (const std::string why = whyNoPatch(*model_); !why.empty()) return showMessage(why);
  if (deformEditor_) toggleDeformEditor();
  std::snprintf(resultName_.data(), resultName_.size(), "textured.vdb");
  patchEditor_ = std::make_unique<PatchEditor>(model_);
  patchWorker_ = std::make_unique<PatchWorker>(model_, Window::wake);
  patchPreview_ = nullptr;
  showMessage("Press on the surface to place a corner, and drag it. Four corners make a patch.");
}

void Viewer::requestPatchPreview() {
  if (patchWorker_) patchWorker_->request(patchEditor_->design(), patchEditor_->isDragging());
}

void Viewer::takePatchPreview() {
  if (!patchWorker_) return;
  const std::shared_ptr<const PatchPreview> preview = patchWorker_->preview();
  if (!preview || preview == patchPreview_) return;
  patchPreview_ = preview;
  // The preview may be of an older design, with other corners.
  const PatchDesign& design = patchEditor_->design();
  if (preview->design.corners == design.corners && preview->design.sides == design.sides)
    patchEditor_->setSides(preview->sides);
  if (!preview->failure.empty())
    showMessage(preview->failure);
  else if (preview->isFine && preview->patch)
    showMessage(fmt::format("The patch has {} particles and a height of {:.4g}.",
                            preview->patch->particleCount(), preview->height));
  else if (!preview->design.isWhole())
    showMessage(fmt::format("{} of 4 corners.", preview->design.corners.size()));
}

void Viewer::copyPatch(bool isChain) {
  if (!patchPreview_) return;
  const std::string& text = isChain ? patchPreview_->chainText : patchPreview_->patchText;
  if (text.empty())
    return showMessage(isChain ? "A chain needs four corners, a texture, and a model from a level "
                                 "set or a mesh."
                               : "A patch needs four corners.");
  window_.setClipboard(text);
  showMessage(isChain ? "The chain of actions was copied to the clipboard."
                      : "The action 'patch' was copied to the clipboard.");
}

void Viewer::savePatch(const std::filesystem::path& name) {
  if (!patchPreview_ || !patchPreview_->isFine || !patchPreview_->patch)
    throw levelset::InvalidInput("the patch is not finished yet; wait for it");
  if (mapping::isPatchFormat(name.string())) {
    mapping::writePatches(name, {&*patchPreview_->patch, 1});
  } else if (levelset::isBandFormat(name)) {
    if (!patchPreview_->model)
      throw levelset::InvalidInput("the patch has no texture; choose one, or name a .patch file");
    levelset::writeBand(name, patchPreview_->model->scene.solids.front().band);
  } else {
    throw levelset::UsageError(fmt::format(
        "'{}' has no supported extension; use .vdb or .nvdb for the textured solid, or .patch",
        name.string()));
  }
}

void Viewer::drawPatchEditorPart() {
  if (!model_ || !ImGui::CollapsingHeader("New patch", ImGuiTreeNodeFlags_DefaultOpen)) return;
  if (!patchEditor_) {
    if (ImGui::Button("Make a patch")) togglePatchEditor();
    return;
  }
  PatchDesign changed = patchEditor_->design();
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
  if (!(changed == patchEditor_->design())) {
    patchEditor_->setTexture(changed);
    requestPatchPreview();
  }
  if (ImGui::Button("Copy as command")) copyPatch(false);
  ImGui::SameLine();
  if (ImGui::Button("Copy chain")) copyPatch(true);
  if (ImGui::Button("Write")) asksResult_ = true;
  ImGui::SameLine();
  if (ImGui::Button("Put away")) togglePatchEditor();
}

}  // namespace viewer
