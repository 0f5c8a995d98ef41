#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "render/effects/canvas.h"
#include "render/effects/effects.h"
#include "render/effects/picture_view.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::UsageError;

constexpr double kStepShare = 0.01;  // default of --outline-step: share of the scene's diagonal

void requireShare(const char* option, double value) {
  if (value >= 0 && value <= 1) return;
  throw UsageError(
      fmt::format("--{} {} is out of range; give a number from 0 to 1", option, value));
}

void requireColour(const char* option, const V3d& colour) {
  for (int c = 0; c < 3; ++c)
    if (!(colour[c] >= 0 && colour[c] <= 1))
      throw UsageError(fmt::format("--{} {},{},{} is not a colour; give three numbers from 0 to 1",
                                   option, colour.x, colour.y, colour.z));
}

double outlineStep(const PictureView& view, const LookOptions& look) {
  return look.outlineStep.value_or(kStepShare * view.diagonal());
}

/// @param pixelScale  edge of the squares of pixels that will become one pixel
void requireWidth(const char* option, double width, int pixelScale) {
  if (width * pixelScale <= kWidestOutline) return;
  throw UsageError(fmt::format("--{} {} is too wide{}; give at most {} pixels", option, width,
                               pixelScale > 1 ? fmt::format(" for --reduce {}", pixelScale) : "",
                               kWidestOutline / pixelScale));
}

void drawXray(Image& image, const LookOptions& look) {
  requireChannels(image, {"thickness"}, "--xray");
  const std::vector<float>& thickness = image.channels.at("thickness");
  Canvas canvas(image, "--xray");
  forPixels(image, [&](int, int, std::size_t i) {
    const double length = std::max(0.0, static_cast<double>(thickness[i]));
    const double bright = 1 - std::exp(-length / *look.xray);
    canvas.setShown(i, V3d(0.9, 0.95, 1) * bright, canvas.alpha(i));
  });
}

void fadeWithDepth(Image& image, const PictureView& view, const LookOptions& look) {
  const double near = look.depthCueNear.value_or(view.depthRange().x),
               far = look.depthCueFar.value_or(view.depthRange().y);
  const V3d fog = look.background.value_or(V3d(1));
  Canvas canvas(image, "--depth-cue");
  forPixels(image, [&](int, int, std::size_t i) {
    if (!view.isHit(i)) return;
    double way = look.depthCueFar && view.depth(i) >= far ? 1 : 0;
    if (far > near) way = std::clamp((view.depth(i) - near) / (far - near), 0.0, 1.0);
    const double share = look.depthCue * way;
    if (!(share > 0)) return;  // setShown() would clamp bright colours
    canvas.setShown(i, canvas.shown(i) * (1 - share) + fog * share, canvas.alpha(i));
  });
}

/// Weight of the rim in a pixel, by the nearest pixel of a surface in front of it.
double haloAt(const PictureView& view, int x, int y, std::size_t i, double width, double step) {
  const Image& image = view.image();
  const int reach = static_cast<int>(std::ceil(width));
  double most = 0;
  for (int dy = std::max(-reach, -y); dy <= std::min(reach, image.height - 1 - y); ++dy) {
    for (int dx = std::max(-reach, -x); dx <= std::min(reach, image.width - 1 - x); ++dx) {
      const double distance = std::hypot(dx, dy);
      if (distance >= width + 0.5) continue;
      const std::size_t other =
          static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(image.width) +
          static_cast<std::size_t>(x + dx);
      if (!view.isHit(other) || view.depth(i) - view.depth(other) < step) continue;
      most = std::max(most, std::min(1.0, (width + 0.5 - distance) / width));
    }
  }
  return most;
}

void drawHalos(Image& image, const PictureView& view, const LookOptions& look, int pixelScale) {
  const double step = outlineStep(view, look);
  const V3d rim = look.background.value_or(V3d(1));
  Canvas canvas(image, "--halo");
  std::vector<float> weights(image.pixelCount());
  forPixels(image, [&](int x, int y, std::size_t i) {
    if (view.isHit(i))
      weights[i] = static_cast<float>(haloAt(view, x, y, i, look.halo * pixelScale, step));
  });
  forPixels(image, [&](int, int, std::size_t i) {
    const double w = static_cast<double>(weights[i]);
    if (w > 0) canvas.setShown(i, canvas.shown(i) * (1 - w) + rim * w, canvas.alpha(i));
  });
}

void drawOutlines(Image& image, std::vector<float> lines, const LookOptions& look) {
  Canvas canvas(image, "--outline");
  forPixels(image, [&](int, int, std::size_t i) {
    const double w = static_cast<double>(lines[i]), a = canvas.alpha(i), all = w + a * (1 - w);
    if (!(w > 0)) return;
    canvas.setShown(i, (look.lineColour * w + canvas.shown(i) * (a * (1 - w))) / all, all);
  });
  image.channels["outline"] = std::move(lines);
}

void drawLines(Image& image, const LookOptions& look, int pixelScale, const ScreenRunner& runner) {
  if (!(look.depthCue > 0) && !(look.halo > 0) && !(look.outline > 0)) return;
  const PictureView view(image);
  std::vector<float> lines;
  if (look.outline > 0)
    lines = outlineLayer(view,
                         {.width = look.outline * pixelScale,
                          .spacing = pixelScale,
                          .step = outlineStep(view, look),
                          .crease = look.creaseAngle * std::numbers::pi / 180},
                         runner);
  if (look.depthCue > 0) fadeWithDepth(image, view, look);
  if (look.halo > 0) drawHalos(image, view, look, pixelScale);
  if (look.outline > 0) drawOutlines(image, std::move(lines), look);
}

void paintBackground(Image& image, const V3d& background) {
  Canvas canvas(image, "--background");
  forPixels(image, [&](int, int, std::size_t i) {
    const double a = std::clamp(canvas.alpha(i), 0.0, 1.0);
    if (a >= 1) return;  // setShown() would clamp bright colours
    canvas.setShown(i, canvas.shown(i) * a + background * (1 - a), 1);
  });
}

}  // namespace

void validate(const LookOptions& look, int pixelScale) {
  requireShare("depth-cue", look.depthCue);
  requireColour("line-colour", look.lineColour);
  if (look.background) requireColour("background", *look.background);
  requireWidth("outline", look.outline, pixelScale);
  requireWidth("halo", look.halo, pixelScale);
  if (look.creaseAngle > 180)
    throw UsageError(
        fmt::format("--crease-angle {} is more than 180 degrees; give less", look.creaseAngle));
  if (look.depthCueNear && look.depthCueFar && !(*look.depthCueNear < *look.depthCueFar))
    throw UsageError("--depth-cue-far must be more than --depth-cue-near; give a larger one");
}

Image withLook(Image image, const LookOptions& look, int pixelScale, const ScreenRunner& runner) {
  validate(look, pixelScale);
  if (look.xray) drawXray(image, look);
  drawLines(image, look, pixelScale, runner);
  if (look.background) paintBackground(image, *look.background);
  return image;
}

}  // namespace render
