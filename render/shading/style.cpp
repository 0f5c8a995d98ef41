#include "render/shading/style.h"

#include <fmt/core.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numbers>

#include "levelset/error.h"
#include "render/images/grey_image.h"

namespace render {
namespace {

using Imath::C3f;

C3f mixed(const C3f& a, const C3f& b, double share) {
  return a + (b - a) * static_cast<float>(share);
}

/// Maps a curvature to (−1, 1); ±range becomes ±1/2. Large values are compressed, not clipped.
double squeezed(double curvature, double range) {
  return 2 / std::numbers::pi * std::atan(curvature / range);
}

double ramp(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

const C3f kNeutral(0.62f, 0.60f, 0.57f);

/// Colour for a value in [−1, 1] between two hues, neutral at 0. The colours differ little in
/// lightness, so that shading stays readable.
C3f diverging(double value, const C3f& negative, const C3f& positive) {
  return mixed(kNeutral, value < 0 ? negative : positive, std::abs(value));
}

}  // namespace

const char* styleName(Style style) {
  switch (style) {
    case Style::Tone:
      return "tone";
    case Style::Mean:
      return "mean";
    case Style::Gauss:
      return "gauss";
    case Style::Principal:
      return "principal";
    case Style::Accessibility:
      return "accessibility";
    case Style::Ink:
      return "ink";
    case Style::Matcap:
      return "matcap";
    case Style::ReflectionLines:
      return "reflection-lines";
    case Style::Directions:
      return "directions";
    case Style::CurvatureLines:
      return "curvature-lines";
    default:
      return "lit";
  }
}

bool showsDirections(Style style) {
  return style == Style::Directions || style == Style::CurvatureLines;
}

double curvatureRangeOf(const StyleOptions& options, double diagonal) {
  constexpr double kDefaultRange = 40;
  return options.curvatureRange > 0 ? options.curvatureRange : kDefaultRange / diagonal;
}

bool usesLights(Style style) {
  return style != Style::Tone && style != Style::Ink && style != Style::Matcap &&
         style != Style::ReflectionLines;
}

C3f meanColour(const CurvatureSample& sample, double range) {
  return diverging(squeezed(sample.mean, range), C3f(0.02f, 0.16f, 0.55f),
                   C3f(0.62f, 0.06f, 0.02f));
}

C3f gaussColour(const CurvatureSample& sample, double range) {
  // The square root has the dimension of a curvature, so the range is in the same unit as for mean
  // curvature.
  const double k = std::copysign(std::sqrt(std::abs(sample.gauss)), sample.gauss);
  return diverging(squeezed(k, range), C3f(0.02f, 0.30f, 0.10f), C3f(0.62f, 0.24f, 0.0f));
}

C3f principalColour(const CurvatureSample& sample, double range) {
  // Colours of the five basic shapes of a surface with k1 ≥ k2: bowl, groove, saddle, ridge, dome.
  const double a = squeezed(sample.k1, range), b = squeezed(sample.k2, range);
  const C3f dome(0.65f, 0.05f, 0.03f), ridge(0.75f, 0.48f, 0.04f), saddle(0.06f, 0.42f, 0.10f),
      groove(0.03f, 0.40f, 0.52f), bowl(0.04f, 0.08f, 0.55f);
  const double size = std::min(1.0, std::hypot(a, b));
  if (size == 0) return kNeutral;
  // Shape index: −1 for bowls, −1/2 grooves, 0 saddles, 1/2 ridges, 1 domes [Koenderink92].
  const double index = 2 / std::numbers::pi * std::atan2(a + b, a - b);
  const C3f* table[5] = {&bowl, &groove, &saddle, &ridge, &dome};
  const double place = std::clamp(2 * (index + 1), 0.0, 4.0);
  const int cell = std::min(3, static_cast<int>(place));
  return mixed(kNeutral, mixed(*table[cell], *table[cell + 1], place - cell), size);
}

double directionWeight(double k1, double k2, double range) {
  constexpr double kLeast = 1.0 / 200, kMost = 1.0 / 20;
  return ramp(kLeast, kMost, std::abs(k1 - k2) / range);
}

C3f directionColour(const Imath::V3d& line, double weight) {
  constexpr double kBase = 0.04, kSlope = 0.66;
  C3f colour;
  for (int axis = 0; axis < 3; ++axis)
    colour[axis] = static_cast<float>(kBase + kSlope * line[axis] * line[axis]);
  return mixed(kNeutral, colour, weight);
}

double accessibilityOf(const CurvatureSample& sample, double range) {
  return 1 - ramp(0, 1, squeezed(std::max(0.0, -sample.k2), range));
}

Imath::C3f reflectionLinesColour(const Imath::V3d& normal, const Imath::V3d& direction,
                                 const Imath::V3d& up, const Imath::V3d& side, int lines) {
  const Imath::V3d mirrored = direction - normal * (2 * direction.dot(normal));
  const double line = reflectionLineAt(mirrored, up, side, lines);
  // A little light from above shows the shape between the lines.
  const double upward = 0.75 + 0.25 * normal.dot(up);
  return (Imath::C3f(0.03f) + Imath::C3f(0.80f, 0.82f, 0.85f) * static_cast<float>(line)) *
         static_cast<float>(upward);
}

double silhouetteOf(double cosine, double viewCurvature, double width) {
  // The line covers the points that appear within `width` of the outline of the surface. A surface
  // that is concave along the view has no outline nearby.
  const double bend = std::clamp(width * viewCurvature, 0.0, 1.0);
  const double limit = std::sqrt(bend * (2 - bend));
  return limit > 0 && cosine <= limit ? 1 : 0;
}

double reflectionLineAt(const Imath::V3d& direction, const Imath::V3d& up, const Imath::V3d& side,
                        int lines) {
  const Imath::V3d ahead = up.cross(side);
  const double angle = std::atan2(direction.dot(side), direction.dot(ahead));
  // The edges of the stripes are soft over a fifth of their period.
  return ramp(-0.3, 0.3, std::cos(lines * angle));
}

float linearFromSrgb(float x) {
  return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
}

C3f ColourImage::at(double x, double y) const {
  const auto place = [](double unit, int size, int& cell) {
    const double p = std::clamp(unit * size - 0.5, 0.0, static_cast<double>(size - 1));
    cell = std::min(static_cast<int>(p), std::max(0, size - 2));
    return p - cell;
  };
  int column, row;
  const double u = place(x, width, column), v = place(y, height, row);
  const auto pixel = [&](int dx, int dy) {
    const auto r = static_cast<std::size_t>(std::min(row + dy, height - 1)),
               c = static_cast<std::size_t>(std::min(column + dx, width - 1));
    return pixels[r * static_cast<std::size_t>(width) + c];
  };
  return mixed(mixed(pixel(0, 0), pixel(1, 0), u), mixed(pixel(0, 1), pixel(1, 1), u), v);
}

ColourImage readColourPng(const std::filesystem::path& path, std::size_t maxMemory) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed))
    throw levelset::IoError(
        fmt::format("'{}' does not exist or is not a regular file; check the name", path.string()));
  if (!std::ifstream(path, std::ios::binary))
    throw levelset::IoError(
        fmt::format("{} cannot be opened; check its permissions", path.string()));
  requirePngChunks(path);
  struct Png {
    png_image image = {};
    ~Png() { png_image_free(&image); }
  } owner;
  png_image& png = owner.image;
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&png, path.c_str()))
    throw levelset::InvalidInput(
        fmt::format("{} is not a PNG: {}; give a PNG file", path.string(), png.message));
  constexpr double kMostPixels = 1 << 26;
  if (static_cast<double>(png.width) * png.height > kMostPixels)
    throw levelset::ResourceLimit(
        fmt::format("{} has {}x{} pixels, but at most 2^26 are supported; use a smaller picture",
                    path.string(), png.width, png.height));
  requirePngPixels(path, png.width, png.height);
  levelset::requireMemory((4.0 + sizeof(C3f)) * png.width * png.height, maxMemory);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(png));
  if (!png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr))
    throw levelset::InvalidInput(
        fmt::format("{} is damaged: {}; copy it again", path.string(), png.message));
  ColourImage image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.pixels.reserve(bytes.size() / 4);
  const auto linear = [](std::uint8_t byte) { return linearFromSrgb(byte / 255.0f); };
  for (std::size_t i = 0; i < bytes.size(); i += 4)
    image.pixels.emplace_back(linear(bytes[i]), linear(bytes[i + 1]), linear(bytes[i + 2]));
  return image;
}

}  // namespace render
