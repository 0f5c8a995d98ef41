#include "apps/viewer/interaction/patch_overlay.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "apps/viewer/model/layer_colours.h"
#include "levelset/error.h"

namespace viewer {
namespace {

using Imath::V3d;

constexpr std::array<const char*, 4> kLinesNames = {"none", "outline", "base", "all"};
// Opacity of a line or dot behind a surface, relative to its opacity in front of all surfaces.
constexpr double kBehind = 0.12;

DisplayColour layerColour(double w) {
  constexpr DisplayColour kLow = {0.05, 0.62, 0.60}, kHigh = {0.95, 0.52, 0.10};
  const double share = std::clamp(w, 0.0, 1.0);
  DisplayColour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = kLow[c] + (kHigh[c] - kLow[c]) * share;
  return colour;
}

/// A position in the picture, pixels, and a depth along the view axis, world units.
struct Seen {
  double x, y, depth;
};

/// Draws lines and dots over a picture. They are faint where the picture shows a surface in front
/// of them.
class Pen {
 public:
  Pen(const render::Camera& camera, const render::Image& picture, double tolerance, Canvas& canvas)
      : picture_(picture),
        depths_(picture.channels.at("Z")),
        tolerance_(tolerance),
        canvas_(canvas),
        toCamera_(camera.worldToCamera()) {
    const render::Camera::PixelSteps steps = camera.pixelSteps();
    isOrtho_ = camera.orthoHeight.has_value();
    scaleX_ = 1 / steps.right.length();
    scaleY_ = 1 / steps.down.length();
  }

  void line(const V3d& a, const V3d& b, const DisplayColour& colour) const {
    V3d p = a * toCamera_, q = b * toCamera_;
    if (p.z > q.z) std::swap(p, q);
    const double nearest = isOrtho_ ? -std::numeric_limits<double>::max() : 1e-3 * std::abs(q.z);
    if (!(q.z > nearest)) return;
    if (p.z < nearest) p += (q - p) * ((nearest - p.z) / (q.z - p.z));
    lineSeen(seen(p), seen(q), colour);
  }

  void dot(const V3d& place, const DisplayColour& colour) const {
    const V3d p = place * toCamera_;
    if (!isOrtho_ && !(p.z > 0)) return;
    const Seen s = seen(p);
    constexpr double kRadius = 1.4;
    if (!(s.x > -2 && s.x < canvas_.width + 2 && s.y > -2 && s.y < canvas_.height + 2)) return;
    const int left = static_cast<int>(std::floor(s.x - 2)),
              top = static_cast<int>(std::floor(s.y - 2));
    for (int y = top; y <= top + 4; ++y)
      for (int x = left; x <= left + 4; ++x) {
        const double away = std::hypot(x + 0.5 - s.x, y + 0.5 - s.y);
        plot(x, y, s.depth, std::clamp(kRadius + 0.5 - away, 0.0, 1.0), colour);
      }
  }

 private:
  [[nodiscard]] Seen seen(const V3d& p) const {
    const double shrink = isOrtho_ ? 1 : 1 / p.z;
    return {0.5 * canvas_.width + p.x * shrink * scaleX_,
            0.5 * canvas_.height - p.y * shrink * scaleY_, p.z};
  }

  /// Draws an antialiased line. It takes one step per pixel along the longer axis of the picture.
  /// At each step it shares the colour between the two nearest pixels along the other axis.
  void lineSeen(const Seen& a, const Seen& b, const DisplayColour& colour) const {
    const bool isSteep = std::abs(b.y - a.y) > std::abs(b.x - a.x);
    const double from = isSteep ? a.y : a.x, to = isSteep ? b.y : b.x;
    const double size = isSteep ? canvas_.height : canvas_.width;
    const double low = std::max(std::min(from, to), 0.0), high = std::min(std::max(from, to), size);
    if (!(low <= high) || to == from) return;
    for (int i = static_cast<int>(low); i < static_cast<int>(std::ceil(high)); ++i) {
      const double at = std::clamp(i + 0.5, low, high), t = (at - from) / (to - from);
      const double across = (isSteep ? a.x + (b.x - a.x) * t : a.y + (b.y - a.y) * t) - 0.5;
      // In perspective the reciprocal of the depth is linear along the line in the picture.
      const double depth =
          isOrtho_ ? a.depth + (b.depth - a.depth) * t : 1 / ((1 - t) / a.depth + t / b.depth);
      const double below = std::floor(across), share = across - below;
      if (!(below > -2 && below < 1e9)) continue;
      const int j = static_cast<int>(below);
      plot(isSteep ? j : i, isSteep ? i : j, depth, 0.8 * (1 - share), colour);
      plot(isSteep ? j + 1 : i, isSteep ? i : j + 1, depth, 0.8 * share, colour);
    }
  }

  [[nodiscard]] bool isBehind(int x, int y, double depth) const {
    const auto place = [](int at, int size, int of) {
      return std::min(static_cast<int>((at + 0.5) * of / size), of - 1);
    };
    const int px = place(x, canvas_.width, picture_.width),
              py = place(y, canvas_.height, picture_.height);
    const std::size_t i = static_cast<std::size_t>(py) * static_cast<std::size_t>(picture_.width) +
                          static_cast<std::size_t>(px);
    return depth > static_cast<double>(depths_[i]) + tolerance_;
  }

  void plot(int x, int y, double depth, double share, const DisplayColour& colour) const {
    if (share <= 0 || x < 0 || y < 0 || x >= canvas_.width || y >= canvas_.height) return;
    if (isBehind(x, y, depth)) share *= kBehind;
    std::uint8_t* p = canvas_.colours.data() +
                      4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(canvas_.width) +
                           static_cast<std::size_t>(x));
    const double below = p[3] / 255.0 * (1 - share), alpha = share + below;
    for (std::size_t c = 0; c < 3; ++c)
      p[c] =
          static_cast<std::uint8_t>(std::lround((255 * colour[c] * share + p[c] * below) / alpha));
    p[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
  }

  const render::Image& picture_;
  const std::vector<float>& depths_;
  double tolerance_;
  Canvas& canvas_;
  Imath::M44d toCamera_;
  bool isOrtho_ = false;
  double scaleX_ = 1, scaleY_ = 1;
};

void drawLayer(const Pen& pen, const mapping::ParticleLayer& layer) {
  const DisplayColour colour = layerColour(layer.w);
  for (std::size_t r = 0; r < layer.rows; ++r)
    for (std::size_t c = 0; c < layer.columns; ++c) {
      if (c + 1 < layer.columns) pen.line(layer.at(c, r), layer.at(c + 1, r), colour);
      if (r + 1 < layer.rows) pen.line(layer.at(c, r), layer.at(c, r + 1), colour);
    }
  for (const V3d& particle : layer.positions) pen.dot(particle, colour);
}

void drawBorder(const Pen& pen, const mapping::ParticleLayer& layer) {
  const DisplayColour colour = layerColour(layer.w);
  const std::size_t lastColumn = layer.columns - 1, lastRow = layer.rows - 1;
  for (std::size_t c = 0; c < lastColumn; ++c)
    for (const std::size_t r : {std::size_t{0}, lastRow})
      pen.line(layer.at(c, r), layer.at(c + 1, r), colour);
  for (std::size_t r = 0; r < lastRow; ++r)
    for (const std::size_t c : {std::size_t{0}, lastColumn})
      pen.line(layer.at(c, r), layer.at(c, r + 1), colour);
}

void drawOutline(const Pen& pen, const mapping::Patch& patch) {
  drawBorder(pen, patch.layers.front());
  drawBorder(pen, patch.layers.back());
  for (std::size_t l = 0; l + 1 < patch.layers.size(); ++l) {
    const mapping::ParticleLayer &a = patch.layers[l], &b = patch.layers[l + 1];
    for (const bool isLastColumn : {false, true})
      for (const bool isLastRow : {false, true})
        pen.line(a.at(isLastColumn ? a.columns - 1 : 0, isLastRow ? a.rows - 1 : 0),
                 b.at(isLastColumn ? b.columns - 1 : 0, isLastRow ? b.rows - 1 : 0),
                 layerColour(a.w));
  }
}

}  // namespace

PatchLines patchLinesNamed(const std::string& name) {
  const auto found = std::find(kLinesNames.begin(), kLinesNames.end(), name);
  if (found == kLinesNames.end())
    throw levelset::UsageError(fmt::format(
        "levelsmith-view: --patches '{}' is unknown; give none, outline, base or all", name));
  return static_cast<PatchLines>(found - kLinesNames.begin());
}

const char* patchLinesName(PatchLines lines) {
  return kLinesNames[static_cast<std::size_t>(lines)];
}

Canvas stretched(const Canvas& canvas, int width, int height) {
  Canvas result{width, height,
                std::vector<std::uint8_t>(4 * static_cast<std::size_t>(width) *
                                          static_cast<std::size_t>(height))};
  struct Place {
    std::size_t low, high;
    double share;
  };
  const auto placesOf = [](int to, int of) {
    std::vector<Place> places;
    for (int i = 0; i < to; ++i) {
      const double at = std::clamp((i + 0.5) * of / to - 0.5, 0.0, of - 1.0);
      const auto low = static_cast<std::size_t>(at);
      places.push_back({low, std::min(low + 1, static_cast<std::size_t>(of) - 1),
                        at - static_cast<double>(low)});
    }
    return places;
  };
  const std::vector<Place> columns = placesOf(width, canvas.width),
                           rows = placesOf(height, canvas.height);
  const auto across = static_cast<std::size_t>(canvas.width);
  std::uint8_t* out = result.colours.data();
  for (const Place& row : rows)
    for (const Place& column : columns)
      for (std::size_t c = 0; c < 4; ++c) {
        const auto at = [&](std::size_t x, std::size_t y) {
          return static_cast<double>(canvas.colours[4 * (y * across + x) + c]);
        };
        const double upper =
            at(column.low, row.low) * (1 - column.share) + at(column.high, row.low) * column.share;
        const double lower = at(column.low, row.high) * (1 - column.share) +
                             at(column.high, row.high) * column.share;
        *out++ =
            static_cast<std::uint8_t>(std::lround(upper * (1 - row.share) + lower * row.share));
      }
  return result;
}

void drawPatches(const std::vector<mapping::Patch>& patches, PatchLines lines,
                 const render::Camera& camera, const render::Image& picture, double tolerance,
                 Canvas& canvas) {
  if (lines == PatchLines::None) return;
  const Pen pen(camera, picture, tolerance, canvas);
  for (const mapping::Patch& patch : patches) {
    if (patch.layers.empty()) continue;
    if (lines == PatchLines::Outline) drawOutline(pen, patch);
    if (lines == PatchLines::Base) drawLayer(pen, patch.layers.front());
    if (lines == PatchLines::All)
      for (const mapping::ParticleLayer& layer : patch.layers) drawLayer(pen, layer);
  }
}

}  // namespace viewer
