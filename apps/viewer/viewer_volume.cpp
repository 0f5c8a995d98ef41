#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/viewer/panel_parts.h"
#include "apps/viewer/text/point_text.h"
#include "apps/viewer/viewer.h"

// Members of Viewer that draw the part of the panel for a volume.
namespace viewer {
namespace {

constexpr float kHistogramHeight = 64;  // pixels

/// Inverse of render::linearFromSrgb(). Values outside 0 to 1 are clamped.
float srgbFromLinear(float x) {
  x = std::clamp(x, 0.0f, 1.0f);
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

}  // namespace

void Viewer::drawVolumePart() {
  if (!model_ || !model_->volume || !beginPart("Volume")) return;
  const levelset::Volume& volume = model_->volume->surface.volume();
  const levelset::VolumeHistogram& histogram = model_->volume->histogram;
  const double low = volume.lowest(), high = volume.highest();
  drawHistogram();
  if (slideDouble("isovalue", isosurface_.isovalue, low, high, "%.5g")) {
    isosurface_.isovalue = asWritten(isosurface_.isovalue);
    isosurface_.isShown = true;
  }
  const auto suggest = [&](double value, const char* why) {
    if (ImGui::SmallButton(fmt::format("{:.4g}##{}", value, why).c_str())) {
      isosurface_.isovalue = asWritten(value);
      isosurface_.isShown = true;
    }
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", why);
    ImGui::SameLine();
  };
  for (std::size_t i = 0; i < histogram.otsu.size(); ++i)
    suggest(histogram.otsu[i], i == 0 ? "Otsu's first limit" : "Otsu's next limit");
  suggest(histogram.steepest, "the steepest isovalue");
  ImGui::TextUnformatted("suggested");
  if (ImGui::BeginCombo("filter", render::filterName(isosurface_.filter))) {
    for (const render::Filter filter : render::kFilters)
      if (ImGui::Selectable(render::filterName(filter), filter == isosurface_.filter))
        isosurface_.filter = filter;
    ImGui::EndCombo();
  }
  ImGui::Checkbox("surface", &isosurface_.isShown);
  ImGui::SameLine();
  bool isBelow = isosurface_.inside == render::VolumeInside::Below;
  if (ImGui::Checkbox("low values inside", &isBelow))
    isosurface_.inside = isBelow ? render::VolumeInside::Below : render::VolumeInside::Above;

  drawLightPart();

  SliceView& slices = display_.slices;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double last = volume.size()[static_cast<int>(axis)] - 1;
    ImGui::PushID(static_cast<int>(axis));
    bool isShown = slices.at[axis].has_value();
    if (ImGui::Checkbox("##slice", &isShown))
      slices.at[axis] = isShown ? std::optional(std::floor(last / 2)) : std::nullopt;
    ImGui::SameLine();
    double place = slices.at[axis].value_or(std::floor(last / 2));
    const char label[] = {"ijk"[axis], '\0'};
    if (slideDouble(label, place, 0, last, "slice %.1f")) slices.at[axis] = place;
    ImGui::PopID();
  }
  if (!slices.isEmpty()) {
    const double least = 1e-6 * (high - low);
    if (slideDouble("black", slices.black, low, high, "%.5g"))
      slices.white = std::max(slices.white, slices.black + least);
    if (slideDouble("white", slices.white, low, high, "%.5g"))
      slices.black = std::min(slices.black, slices.white - least);
  }
  if (ImGui::Button("Copy as command##volume")) {
    window_.setClipboard(isosurfaceText(isosurface_));
    showMessage("The operator 'isosurface' was copied to the clipboard.");
  }
}

void Viewer::drawLightPart() {
  bool hasLight = !light_.transfer.empty();
  if (ImGui::Checkbox("light", &hasLight)) {
    light_.transfer = hasLight ? transferEditor_.points() : std::vector<render::TransferPoint>{};
    // An isosurface hides what lies inside.
    if (hasLight) isosurface_.isShown = false;
    showMessage(hasLight ? "Drag points in the histogram; press elsewhere to add one, and the "
                           "right button to remove one."
                         : "Direct volume rendering is off.");
  }
  if (!hasLight) return;
  ImGui::SameLine();
  ImGui::Checkbox("shading", &light_.isShaded);
  ImGui::SameLine();
  if (ImGui::Button("Copy##transfer")) {
    window_.setClipboard(lightText(light_, isosurface_));
    showMessage("The transfer function was copied to the clipboard, as options of 'render'.");
  }
  const std::optional<std::size_t> selected = transferEditor_.selected();
  if (!selected) return;
  Imath::C3f colour = transferEditor_.points()[*selected].colour;
  for (int c = 0; c < 3; ++c) colour[c] = srgbFromLinear(colour[c]);
  if (ImGui::ColorEdit3("colour", &colour.x, ImGuiColorEditFlags_NoInputs)) {
    for (int c = 0; c < 3; ++c) colour[c] = render::linearFromSrgb(colour[c]);
    transferEditor_.setColour(colour);
    light_.transfer = transferEditor_.points();
  }
}

void Viewer::editTransfer(const Imath::V2d& place, const Imath::V2d& reach, bool isOver) {
  if (isOver && ImGui::IsMouseClicked(0)) transferEditor_.press(place.x, place.y, reach.x, reach.y);
  if (isOver && ImGui::IsMouseClicked(1))
    transferEditor_.removeAt(place.x, place.y, reach.x, reach.y);
  if (ImGui::IsMouseDown(0))
    transferEditor_.moveTo(place.x, place.y);
  else
    transferEditor_.release();
  light_.transfer = transferEditor_.points();
}

void Viewer::drawHistogram() {
  const levelset::VolumeHistogram& histogram = model_->volume->histogram;
  const float width = std::max(ImGui::GetContentRegionAvail().x, 16.0f);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton("histogram", {width, kHistogramHeight});
  const double span = histogram.high - histogram.low;
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const auto share = static_cast<double>((mouse.x - corner.x) / width);
  const bool hasLight = !light_.transfer.empty();
  if (hasLight && span > 0) {
    constexpr double kReach = 7;  // pixels
    editTransfer(
        {share, 1 - static_cast<double>((mouse.y - corner.y) / kHistogramHeight)},
        {kReach / static_cast<double>(width), kReach / static_cast<double>(kHistogramHeight)},
        ImGui::IsItemHovered());
  } else if (ImGui::IsItemActive() && span > 0) {
    isosurface_.isovalue = asWritten(histogram.low + std::clamp(share, 0.0, 1.0) * span);
    isosurface_.isShown = true;
  }
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 end(corner.x + width, corner.y + kHistogramHeight);
  list.AddRectFilled(corner, end, IM_COL32(24, 26, 30, 255));
  // Most volumes have many more points of air than of anything else, so the bars are logarithmic.
  const std::uint64_t most = *std::max_element(histogram.counts.begin(), histogram.counts.end());
  const double tallest = std::log1p(static_cast<double>(most));
  const auto bins = static_cast<int>(histogram.counts.size());
  for (int pixel = 0; pixel < static_cast<int>(width) && tallest > 0; ++pixel) {
    const auto first = static_cast<std::size_t>(pixel * bins / static_cast<int>(width));
    const auto last =
        std::max(static_cast<std::size_t>((pixel + 1) * bins / static_cast<int>(width)), first + 1);
    std::uint64_t count = 0;
    for (std::size_t bin = first; bin < last; ++bin) count = std::max(count, histogram.counts[bin]);
    const auto height = static_cast<float>(std::log1p(static_cast<double>(count)) / tallest) *
                        (kHistogramHeight - 4);
    const float x = corner.x + static_cast<float>(pixel);
    list.AddRectFilled({x, end.y - height}, {x + 1, end.y}, IM_COL32(120, 132, 150, 255));
  }
  const auto mark = [&](double value, ImU32 colour, float thickness) {
    if (!(span > 0) || value < histogram.low || value > histogram.high) return;
    const float x = corner.x + static_cast<float>((value - histogram.low) / span) * width;
    list.AddLine({x, corner.y}, {x, end.y}, colour, thickness);
  };
  for (const double value : histogram.otsu) mark(value, IM_COL32(110, 170, 110, 160), 1);
  mark(histogram.steepest, IM_COL32(110, 150, 220, 160), 1);
  if (isosurface_.isShown) mark(isosurface_.isovalue, IM_COL32(255, 196, 60, 255), 2);
  if (!hasLight) return;
  const auto placeOf = [&](const render::TransferPoint& point) {
    return ImVec2(corner.x + static_cast<float>(transferEditor_.xOf(point)) * width,
                  end.y - static_cast<float>(TransferEditor::yOf(point)) * kHistogramHeight);
  };
  const std::vector<render::TransferPoint>& points = transferEditor_.points();
  for (std::size_t n = 0; n + 1 < points.size(); ++n)
    list.AddLine(placeOf(points[n]), placeOf(points[n + 1]), IM_COL32(235, 235, 235, 200), 1.5f);
  for (std::size_t n = 0; n < points.size(); ++n) {
    const auto byte = [](float linear) { return static_cast<int>(255 * srgbFromLinear(linear)); };
    const Imath::C3f& c = points[n].colour;
    list.AddCircleFilled(placeOf(points[n]), transferEditor_.selected() == n ? 6.0f : 4.5f,
                         IM_COL32(255, 255, 255, 255));
    list.AddCircleFilled(placeOf(points[n]), 3.5f, IM_COL32(byte(c.x), byte(c.y), byte(c.z), 255));
  }
}

}  // namespace viewer
