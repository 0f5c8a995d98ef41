#include "apps/viewer/model/layer_colours.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "levelset/error.h"

namespace viewer {
namespace {

constexpr std::array<const char*, kLayers.size()> kLayerNames = {
    "colour", "normal", "depth", "position", "mean", "gauss", "k1", "k2", "id", "thickness"};

std::uint8_t displayByte(double unit) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(unit, 0.0, 1.0)));
}

/// Smallest and largest value of a layer over the pixels that show a surface.
struct ValueRange {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void extendBy(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// Position of a value in the range, from 0 to 1; 0.5 if all values are equal.
  [[nodiscard]] double share(double value) const {
    return high > low ? (value - low) / (high - low) : 0.5;
  }
};

using ColourOf = std::function<DisplayColour(std::size_t)>;

bool isHit(const render::Image& image, std::size_t i) {
  return std::isfinite(image.channels.at("Z")[i]);
}

std::vector<std::uint8_t> painted(const render::Image& image, const ColourOf& colourOf) {
  std::vector<std::uint8_t> bytes(4 * image.pixelCount(), 0);
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    if (!isHit(image, i)) continue;
    const DisplayColour colour = colourOf(i);
    for (std::size_t c = 0; c < 3; ++c) bytes[4 * i + c] = displayByte(colour[c]);
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

std::array<const std::vector<float>*, 3> channelsOf(const render::Image& image, const char* name) {
  const auto channel = [&](const char* axis) {
    return &image.channels.at(fmt::format("{}.{}", name, axis));
  };
  return {channel("X"), channel("Y"), channel("Z")};
}

double valueAt(const std::vector<float>& channel, std::size_t i) {
  return static_cast<double>(channel[i]);
}

std::vector<std::uint8_t> normalColours(const render::Image& image) {
  const auto n = channelsOf(image, "N");
  return painted(image, [&](std::size_t i) {
    return DisplayColour{0.5 + 0.5 * valueAt(*n[0], i), 0.5 + 0.5 * valueAt(*n[1], i),
                         0.5 + 0.5 * valueAt(*n[2], i)};
  });
}

std::vector<std::uint8_t> depthColours(const render::Image& image) {
  const std::vector<float>& z = image.channels.at("Z");
  ValueRange range;
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    if (isHit(image, i)) range.extendBy(valueAt(z, i));
  return painted(image, [&](std::size_t i) {
    // The darkest grey, 0.15 for the farthest point, is brighter than the background of the window.
    const double grey = 1 - 0.85 * range.share(valueAt(z, i));
    return DisplayColour{grey, grey, grey};
  });
}

std::vector<std::uint8_t> positionColours(const render::Image& image) {
  const auto p = channelsOf(image, "P");
  std::array<ValueRange, 3> range;
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    for (std::size_t a = 0; isHit(image, i) && a < 3; ++a) range[a].extendBy(valueAt(*p[a], i));
  return painted(image, [&](std::size_t i) {
    DisplayColour colour;
    for (std::size_t a = 0; a < 3; ++a) colour[a] = range[a].share(valueAt(*p[a], i));
    return colour;
  });
}

std::vector<std::uint8_t> thicknessColours(const render::Image& image) {
  constexpr std::array<DisplayColour, 4> kColours = {
      {{0.99, 0.96, 0.75}, {0.97, 0.62, 0.30}, {0.72, 0.21, 0.40}, {0.18, 0.07, 0.30}}};
  const std::vector<float>& thickness = image.channels.at("thickness");
  double most = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    if (isHit(image, i)) most = std::max(most, valueAt(thickness, i));
  return painted(image, [&](std::size_t i) {
    const double place =
        (kColours.size() - 1) * (most > 0 ? std::clamp(valueAt(thickness, i) / most, 0.0, 1.0) : 0);
    const auto cell = std::min(static_cast<std::size_t>(place), kColours.size() - 2);
    const double share = place - static_cast<double>(cell);
    DisplayColour colour;
    for (std::size_t c = 0; c < 3; ++c)
      colour[c] = std::lerp(kColours[cell][c], kColours[cell + 1][c], share);
    return colour;
  });
}

std::vector<std::uint8_t> curvatureColours(const render::Image& image, const char* name,
                                           double scale) {
  const std::vector<float>& k = image.channels.at(fmt::format("curvature.{}", name));
  return painted(image, [&](std::size_t i) { return divergingColour(valueAt(k, i) * scale); });
}

}  // namespace

const char* layerName(Layer layer) {
  return kLayerNames[static_cast<std::size_t>(layer)];
}

Layer layerNamed(const std::string& name) {
  const auto found = std::find(kLayerNames.begin(), kLayerNames.end(), name);
  if (found != kLayerNames.end())
    return kLayers[static_cast<std::size_t>(found - kLayerNames.begin())];
  std::string all;
  for (const char* known : kLayerNames) all += (all.empty() ? "" : ", ") + std::string(known);
  throw levelset::UsageError(
      fmt::format("levelsmith-view: --layer '{}' is unknown; give one of {}", name, all));
}

DisplayColour divergingColour(double value) {
  constexpr DisplayColour kBlue = {0.13, 0.33, 0.69}, kWhite = {0.95, 0.95, 0.94},
                          kRed = {0.75, 0.16, 0.18};
  const double v = std::isnan(value) ? 0 : std::clamp(value, -1.0, 1.0);
  const DisplayColour& end = v < 0 ? kBlue : kRed;
  const double share =
      std::sqrt(std::abs(v));  // the square root makes small values distinguishable
  DisplayColour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = kWhite[c] + (end[c] - kWhite[c]) * share;
  return colour;
}

DisplayColour idColour(std::uint32_t id) {
  if (id == 0) return {0.5, 0.5, 0.5};
  // Hues that advance by the golden section stay far from all earlier hues.
  const double hue = 6 * std::fmod(0.58 + 0.61803398874989485 * (id - 1), 1.0);
  DisplayColour colour;
  constexpr std::array<double, 3> kMiddle = {0, 2, 4};
  for (std::size_t c = 0; c < 3; ++c) {
    const double away = std::abs(std::remainder(hue - kMiddle[c], 6));
    colour[c] = 0.35 + 0.55 * std::clamp(2 - away, 0.0, 1.0);
  }
  return colour;
}

std::vector<std::uint8_t> layerColours(const render::Image& image, Layer layer, double extent,
                                       double range) {
  const double scale = extent > 0 && range > 0 ? extent / range : 1;
  switch (layer) {
    case Layer::Normal:
      return normalColours(image);
    case Layer::Depth:
      return depthColours(image);
    case Layer::Position:
      return positionColours(image);
    case Layer::MeanCurvature:
      return curvatureColours(image, "mean", scale);
    case Layer::GaussCurvature:
      return curvatureColours(image, "gauss", scale * scale);
    case Layer::K1:
      return curvatureColours(image, "k1", scale);
    case Layer::K2:
      return curvatureColours(image, "k2", scale);
    case Layer::Id: {
      const std::vector<std::uint32_t>& ids = image.ids.at("id");
      return painted(image, [&](std::size_t i) { return idColour(ids[i]); });
    }
    case Layer::Thickness:
      return thicknessColours(image);
    case Layer::Colour:
      break;
  }
  return render::displayColours(image);
}

}  // namespace viewer
