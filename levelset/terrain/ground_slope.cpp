#include "levelset/terrain/ground_slope.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

constexpr double kDegreesOfRadian = 180 / std::numbers::pi;

/// Derivatives of the height along x and y; empty: a neighbour is missing.
std::optional<Imath::V2d> hornGradient(const HeightField& field, int column, int row, bool edges) {
  double window[3][3];  // by row and column
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      const int c = column + i - 1, r = row + j - 1;
      const bool isInside = c >= 0 && c < field.columns && r >= 0 && r < field.rows;
      window[j][i] = static_cast<double>(isInside ? field.at(c, r) : kMissingHeight);
    }
  const double centre = window[1][1];
  if (std::isnan(centre)) return {};
  const auto continueLine = [&](double& one, double& other) {
    if (std::isnan(one)) one = 2 * centre - other;
    if (std::isnan(other)) other = 2 * centre - one;
  };
  if (edges) {
    continueLine(window[1][0], window[1][2]);
    continueLine(window[0][1], window[2][1]);
    for (const int j : {0, 2})
      for (const int i : {0, 2})
        if (std::isnan(window[j][i])) window[j][i] = window[j][1] + window[1][i] - centre;
  }
  const auto& w = window;
  const Imath::V2d gradient(
      ((w[0][2] + 2 * w[1][2] + w[2][2]) - (w[0][0] + 2 * w[1][0] + w[2][0])) /
          (8 * field.spacing.x),
      ((w[2][0] + 2 * w[2][1] + w[2][2]) - (w[0][0] + 2 * w[0][1] + w[0][2])) /
          (8 * field.spacing.y));
  // Differences of huge heights overflow.
  if (!std::isfinite(gradient.x * gradient.x + gradient.y * gradient.y)) return {};
  return gradient;
}

/// Calls `set(index, gradient)` for all samples with a gradient.
template <typename Set>
void forEachGradient(const HeightField& field, bool edges, const Progress& progress,
                     const Set& set) {
  requireHeights(field);
  requireLengths(field);
  ProgressGate gate(progress, static_cast<std::size_t>(field.rows));
  tbb::parallel_for(0, field.rows, [&](int row) {
    for (int column = 0; column < field.columns; ++column)
      if (const auto gradient = hornGradient(field, column, row, edges))
        set(field.index(column, row), *gradient);
    gate.advance(1);
  });
  report(progress, 1);
}

void requireSampleMemory(const HeightField& field, std::size_t bytes, std::size_t maxMemory) {
  requireMemory(static_cast<double>(field.heights.size()) * static_cast<double>(bytes),
                memoryLeft(memoryLimit(maxMemory)));
}

/// Field of another figure at the same samples, all missing.
HeightField missingLike(const HeightField& field, std::size_t maxMemory) {
  requireSampleMemory(field, sizeof(float), maxMemory);
  return {.columns = field.columns,
          .rows = field.rows,
          .origin = field.origin,
          .spacing = field.spacing,
          .heights = std::vector<float>(field.heights.size(), kMissingHeight),
          .coordinateSystem = field.coordinateSystem};
}

}  // namespace

HeightField slopeDegrees(const HeightField& field, const SlopeOptions& options) {
  HeightField result = missingLike(field, options.maxMemory);
  forEachGradient(
      field, options.edges, options.progress, [&](std::size_t n, const Imath::V2d& gradient) {
        result.heights[n] =
            static_cast<float>(std::atan(std::hypot(gradient.x, gradient.y)) * kDegreesOfRadian);
      });
  return result;
}

HeightField aspectDegrees(const HeightField& field, const SlopeOptions& options) {
  HeightField result = missingLike(field, options.maxMemory);
  forEachGradient(field, options.edges, options.progress,
                  [&](std::size_t n, const Imath::V2d& gradient) {
                    if (gradient == Imath::V2d(0)) return;
                    const double angle = std::atan2(-gradient.x, -gradient.y) * kDegreesOfRadian;
                    const auto rounded = static_cast<float>(angle < 0 ? angle + 360 : angle);
                    result.heights[n] = rounded < 360 ? rounded : 0;
                  });
  return result;
}

std::vector<std::uint8_t> hillshade(const HeightField& field, const HillshadeOptions& options) {
  if (!std::isfinite(options.azimuthDegrees))
    throw UsageError(
        fmt::format("the azimuth is {} degrees; give a finite angle", options.azimuthDegrees));
  if (!(options.altitudeDegrees >= 0 && options.altitudeDegrees <= 90))
    throw UsageError(
        fmt::format("the altitude is {} degrees; give 0 to 90", options.altitudeDegrees));
  if (!(options.exaggeration > 0 && std::isfinite(options.exaggeration)))
    throw UsageError(fmt::format("the factor of the heights is {}; give a positive number",
                                 options.exaggeration));
  const double azimuth = options.azimuthDegrees / kDegreesOfRadian,
               altitude = options.altitudeDegrees / kDegreesOfRadian;
  const double lightX = std::sin(azimuth) * std::cos(altitude),
               lightY = std::cos(azimuth) * std::cos(altitude), lightZ = std::sin(altitude);
  requireSampleMemory(field, sizeof(std::uint8_t), options.maxMemory);
  std::vector<std::uint8_t> shades(field.heights.size(), 0);
  forEachGradient(
      field, options.edges, options.progress, [&](std::size_t n, const Imath::V2d& gradient) {
        const Imath::V2d slope = gradient * options.exaggeration;
        const double cosine = (lightZ - lightX * slope.x - lightY * slope.y) /
                              std::sqrt(1 + slope.x * slope.x + slope.y * slope.y);
        shades[n] = static_cast<std::uint8_t>(std::lround(1 + 254 * std::clamp(cosine, 0.0, 1.0)));
      });
  return shades;
}

}  // namespace levelset
