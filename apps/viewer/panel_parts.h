#pragma once

#include <imgui/imgui.h>

namespace viewer {

/// Draws the title of a part of the panel. Returns true when the part is unfolded.
inline bool beginPart(const char* title) {
  return ImGui::CollapsingHeader(title, ImGuiTreeNodeFlags_DefaultOpen);
}

/// Draws a slider for a double. Returns true when the user has moved it.
inline bool slideDouble(const char* label, double& value, double low, double high,
                        const char* format) {
  return ImGui::SliderScalar(label, ImGuiDataType_Double, &value, &low, &high, format);
}

}  // namespace viewer
