#include "render/effects/effects.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "levelset/error.h"
#include "render/effects/canvas.h"
#include "render/effects/picture_view.h"
#include "render/effects/solid_pattern.h"
#include "render/effects/stereo.h"
#include "render/optics/environment_map.h"
#include "render/optics/fresnel.h"
#include "render/shading/style.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::UsageError;

constexpr double kRadiusShare = 0.25;    // default of --occlusion-radius over the diagonal
constexpr double kOccluderShare = 0.05;  // default of --occluder-depth over the diagonal
constexpr double kPatternShare = 0.1;    // default of --texture-size over the diagonal
constexpr int kLargestReduction = 16;
const V3d kSolidColour(0.66, 0.62, 0.56);  // default colour of solids, Solid::colour

void requireUnit(const char* option, double value) {
  if (value >= 0 && value <= 1) return;
  throw UsageError(
      fmt::format("--{} {} is out of range; give a number from 0 to 1", option, value));
}

bool hasFiniteParts(const V3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Requires that squares of pixels cover the picture.
void requireDivisor(const Image& image, int edge) {
  if (image.width % edge == 0 && image.height % edge == 0) return;
  throw UsageError(
      fmt::format("--reduce {} does not divide the edges of the picture of {}x{} pixels; give a "
                  "divisor of both edges",
                  edge, image.width, image.height));
}

void carve(Image& image, const EffectOptions& options, double diagonal) {
  const VectorLayer positions(image, "P", "--solid-texture");
  const double size = options.textureSize.value_or(kPatternShare * diagonal);
  const PictureView view(image);
  Canvas canvas(image, "--solid-texture");
  forPixels(image, [&](int, int, std::size_t i) {
    const V3d place = positions.at(i) / size;
    if (!view.isHit(i) || !hasFiniteParts(place)) return;
    canvas.set(i, canvas.colour(i) * patternColour(options.solidTexture, place) / kSolidColour);
  });
}

void mirror(Image& image, const EffectOptions& options, std::size_t maxMemory) {
  const VectorLayer normals(image, "N", options.reflect > 0 ? "--reflect" : "--refract");
  const PictureView view(image);
  const EnvironmentMap surroundings(options.environment, maxMemory);
  Canvas canvas(image, "an effect");
  forPixels(image, [&](int x, int y, std::size_t i) {
    if (!view.isHit(i)) return;
    const V3d d = view.direction(x, y);
    V3d n = normals.at(i).normalized();
    if (!hasFiniteParts(n)) return;
    if (n.dot(d) > 0) n = -n;
    const double cosine = std::clamp(-n.dot(d), 0.0, 1.0), a = canvas.alpha(i);
    V3d colour = canvas.colour(i);
    const V3d inMirror = surroundings.light(mirrored(d, n));
    if (options.refract > 0) {
      const double share = fresnelShare(cosine, options.index);
      const V3d behind = surroundings.light(refracted(d, n, options.index).value_or(d));
      colour = colour * (1 - options.refract) +
               (inMirror * share + behind * (1 - share)) * (a * options.refract);
    }
    if (options.reflect > 0) {
      const double share = schlickShare(options.reflect, cosine);
      colour = colour * (1 - share) + inMirror * (a * share);
    }
    canvas.set(i, colour);
  });
}

void drawReflectionLines(Image& image, const EffectOptions& options) {
  const VectorLayer normals(image, "N", "--reflection-lines");
  const PictureView view(image);
  Canvas canvas(image, "--reflection-lines");
  forPixels(image, [&](int x, int y, std::size_t i) {
    if (!view.isHit(i)) return;
    const V3d d = view.direction(x, y);
    V3d n = normals.at(i).normalized();
    if (!hasFiniteParts(n)) return;
    if (n.dot(d) > 0) n = -n;
    const Imath::C3f lines =
        reflectionLinesColour(n, d, view.up(), view.right(), options.reflectionLines);
    canvas.set(i, V3d(lines) * canvas.alpha(i));
  });
}

/// Darkens the colours where light is blocked. @param open  share of the light, 0 to 1
void darken(Image& image, std::vector<float> open, double strength, const char* layer) {
  Canvas canvas(image, "an effect");
  forPixels(image, [&](int, int, std::size_t i) {
    canvas.set(i, canvas.colour(i) * (1 - strength * (1 - static_cast<double>(open[i]))));
  });
  image.channels[layer] = std::move(open);
}

void shade(Image& image, const EffectOptions& options, const ScreenRunner& runner) {
  if (!(options.occlusion > 0) && !(options.shadow > 0)) return;
  std::vector<float> sky, key;
  {
    const PictureView view(image);
    const double extent = options.occluderDepth.value_or(kOccluderShare * view.diagonal());
    if (options.occlusion > 0)
      sky = occlusionLayer(
          view,
          {.radius = options.occlusionRadius.value_or(kRadiusShare * view.diagonal()),
           .occluderDepth = extent},
          runner);
    if (options.shadow > 0)
      key = shadowLayer(view,
                        {.toLight = options.light,
                         .softness = options.lightRadius * std::numbers::pi / 180,
                         .length = 4 * view.diagonal(),
                         .occluderDepth = extent},
                        runner);
  }
  if (options.shadow > 0) darken(image, std::move(key), options.shadow, "light.key");
  if (options.occlusion > 0) darken(image, std::move(sky), options.occlusion, "light.sky");
}

}  // namespace

Image reducedPicture(Image image, int edge) {
  requireDivisor(image, edge);
  Image small(image.width / edge, image.height / edge);
  small.attributes = image.attributes;
  small.matrices = image.matrices;
  const Canvas from(image, "--reduce");
  const auto source = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(x);
  };
  const auto keepMiddle = [&](const auto& values, auto& kept) {
    kept.resize(small.pixelCount());
    forPixels(small, [&](int x, int y, std::size_t i) {
      kept[i] = values[source(x * edge + edge / 2, y * edge + edge / 2)];
    });
  };
  for (const auto& [name, values] : image.channels) keepMiddle(values, small.channels[name]);
  for (const auto& [name, values] : image.ids) keepMiddle(values, small.ids[name]);
  Canvas to(small, "--reduce");
  forPixels(small, [&](int x, int y, std::size_t i) {
    V3d sum(0);
    double alpha = 0;
    for (int dy = 0; dy < edge; ++dy)
      for (int dx = 0; dx < edge; ++dx) {
        const std::size_t n = source(x * edge + dx, y * edge + dy);
        sum += from.shown(n) * from.alpha(n);
        alpha += from.alpha(n);
      }
    to.setShown(i, alpha > 0 ? sum / alpha : V3d(0), alpha / (edge * edge));
  });
  return small;
}

void validateLightRadius(double degrees) {
  if (!(degrees < 85))
    throw UsageError(
        fmt::format("--light-radius {} is too wide; give less than 85 degrees", degrees));
}

void validateReduction(long reduce) {
  if (reduce > kLargestReduction)
    throw UsageError(
        fmt::format("--reduce {} is too large; give at most {}", reduce, kLargestReduction));
}

void validate(const EffectOptions& options) {
  requireUnit("occlusion", options.occlusion);
  requireUnit("shadow", options.shadow);
  requireUnit("reflect", options.reflect);
  requireUnit("refract", options.refract);
  if (!(options.light.length() > 0) || !std::isfinite(options.light.length()))
    throw UsageError(
        fmt::format("--light {},{},{} is not a direction; give for example -0.4,0.7,0.6",
                    options.light.x, options.light.y, options.light.z));
  validateLightRadius(options.lightRadius);
  validateReduction(options.reduce);
  if (options.index < 1)
    throw UsageError(
        fmt::format("--index {} is less than that of a vacuum; give 1 or more", options.index));
}

Image withEffects(Image image, const LookOptions& look, const EffectOptions& options,
                  const ScreenRunner& runner, std::size_t maxMemory) {
  validate(options);
  validate(look, options.reduce);
  requireDivisor(image, options.reduce);
  if (options.solidTexture != SolidTexture::None)
    carve(image, options, PictureView(image).diagonal());
  if (options.reflect > 0 || options.refract > 0) mirror(image, options, maxMemory);
  if (options.reflectionLines > 0) drawReflectionLines(image, options);
  shade(image, options, runner);
  image = withLook(std::move(image), look, options.reduce, runner);
  if (options.stereo != Stereo::None)
    return stereoOf(image, options.stereo, options.eyeDistance.value_or(0),
                    options.screenDepth.value_or(0), options.reduce);
  return options.reduce > 1 ? reducedPicture(std::move(image), options.reduce) : image;
}

}  // namespace render
