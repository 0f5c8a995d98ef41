#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "apps/viewer/editing/solid_model.h"
#include "apps/viewer/panel_parts.h"
#include "apps/viewer/viewer.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"

// Members of Viewer for the mode in which the user deforms the solid by control points.
namespace viewer {

void Viewer::toggleDeformEditor() {
  if (deformEditor_) {
    deformEditor_ = nullptr;
    deformWorker_ = nullptr;
    deformPreview_ = nullptr;
    showMessage("The deformation was put away.");
    return;
  }
  if (!model_) return;
  if (const std::string why = whyNoDeformation(*model_); !why.empty()) return showMessage(why);
  startDeformation(
      boxDesign(model_->solidBounds, model_->scene.solids.front().band.voxelSize(), boxLattice_));
}

void Viewer::startDeformation(const DeformDesign& design) {
  if (const std::string why = model_ ? whyNoDeformation(*model_) : "Open a solid first.";
      !why.empty())
    return showMessage(why);
  if (patchEditor_) togglePatchEditor();
  deformPreview_ = nullptr;
  deformEditor_ = std::make_unique<DeformEditor>(design);
  if (!deformWorker_) deformWorker_ = std::make_unique<DeformWorker>(model_, Window::wake);
  savedPoints_.clear();
  deformFile_ = design.isLattice() ? "lattice.json" : "moved.ply";
  std::snprintf(resultName_.data(), resultName_.size(), "%s", deformFile_.c_str());
  requestDeformPreview();
  showMessage("Drag control points. Shift selects several; x, y or z while dragging sets an axis.");
}

void Viewer::openDeformation(const std::filesystem::path& lattice) {
  try {
    const DeformDesign design = readLatticeDesign(lattice);
    startDeformation(design);
    if (!deformEditor_) return;
    deformFile_ = lattice;
    savedPoints_ = design.points();
    std::snprintf(resultName_.data(), resultName_.size(), "%s", deformFile_.c_str());
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

void Viewer::startGivenDeformation() {
  if (isGivenDeformation_ || !arguments_.givesDeformation()) return;
  isGivenDeformation_ = true;
  if (const std::string why = whyNoDeformation(*model_); !why.empty())
    throw levelset::InvalidInput("levelsmith-view: " + why);
  const bool isLattice = !arguments_.lattice.empty();
  const DeformDesign design =
      isLattice ? readLatticeDesign(arguments_.lattice)
                : readCageDesign(arguments_.cage, arguments_.movedCage, arguments_.cageCoordinates);
  startDeformation(design);
  deformFile_ = isLattice ? arguments_.lattice : arguments_.movedCage;
  if (deformFile_.empty()) deformFile_ = "moved.ply";
  if (isLattice || !arguments_.movedCage.empty()) savedPoints_ = design.points();
  std::snprintf(resultName_.data(), resultName_.size(), "%s", deformFile_.c_str());
}

void Viewer::requestDeformPreview() {
  if (deformWorker_) deformWorker_->request(deformEditor_->design(), deformEditor_->isDragging());
}

void Viewer::takeDeformPreview() {
  if (!deformWorker_) return;
  const std::shared_ptr<const DeformPreview> preview = deformWorker_->preview();
  if (!preview || preview == deformPreview_) return;
  deformPreview_ = preview;
  if (!preview->failure.empty())
    showMessage(preview->failure);
  else if (preview->certificate)
    showMessage(preview->certificateText() + (preview->isFine ? "; the solid is finished." : "."));
}

void Viewer::copyDeformation(bool isChain) {
  const DeformDesign& design = deformEditor_->design();
  const std::string text =
      isChain ? deformChain(*model_, design, deformFile_) : design.action(deformFile_);
  if (text.empty()) return showMessage("A chain needs a model from a level set or a mesh.");
  window_.setClipboard(text);
  showMessage(savedPoints_ == design.points()
                  ? "The action 'deform' was copied to the clipboard."
                  : fmt::format("The action 'deform' was copied to the clipboard. Write {} before "
                                "you run it: it does not have these control points.",
                                deformFile_.string()));
}

void Viewer::saveDeformation(const std::filesystem::path& name) {
  const DeformDesign& design = deformEditor_->design();
  if (name.extension() == design.extension()) {
    design.save(name);
    deformFile_ = name;
    savedPoints_ = design.points();
    return;
  }
  if (!levelset::isBandFormat(name))
    throw levelset::UsageError(fmt::format(
        "'{}' has no supported extension; use {} for the {}, or .vdb or .nvdb for the solid",
        name.string(), design.extension(), design.isLattice() ? "lattice" : "moved cage"));
  if (!deformPreview_ || !deformPreview_->isFine ||
      deformPreview_->design.points() != design.points())
    throw levelset::InvalidInput(
        "the solid is not finished; wait for it, or remove the folds of the deformation");
  levelset::writeBand(name, deformPreview_->model->scene.solids.front().band);
}

void Viewer::drawDeformPart() {
  if (!model_ || !beginPart("Deform")) return;
  bool isNew = false;
  if (!deformEditor_ || deformEditor_->design().isLattice()) {
    isNew = ImGui::Button(deformEditor_ ? "New lattice" : "Deform by a lattice");
    ImGui::SliderInt3("points", boxLattice_.count.data(), 2, kMostBoxCount, "%d",
                      ImGuiSliderFlags_AlwaysClamp);
    ImGui::SliderInt("degree", &boxLattice_.degree, 1, 5, "%d", ImGuiSliderFlags_AlwaysClamp);
  }
  if (isNew && !deformEditor_) return toggleDeformEditor();
  if (isNew)
    startDeformation(
        boxDesign(model_->solidBounds, model_->scene.solids.front().band.voxelSize(), boxLattice_));
  if (deformEditor_) drawDeformControls();
}

void Viewer::drawDeformControls() {
  DeformEditor& editor = *deformEditor_;
  ImGui::TextUnformatted(fmt::format("{} of {} control points selected", editor.selectedCount(),
                                     editor.design().points().size())
                             .c_str());
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  if (ImGui::RadioButton("free", !editor.axis())) editor.setAxis(std::nullopt);
  for (int axis = 0; axis < 3; ++axis) {
    ImGui::SameLine();
    ImGui::PushID(axis);
    if (ImGui::RadioButton(kAxes[static_cast<std::size_t>(axis)], editor.axis() == axis))
      editor.setAxis(axis);
    ImGui::PopID();
  }
  if (editor.design().isLattice()) {
    constexpr std::array<const char*, 3> kDirections = {"u", "v", "w"};
    ImGui::TextUnformatted("select layer");
    for (int axis = 0; axis < 3; ++axis) {
      ImGui::SameLine();
      if (ImGui::Button(kDirections[static_cast<std::size_t>(axis)])) editor.selectLayer(axis);
    }
  }
  bool isChanged = false;
  ImGui::BeginDisabled(!editor.canUndo());
  if (ImGui::Button("Undo")) isChanged = editor.undo();
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(!editor.canRedo());
  if (ImGui::Button("Redo")) isChanged = editor.redo();
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(!editor.design().hasRestPoints());
  if (ImGui::Button(editor.selectedCount() > 0 ? "Reset selected" : "Reset all"))
    isChanged = editor.reset() || isChanged;
  ImGui::EndDisabled();
  if (isChanged) requestDeformPreview();
  if (deformPreview_ && deformPreview_->certificate) {
    const ImVec4 colour =
        deformPreview_->isRefused() ? ImVec4(1, 0.45f, 0.4f, 1) : ImVec4(0.55f, 0.85f, 0.6f, 1);
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::TextWrapped("%s", deformPreview_->certificateText().c_str());
    ImGui::PopStyleColor();
  }
  if (ImGui::Button("Copy as command##deform")) copyDeformation(false);
  ImGui::SameLine();
  if (ImGui::Button("Copy chain##deform")) copyDeformation(true);
  if (ImGui::Button("Write##deform")) asksResult_ = true;
  ImGui::SameLine();
  if (ImGui::Button("Put away##deform")) toggleDeformEditor();
}

}  // namespace viewer
