#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "apps/viewer/effects/shown_effects.h"
#include "apps/viewer/panel_parts.h"
#include "apps/viewer/viewer.h"

// Members of Viewer for the effects of the picture.
namespace viewer {
namespace {

/// Slider whose values have two decimals, so that the copied command is short and exact.
void slideEffect(const char* label, double& value, double high) {
  if (slideDouble(label, value, 0, high, "%.2f"))
    value = std::round(std::clamp(value, 0.0, high) * 100) / 100;
}

}  // namespace

void Viewer::drawEffectPart() {
  if (!ImGui::CollapsingHeader("Effects")) return;
  if (display_.layer != Layer::Colour) {
    ImGui::TextWrapped("%s", "Effects are on the layer colour.");
    return;
  }
  EffectView& effects = display_.effects;
  constexpr double kWidestLine = 10, kWidestHalo = 30;  // pixels
  slideEffect("outline", effects.outline, kWidestLine);
  slideEffect("halo", effects.halo, kWidestHalo);
  slideEffect("depth cue", effects.depthCue, 1);
  slideEffect("occlusion", effects.occlusion, 1);
  slideEffect("shadow", effects.shadow, 1);
  ImGui::Checkbox("anaglyph", &effects.isAnaglyph);
  ImGui::SameLine();
  ImGui::Checkbox("on white", &effects.isOnWhite);
  if (ImGui::Button("Copy as command##effects")) {
    window_.setClipboard(
        effectText(effects, camera_.camera(pictureWidth_, pictureHeight_), style_));
    const bool isPlain = !isClipped_ && opacity_ == 1 && !(model_ && model_->volume) &&
                         style_ != render::Style::Matcap;
    showMessage(std::string("The actions 'render' and 'effect' were copied to the clipboard") +
                (isPlain ? "." : ", without clip plane, opacity, matcap and options of volumes."));
  }
  ImGui::SameLine();
  if (ImGui::Button("None##effects")) effects = {};
}

}  // namespace viewer
