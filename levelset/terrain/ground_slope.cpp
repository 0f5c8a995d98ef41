#include "levelset/terrain/ground_slope.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

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

/// Rows that several threads compute at once.
constexpr int kSlopeRows = 64;

/// Replaces each height by a figure of its gradient, or by a missing height. Rows that are replaced
/// are kept as long as the next ones need them.
/// @param figureOf  gets the gradient; kMissingHeight: none
template <typename Figure>
HeightField replacedByFigures(HeightField field, const SlopeOptions& options,
                              const Figure& figureOf) {
  requireHeights(field);
  requireLengths(field);
  const auto width = static_cast<std::ptrdiff_t>(field.columns);
  HeightField band{.columns = field.columns, .spacing = field.spacing};
  std::vector<float> before;  // the row below the band
  for (int first = 0; first < field.rows; first += kSlopeRows) {
    const int end = std::min(first + kSlopeRows, field.rows),
              lastKept = std::min(end, field.rows - 1);
    band.heights = before;
    band.heights.insert(band.heights.end(), field.heights.begin() + first * width,
                        field.heights.begin() + (lastKept + 1) * width);
    const int below = before.empty() ? 0 : 1;
    band.rows = lastKept - first + 1 + below;
    before.assign(field.heights.begin() + (end - 1) * width, field.heights.begin() + end * width);
    tbb::parallel_for(first, end, [&](int row) {
      for (int column = 0; column < field.columns; ++column) {
        const auto gradient = hornGradient(band, column, row - first + below, options.edges);
        field.heights[field.index(column, row)] = gradient ? figureOf(*gradient) : kMissingHeight;
      }
    });
    report(options.progress, static_cast<double>(end) / field.rows);
  }
  field.noData.reset();
  return field;
}

void requireSampleMemory(const HeightField& field, std::size_t bytes, std::size_t maxMemory) {
  requireMemory(static_cast<double>(field.heights.size()) * static_cast<double>(bytes),
                memoryLeft(memoryLimit(maxMemory)));
}

}  // namespace

HeightField slopeDegrees(HeightField&& field, const SlopeOptions& options) {
  return replacedByFigures(std::move(field), options, [](const Imath::V2d& gradient) {
    return static_cast<float>(std::atan(std::hypot(gradient.x, gradient.y)) * kDegreesOfRadian);
  });
}

HeightField slopeDegrees(const HeightField& field, const SlopeOptions& options) {
  requireSampleMemory(field, sizeof(float), options.maxMemory);
  return slopeDegrees(HeightField(field), options);
}

HeightField aspectDegrees(HeightField&& field, const SlopeOptions& options) {
  return replacedByFigures(std::move(field), options, [](const Imath::V2d& gradient) {
    if (gradient == Imath::V2d(0)) return kMissingHeight;
    const double angle = std::atan2(-gradient.x, -gradient.y) * kDegreesOfRadian;
    const auto rounded = static_cast<float>(angle < 0 ? angle + 360 : angle);
    return rounded < 360 ? rounded : 0;
  });
}

HeightField aspectDegrees(const HeightField& field, const SlopeOptions& options) {
  requireSampleMemory(field, sizeof(float), options.maxMemory);
  return aspectDegrees(HeightField(field), options);
}

void forEachShadedRow(const HeightField& field, const HillshadeOptions& options,
                      const std::function<void(std::span<const std::uint8_t>)>& take) {
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
  requireHeights(field);
  requireLengths(field);
  const auto shadeOf = [&](const Imath::V2d& gradient) {
    const Imath::V2d slope = gradient * options.exaggeration;
    const double cosine = (lightZ - lightX * slope.x - lightY * slope.y) /
                          std::sqrt(1 + slope.x * slope.x + slope.y * slope.y);
    return static_cast<std::uint8_t>(std::lround(1 + 254 * std::clamp(cosine, 0.0, 1.0)));
  };
  const auto width = static_cast<std::size_t>(field.columns);
  std::vector<std::uint8_t> shades(width * kSlopeRows);
  for (int end = field.rows; end > 0; end -= kSlopeRows) {
    const int first = std::max(0, end - kSlopeRows);
    tbb::parallel_for(first, end, [&](int row) {
      for (int column = 0; column < field.columns; ++column) {
        const auto gradient = hornGradient(field, column, row, options.edges);
        shades[static_cast<std::size_t>(row - first) * width + static_cast<std::size_t>(column)] =
            gradient ? shadeOf(*gradient) : std::uint8_t{0};
      }
    });
    for (int row = end - 1; row >= first; --row)
      take({shades.data() + static_cast<std::size_t>(row - first) * width, width});
    report(options.progress, 1 - static_cast<double>(first) / field.rows);
  }
}

std::vector<std::uint8_t> hillshade(const HeightField& field, const HillshadeOptions& options) {
  requireSampleMemory(field, sizeof(std::uint8_t), options.maxMemory);
  std::vector<std::uint8_t> shades(field.heights.size());
  auto end = shades.end();
  forEachShadedRow(field, options, [&](std::span<const std::uint8_t> row) {
    end -= field.columns;
    std::copy(row.begin(), row.end(), end);
  });
  return shades;
}

}  // namespace levelset
