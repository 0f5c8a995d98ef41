#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "apps/viewer/editing/solid_model.h"
#include "apps/viewer/panel_parts.h"
#include "apps/viewer/viewer.h"
#include "levelset/error.h"
#include "levelset/terrain/sculpt/ground_edits.h"

// Members of Viewer for the mode in which the user sculpts a terrain.
namespace viewer {
namespace {

constexpr double kRadiusStep = 1.25;

/// File of the edits beside the data.
std::filesystem::path editsBeside(const Model& model) {
  std::filesystem::path file = model.files.front();
  return file.replace_extension(".edits");
}

}  // namespace

void Viewer::toggleSculptEditor() {
  if (sculptEditor_) {
    const std::string kept = keepUnsavedStrokes();
    sculptEditor_ = nullptr;
    sculptModel_ = nullptr;
    showMessage(kept.empty() ? "Sculpting has ended." : kept);
    return;
  }
  if (!model_) return;
  if (const std::string why = whyNoSculpting(*model_); !why.empty()) return showMessage(why);
  startSculpting();
}

std::string Viewer::keepUnsavedStrokes() const {
  if (!sculptEditor_ || !sculptEditor_->hasUnsaved()) return "";
  std::filesystem::path file = editsFile_;
  file.replace_extension(".unsaved.edits");
  try {
    levelset::writeGroundEdits(file, sculptEditor_->edits());
    return fmt::format("The strokes that were not written are in {}.", file.string());
  } catch (const std::exception& error) {
    return fmt::format("The strokes that were not written are lost: {}", error.what());
  }
}

void Viewer::startSculpting() {
  editsFile_ = editsBeside(*model_);
  hasEditsFile_ = std::filesystem::exists(editsFile_);
  try {
    std::optional<levelset::GroundEdits> edits;
    if (hasEditsFile_) edits = levelset::readGroundEdits(editsFile_);
    sculptEditor_ = std::make_unique<SculptEditor>(model_, edits ? &*edits : nullptr);
  } catch (const std::exception& error) {
    return showMessage(fmt::format("{}: {}", editsFile_.string(), error.what()));
  }
  hadEdits_ = hasEditsFile_;
  std::snprintf(resultName_.data(), resultName_.size(), "%s", editsFile_.c_str());
  takeSculpted();
  showMessage(hasEditsFile_
                  ? fmt::format("The edits in {} were applied. Press on the ground to sculpt it.",
                                editsFile_.string())
                  : "Press on the ground to sculpt it. The keys 1 to 6 choose a brush.");
}

void Viewer::takeSculpted() {
  sculptModel_ = sculptEditor_->model();
}

bool Viewer::pressSculpting(const Imath::V2d& place, const render::Camera& camera) {
  try {
    if (!sculptEditor_->press(place, camera)) return false;
    takeSculpted();
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
  return true;
}

void Viewer::moveSculpting(const Imath::V2d& place, const render::Camera& camera) {
  try {
    if (sculptEditor_->moveTo(place, camera)) takeSculpted();
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

bool Viewer::pressForSculpting(unsigned character) {
  BrushChoice choice = sculptEditor_->choice();
  const auto number = static_cast<std::size_t>(character - '1');
  if (character >= '1' && number < kBrushes.size())
    choice.brush = kBrushes[number];
  else if (character == '[')
    choice.radius /= kRadiusStep;
  else if (character == ']')
    choice.radius *= kRadiusStep;
  else
    return false;
  sculptEditor_->setChoice(choice);
  showMessage(fmt::format("Brush: {}, radius {:.4g}.", brushName(sculptEditor_->choice().brush),
                          sculptEditor_->choice().radius));
  return true;
}

void Viewer::stepSculpting(bool isUndo) {
  if (isUndo ? sculptEditor_->undo() : sculptEditor_->redo()) takeSculpted();
}

void Viewer::copySculpting(bool isChain) {
  std::string text = sculptEditor_->actions();
  if (isChain || hadEdits_) {
    // The file has the earlier edits, too.
    if (sculptEditor_->hasUnsaved() || !hasEditsFile_)
      return showMessage("Write the edits first: the command reads them from their file.");
    text = "terrain --edits " + quoted(editsFile_.string());
  }
  if (isChain)
    text = fmt::format("levelsmith read {} ! {} ! write sculpted.asc",
                       quoted(model_->files.front().string()), text);
  if (text.empty()) return showMessage("There is no stroke yet.");
  window_.setClipboard(text);
  showMessage("The command was copied to the clipboard.");
}

void Viewer::saveSculpting(const std::filesystem::path& name) {
  if (name.extension() != ".edits")
    throw levelset::UsageError(
        fmt::format("'{}' has no supported extension; use .edits", name.string()));
  levelset::writeGroundEdits(name, sculptEditor_->edits());
  sculptEditor_->noteSaved();
  editsFile_ = name;
  hasEditsFile_ = true;
}

void Viewer::drawSculptPart() {
  if (!beginPart("Sculpt")) return;
  if (!sculptEditor_) {
    if (ImGui::Button("Sculpt the ground")) toggleSculptEditor();
    return;
  }
  BrushChoice choice = sculptEditor_->choice();
  if (ImGui::BeginCombo("brush", brushName(choice.brush))) {
    for (const Brush brush : kBrushes)
      if (ImGui::Selectable(brushName(brush), brush == choice.brush)) choice.brush = brush;
    ImGui::EndCombo();
  }
  const double extent = model_->extent();
  const double least = 1e-4 * extent, most = 0.5 * extent;
  ImGui::SliderScalar("radius", ImGuiDataType_Double, &choice.radius, &least, &most, "%.4g",
                      ImGuiSliderFlags_Logarithmic);
  const bool isHeight =
      choice.brush == Brush::Raise || choice.brush == Brush::Lower || choice.brush == Brush::Noise;
  const double lowest = 1e-6 * extent, highest = 0.1 * extent;
  if (isHeight)
    ImGui::SliderScalar("height", ImGuiDataType_Double, &choice.height, &lowest, &highest, "%.4g",
                        ImGuiSliderFlags_Logarithmic);
  else
    slideDouble("share", choice.share, 0, 1, "%.2f");
  sculptEditor_->setChoice(choice);
  ImGui::BeginDisabled(!sculptEditor_->canUndo());
  if (ImGui::Button("Undo##sculpt")) stepSculpting(true);
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(!sculptEditor_->canRedo());
  if (ImGui::Button("Redo##sculpt")) stepSculpting(false);
  ImGui::EndDisabled();
  if (ImGui::Button("Copy as command##sculpt")) copySculpting(false);
  ImGui::SameLine();
  if (ImGui::Button("Copy chain##sculpt")) copySculpting(true);
  if (ImGui::Button("Write##sculpt")) asksResult_ = true;
  ImGui::SameLine();
  if (ImGui::Button("End##sculpt")) toggleSculptEditor();
}

}  // namespace viewer
