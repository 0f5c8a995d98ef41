#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <string>

#include "apps/viewer/effects/shown_effects.h"
#include "apps/viewer/panel_parts.h"
#include "apps/viewer/viewer.h"

// Members of Viewer that draw the panel, the dialogs and the status line of the window.
namespace viewer {
namespace {

using Imath::V3d;

void textOf(const std::string& text) {
  ImGui::TextUnformatted(text.c_str());
}

}  // namespace

void Viewer::drawPanel() {
  ImGui::SetNextWindowPos({8, 8});
  ImGui::SetNextWindowSize({kPanelWidth, 0});
  ImGui::SetNextWindowSizeConstraints(
      {kPanelWidth, 0}, {kPanelWidth, std::max(60.0f, ImGui::GetIO().DisplaySize.y - 50)});
  ImGui::Begin("Levelsmith", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoTitleBar);
  ImGui::PushItemWidth(kPanelWidth - 100);
  drawFilePart();
  drawViewPart();
  drawLayerPart();
  drawVolumePart();
  if (model_ && model_->terrain) {
    drawSculptPart();
  } else if (!model_ || !model_->volume) {
    drawClipPart();
    if (!deformEditor_) drawPatchEditorPart();
    drawDeformPart();
  }
  drawEffectPart();
  drawPatchPart();
  drawPointPart();
  ImGui::PopItemWidth();
  ImGui::End();
}

void Viewer::drawFilePart() {
  if (ImGui::Button("Open"))
    fileList_.show(model_ && !model_->files.empty() ? model_->files[0] : ".");
  ImGui::SameLine();
  if (ImGui::Button("Read again")) reload();
  ImGui::SameLine();
  if (ImGui::Button("Picture")) asksScreenshot_ = true;
  ImGui::SameLine();
  if (ImGui::Button("?")) asksKeys_ = true;
  if (!model_) return;
  for (const std::filesystem::path& file : model_->files) textOf(file.filename().string());
  ImGui::PushTextWrapPos(0);
  textOf(model_->description);
  ImGui::PopTextWrapPos();
}

void Viewer::drawViewPart() {
  if (!beginPart("View")) return;
  constexpr std::array<const char*, 6> kLabels = {"+x", "-x", "+y", "-y", "+z", "-z"};
  for (std::size_t i = 0; i < kLabels.size(); ++i) {
    if (i > 0) ImGui::SameLine();
    V3d direction(0);
    direction[static_cast<int>(i / 2)] = i % 2 == 0 ? 1 : -1;
    if (ImGui::Button(kLabels[i])) camera_.lookAgainst(direction);
  }
  if (ImGui::Button("All")) frameBesidePanel();
  ImGui::SameLine();
  bool isOrtho = camera_.isOrtho();
  if (ImGui::Checkbox("orthographic", &isOrtho)) camera_.toggleOrtho();
  const render::Camera camera = camera_.camera(pictureWidth_, pictureHeight_);
  if (ImGui::Button("Copy as options")) {
    window_.setClipboard(cameraText(camera));
    showMessage("The view was copied to the clipboard, as options of 'levelsmith render'.");
  }
}

void Viewer::drawLayerPart() {
  if (!beginPart("Colours")) return;
  if (ImGui::BeginCombo("layer", layerName(display_.layer))) {
    for (const Layer layer : kLayers)
      if (ImGui::Selectable(layerName(layer), layer == display_.layer)) display_.layer = layer;
    ImGui::EndCombo();
  }
  if (display_.layer == Layer::Colour && ImGui::BeginCombo("style", render::styleName(style_))) {
    for (const render::Style style : render::kStyles)
      if (ImGui::Selectable(render::styleName(style), style == style_)) style_ = style;
    ImGui::EndCombo();
  }
  constexpr double kFaintest = 0.05;
  if (display_.layer == Layer::Colour && model_ && !model_->scene.isBlended() &&
      slideDouble("opacity", opacity_, kFaintest, 1, "%.2f"))
    opacity_ = std::clamp(opacity_, kFaintest, 1.0);
  if (display_.layer < Layer::MeanCurvature || display_.layer > Layer::K2) return;
  double range = display_.curvatureRange;
  constexpr double kLow = 1, kHigh = 1000;
  if (ImGui::SliderScalar("range", ImGuiDataType_Double, &range, &kLow, &kHigh, "%.3g",
                          ImGuiSliderFlags_Logarithmic))
    display_.curvatureRange = std::clamp(range, kLow, 1e6);
}

void Viewer::drawClipPart() {
  if (!beginPart("Clip plane")) return;
  if (model_ && !model_->canCut()) {
    ImGui::TextWrapped("%s", "The model has no solid that can be clipped.");
    return;
  }
  ImGui::Checkbox("cut", &isClipped_);
  constexpr std::array<const char*, 4> kNames = {"x", "y", "z", "view"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    ImGui::SameLine();
    const auto across = static_cast<ClipPlane::Across>(i);
    if (!ImGui::RadioButton(kNames[i], clip_.across == across)) continue;
    clip_.across = across;
    isClipped_ = true;
    clip_.offset = model_ && i < 3 ? model_->solidBounds.center()[static_cast<int>(i)] : 0;
  }
  if (!model_) return;
  const bool isView = clip_.across == ClipPlane::Across::View;
  const int axis = static_cast<int>(clip_.across);
  const double half = 0.5 * model_->extent();
  if (slideDouble("at", clip_.offset, isView ? -half : model_->solidBounds.min[axis],
                  isView ? half : model_->solidBounds.max[axis], "%.5g"))
    isClipped_ = true;
  ImGui::Checkbox("contours of the distance", &display_.contours);
}

void Viewer::drawPatchPart() {
  if (!model_ || model_->patches.empty() || !beginPart("Patches")) return;
  if (!ImGui::BeginCombo("lines", patchLinesName(display_.patches))) return;
  for (const PatchLines lines :
       {PatchLines::None, PatchLines::Outline, PatchLines::Base, PatchLines::All})
    if (ImGui::Selectable(patchLinesName(lines), lines == display_.patches))
      display_.patches = lines;
  ImGui::EndCombo();
}

void Viewer::drawPointPart() {
  if (picks_.empty() || !beginPart("Points")) return;
  constexpr std::size_t kShown = 6;  // number of points shown, the newest
  const std::size_t first = picks_.size() > kShown ? picks_.size() - kShown : 0;
  for (std::size_t i = first; i < picks_.size(); ++i) {
    const Picked& picked = picks_[i];
    const V3d &p = picked.position, &n = picked.normal;
    textOf(fmt::format("{}: {:.5g}, {:.5g}, {:.5g}", i + 1, p.x, p.y, p.z));
    if (i + 1 < picks_.size()) continue;
    textOf(fmt::format("   normal {:.3f}, {:.3f}, {:.3f}", n.x, n.y, n.z));
    textOf(picked.value ? fmt::format("   of {}, value {:.5g}", picked.solid, *picked.value)
                        : fmt::format("   on {}, phi {:.2g}", picked.solid, picked.phi));
  }
  if (ImGui::Button("Copy all")) copyPicks();
  ImGui::SameLine();
  if (ImGui::Button("Forget")) picks_.clear();
}

void Viewer::drawStatus() {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0, window.y}, ImGuiCond_Always, {0, 1});
  ImGui::SetNextWindowSize({window.x, 0});
  ImGui::Begin("Status", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  std::string state;
  if (loader_.isLoading())
    state = fmt::format("reading {:.0f} %", 100 * loader_.progress());
  else if (picture_.progress() < 1)
    state = fmt::format("drawing {:.0f} %", 100 * picture_.progress());
  else if (frame_)
    state = fmt::format("{} x {}, {}", pictureWidth_, pictureHeight_, picture_.rendererName());
  ImGui::TextWrapped("%s", message_.c_str());
  const float width = ImGui::CalcTextSize(state.c_str()).x;
  ImGui::SameLine(std::max(0.0f, window.x - width - 12));
  textOf(state);
  ImGui::End();
}

void Viewer::drawMarks(int width, int height) {
  if (picks_.empty()) return;
  const render::Camera camera = camera_.camera(width, height);
  const Imath::M44d toCamera = camera.worldToCamera(), toNdc = camera.worldToNdc();
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (std::size_t i = 0; i < picks_.size(); ++i) {
    if (!camera.orthoHeight && !((picks_[i].position * toCamera).z > 0)) continue;
    const V3d at = picks_[i].position * toNdc;
    const ImVec2 place(static_cast<float>(at.x) * window.x, static_cast<float>(at.y) * window.y);
    list.AddCircleFilled(place, 5, IM_COL32(20, 20, 20, 200));
    list.AddCircleFilled(place, 3.5f, IM_COL32(255, 196, 60, 255));
    const std::string number = std::to_string(i + 1);
    list.AddText({place.x + 8, place.y - 8}, IM_COL32(20, 20, 20, 255), number.c_str());
    list.AddText({place.x + 7, place.y - 9}, IM_COL32(255, 236, 190, 255), number.c_str());
  }
}

void Viewer::drawScreenshotDialog() {
  constexpr const char* kTitle = "Write a picture";
  if (asksScreenshot_) ImGui::OpenPopup(kTitle);
  asksScreenshot_ = false;
  if (!ImGui::BeginPopupModal(kTitle, nullptr, ImGuiWindowFlags_AlwaysAutoResize)) return;
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  ImGui::InputText("name", screenshotName_.data(), screenshotName_.size());
  ImGui::Checkbox("the entire window", &isInterfaceShot_);
  if (ImGui::Button("Write") || isEntered_) {
    saveScreenshot();
    ImGui::CloseCurrentPopup();
  }
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || isEscaped_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

void Viewer::drawKeysDialog() {
  constexpr const char* kTitle = "Keys";
  if (asksKeys_) ImGui::OpenPopup(kTitle);
  asksKeys_ = false;
  if (!ImGui::BeginPopupModal(kTitle, nullptr, ImGuiWindowFlags_AlwaysAutoResize)) return;
  constexpr std::array<std::array<const char*, 2>, 21> kKeys = {{
      {"left button", "turn; with shift: move"},
      {"middle, right", "move"},
      {"wheel", "zoom in and out at the pointer"},
      {"click", "pick a point, and copy its coordinates"},
      {"arrows", "turn"},
      {"f", "frame the model"},
      {"x y z, X Y Z", "look along the negative or positive axis"},
      {"o", "orthographic, perspective"},
      {"t", "turn about the point under the pointer"},
      {"l, L", "next layer, previous layer"},
      {"c", "clip plane"},
      {"e", "make a patch: press on the surface, drag corners and sides"},
      {"backspace", "remove the point of the patch that was moved last"},
      {"d", "deform: drag control points, with shift several; x, y or z while dragging: axis"},
      {"a", "select all control points, or none"},
      {"s", "sculpt a terrain; 1 to 6: brush, [ and ]: radius"},
      {"Ctrl+Z, Y", "of a deformation or sculpting: undo, redo"},
      {"p", "write a picture"},
      {"r", "read the files again"},
      {"Ctrl+O, C, Q", "open a file, copy all points, quit"},
      {"Ctrl+C, K, S", "of what you edit: copy the action, copy the chain, write it"},
  }};
  for (const auto& [key, what] : kKeys) {
    textOf(key);
    ImGui::SameLine(120);
    textOf(what);
  }
  if (ImGui::Button("Close") || isEscaped_ || isEntered_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

}  // namespace viewer
