#include "render/optics/environment_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "render/images/image.h"

namespace render {
namespace {

using Imath::V3d;

double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Brightness of a rectangular lamp: 1 inside, with soft edges.
double lampAt(const V3d& d, const V3d& middle, double halfWidth, double halfHeight) {
  const V3d axis = middle.normalized();
  const double along = d.dot(axis);
  if (along <= 0) return 0;
  const V3d side = axis.cross(V3d(0, 1, 0.001)).normalized(), top = side.cross(axis);
  const double u = std::abs(d.dot(side) / along), v = std::abs(d.dot(top) / along);
  constexpr double kSoft = 0.06;
  return (1 - smoothStep(halfWidth - kSoft, halfWidth + kSoft, u)) *
         (1 - smoothStep(halfHeight - kSoft, halfHeight + kSoft, v));
}

V3d studioLight(const V3d& d) {
  const V3d floor(0.10, 0.095, 0.09), wall(0.34, 0.37, 0.42), ceiling(0.62, 0.66, 0.72);
  V3d light = d.y < 0 ? wall + (floor - wall) * smoothStep(0.0, 0.25, -d.y)
                      : wall + (ceiling - wall) * smoothStep(0.0, 0.9, d.y);
  light += V3d(3.4, 3.2, 2.9) * lampAt(d, V3d(-0.9, 0.8, 0.7), 0.35, 0.55);
  light += V3d(1.5, 1.7, 2.0) * lampAt(d, V3d(1.2, 0.35, 0.3), 0.18, 0.7);
  light += V3d(2.2, 2.2, 2.2) * lampAt(d, V3d(0.1, 1.0, -0.2), 0.5, 0.3);
  return light;
}

/// Light of a pixel. The sun is often infinite in a file, which would spread through all weights.
float lightIn(float value) {
  constexpr float kBrightest = 65504;  // the largest half float
  return std::isnan(value) ? 0 : std::clamp(value, 0.0f, kBrightest);
}

}  // namespace

EnvironmentMap::EnvironmentMap(const std::string& name, std::size_t maxMemory) {
  if (name == "studio") return;
  const Image picture = readExr(name, maxMemory);
  const std::vector<float>* channels[3];
  for (int c = 0; c < 3; ++c) {
    const auto found = picture.channels.find(std::string(1, "RGB"[c]));
    if (found == picture.channels.end())
      throw levelset::InvalidInput(fmt::format(
          "{} has no channel {}, but --environment needs the colours of all directions; give a "
          "picture with R, G and B",
          name, "RGB"[c]));
    channels[c] = &found->second;
  }
  if (picture.width != 2 * picture.height)
    throw levelset::InvalidInput(fmt::format(
        "{} has {}x{} pixels, but a picture of all directions is twice as wide as high; give a "
        "picture of longitudes and latitudes",
        name, picture.width, picture.height));
  width_ = picture.width;
  height_ = picture.height;
  pixels_.reserve(picture.pixelCount());
  for (std::size_t i = 0; i < picture.pixelCount(); ++i)
    pixels_.emplace_back(lightIn((*channels[0])[i]), lightIn((*channels[1])[i]),
                         lightIn((*channels[2])[i]));
}

V3d EnvironmentMap::pixel(int x, int y) const {
  const int column = (x % width_ + width_) % width_, row = std::clamp(y, 0, height_ - 1);
  return V3d(pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                     static_cast<std::size_t>(column)]);
}

V3d EnvironmentMap::light(const V3d& d) const {
  if (!std::isfinite(d.x + d.y + d.z)) return V3d(0);
  if (pixels_.empty()) return studioLight(d);
  const double longitude = std::atan2(d.x, -d.z), latitude = std::asin(std::clamp(d.y, -1.0, 1.0));
  const double x = (0.5 + 0.5 * longitude / std::numbers::pi) * width_ - 0.5,
               y = (0.5 - latitude / std::numbers::pi) * height_ - 0.5;
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const double u = x - left, v = y - top;
  return (pixel(left, top) * (1 - u) + pixel(left + 1, top) * u) * (1 - v) +
         (pixel(left, top + 1) * (1 - u) + pixel(left + 1, top + 1) * u) * v;
}

}  // namespace render
