#include "levelset/terrain/height_field.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <numbers>

#include "levelset/error.h"
#include "levelset/mix_hash.h"

namespace levelset {
namespace {

constexpr int kMostSamples = 1 << 30;

}  // namespace

std::size_t HeightField::missingCount() const {
  return static_cast<std::size_t>(
      std::count_if(heights.begin(), heights.end(), [](float h) { return std::isnan(h); }));
}

Imath::Box3d HeightField::bounds() const {
  Imath::Box3d box;
  for (int row = 0; row < rows; ++row) {
    float least = std::numeric_limits<float>::infinity(), most = -least;
    int first = columns, last = -1;
    for (int column = 0; column < columns; ++column) {
      const float h = at(column, row);
      if (std::isnan(h)) continue;
      least = std::min(least, h);
      most = std::max(most, h);
      first = std::min(first, column);
      last = column;
    }
    if (last < 0) continue;
    const Imath::V2d low = position(first, row), high = position(last, row);
    box.extendBy(Imath::V3d(low.x, low.y, least));
    box.extendBy(Imath::V3d(high.x, high.y, most));
  }
  return box;
}

std::uint64_t HeightField::contentHash() const {
  std::uint64_t hash =
      mixHash(mixHash(0, static_cast<std::uint64_t>(columns)), static_cast<std::uint64_t>(rows));
  for (const double number : {origin.x, origin.y, spacing.x, spacing.y})
    hash = mixHash(hash, std::bit_cast<std::uint64_t>(number));
  hash = mixHash(hash, isGeographic ? 1 : 0);
  hash = mixBytes(mixHash(hash, coordinateSystem.size()), coordinateSystem.data(),
                  coordinateSystem.size());
  for (const float height : heights) {
    const float known = std::isnan(height) ? kMissingHeight : height;  // one NaN for all
    hash = mixHash(hash, std::bit_cast<std::uint32_t>(known));
  }
  return hash;
}

void requireGrid(const HeightField& field) {
  if (field.columns < 1 || field.rows < 1 || field.columns > kMostSamples ||
      field.rows > kMostSamples)
    throw InvalidInput(fmt::format(
        "the height field has {} columns and {} rows, but each number must be from 1 to 2^30; "
        "check its size",
        field.columns, field.rows));
  if (!(field.spacing.x > 0 && field.spacing.y > 0 && std::isfinite(field.spacing.x) &&
        std::isfinite(field.spacing.y)))
    throw InvalidInput(
        fmt::format("the spacing of the height field is {}, {}, but it must be positive and "
                    "finite; correct it",
                    field.spacing.x, field.spacing.y));
  const Imath::V2d end = field.position(field.columns - 1, field.rows - 1);
  if (!std::isfinite(field.origin.x) || !std::isfinite(field.origin.y) || !std::isfinite(end.x) ||
      !std::isfinite(end.y))
    throw InvalidInput(
        fmt::format("the position of the height field, {}, {}, is not finite; correct its origin",
                    field.origin.x, field.origin.y));
}

void requireHeights(const HeightField& field) {
  requireGrid(field);
  const std::size_t count =
      static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows);
  if (field.heights.size() != count)
    throw InvalidInput(
        fmt::format("the height field has {} heights for {} columns and {} rows; give {}",
                    field.heights.size(), field.columns, field.rows, count));
  const auto infinite = std::find_if(field.heights.begin(), field.heights.end(),
                                     [](float h) { return std::isinf(h); });
  if (infinite != field.heights.end()) {
    const auto at = static_cast<std::size_t>(infinite - field.heights.begin());
    const auto width = static_cast<std::size_t>(field.columns);
    throw InvalidInput(
        fmt::format("the height in column {} and row {} is infinite; mark missing heights as NaN",
                    at % width, at / width));
  }
}

void requireLengths(bool isGeographic) {
  if (isGeographic)
    throw InvalidInput(
        "x and y are degrees, but this needs lengths; put 'terrain --metric' before it, or use "
        "data in a projection");
}

HeightField heightsOf(const Volume& volume, std::optional<double> noData, std::size_t maxMemory) {
  const VolumeGrid& grid = volume.grid();
  if (grid.size.z != 1)
    throw InvalidInput(
        fmt::format("the volume has {} layers, but a height field has one; give a volume of one "
                    "layer",
                    grid.size.z));
  const Imath::M44d& m = grid.indexToWorld;
  if (!(m[0][0] > 0 && m[1][1] > 0) || m[0][1] != 0 || m[0][2] != 0 || m[1][0] != 0 || m[1][2] != 0)
    throw InvalidInput(
        "the rows and columns of the volume are not along x and y; resample it with axes of "
        "positive direction");
  requireMemory(static_cast<double>(grid.pointCount()) * sizeof(float), maxMemory);
  HeightField field{.columns = grid.size.x,
                    .rows = grid.size.y,
                    .origin = {m[3][0], m[3][1]},
                    .spacing = {m[0][0], m[1][1]},
                    .noData = noData};
  field.heights.resize(grid.pointCount());
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const auto value = static_cast<float>(volume.at(column, row, 0));
      field.heights[field.index(column, row)] =
          noData && value == static_cast<float>(*noData) ? kMissingHeight : value;
    }
  requireHeights(field);
  return field;
}

std::pair<int, int> samplesBetween(double origin, double spacing, int count, double low,
                                   double high) {
  // A border within 1e-9 of a sample counts as the sample, since decimal numbers are rounded.
  constexpr double kNear = 1e-9;
  const double first = std::ceil((low - origin) / spacing - kNear),
               last = std::floor((high - origin) / spacing + kNear);
  return {static_cast<int>(std::clamp(first, 0.0, static_cast<double>(count))),
          static_cast<int>(std::clamp(last, -1.0, static_cast<double>(count) - 1))};
}

HeightField croppedHeights(const HeightField& field, const Imath::Box3d& box) {
  const auto [firstColumn, lastColumn] =
      samplesBetween(field.origin.x, field.spacing.x, field.columns, box.min.x, box.max.x);
  const auto [firstRow, lastRow] =
      samplesBetween(field.origin.y, field.spacing.y, field.rows, box.min.y, box.max.y);
  if (firstColumn > lastColumn || firstRow > lastRow) {
    const Imath::V2d end = field.position(field.columns - 1, field.rows - 1);
    throw InvalidInput(fmt::format(
        "the box from {:.9g},{:.9g} to {:.9g},{:.9g} has no sample of the terrain, "
        "which is from {:.9g},{:.9g} to {:.9g},{:.9g}; move or enlarge the box",
        box.min.x, box.min.y, box.max.x, box.max.y, field.origin.x, field.origin.y, end.x, end.y));
  }
  HeightField part = {.columns = lastColumn - firstColumn + 1,
                      .rows = lastRow - firstRow + 1,
                      .origin = field.position(firstColumn, firstRow),
                      .spacing = field.spacing,
                      .noData = field.noData,
                      .coordinateSystem = field.coordinateSystem,
                      .isGeographic = field.isGeographic};
  part.heights.reserve(static_cast<std::size_t>(part.columns) *
                       static_cast<std::size_t>(part.rows));
  for (int row = firstRow; row <= lastRow; ++row) {
    const auto begin =
        field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(firstColumn, row));
    part.heights.insert(part.heights.end(), begin, begin + part.columns);
  }
  return part;
}

HeightField flippedHeights(HeightField field) {
  for (int row = 0; row < field.rows / 2; ++row) {
    const auto begin = field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(0, row));
    std::swap_ranges(
        begin, begin + field.columns,
        field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(0, field.rows - 1 - row)));
  }
  return field;
}

HeightField scaledHeights(HeightField field, double factor) {
  if (!std::isfinite(factor) || factor == 0)
    throw UsageError(
        fmt::format("the factor of the heights is {}; give a finite number other than 0", factor));
  for (float& height : field.heights) height = static_cast<float>(height * factor);
  field.noData.reset();
  requireHeights(field);
  return field;
}

HeightField metricHeights(HeightField field) {
  if (!field.isGeographic) throw InvalidInput("x and y are not degrees; leave out --metric");
  constexpr double kDegree = std::numbers::pi / 180;
  // Equatorial radius and square of the eccentricity of WGS 84.
  constexpr double kRadius = 6378137, kEccentricity2 = 6.69437999014e-3;
  const Imath::V2d end = field.position(field.columns - 1, field.rows - 1);
  const Imath::V2d middle = (field.origin + end) / 2;
  if (!(field.origin.y > -90 && end.y < 90))
    throw InvalidInput(
        "the terrain contains a pole, about which degrees of longitude have no length; crop it");
  const double sine = std::sin(middle.y * kDegree);
  const double root = std::sqrt(1 - kEccentricity2 * sine * sine);
  const double alongMeridian = kRadius * (1 - kEccentricity2) / (root * root * root);
  const double alongParallel = kRadius / root * std::cos(middle.y * kDegree);
  const Imath::V2d metres(alongParallel * kDegree, alongMeridian * kDegree);
  field.origin = (field.origin - middle) * metres;
  field.spacing = field.spacing * metres;
  field.coordinateSystem =
      fmt::format("metres about longitude {:.9g}, latitude {:.9g}{}{}", middle.x, middle.y,
                  field.coordinateSystem.empty() ? "" : ", ", field.coordinateSystem);
  field.isGeographic = false;
  return field;
}

}  // namespace levelset
