#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "levelset/terrain/height_field.h"

/// Slope, aspect and hillshade of a ground, by the formulas of Horn as GDAL uses them [Horn81].
/// With the heights of the samples around e named
///
///     a b c    (north)
///     d e f
///     g h i
///
/// the derivatives at e are ((c + 2f + i) − (a + 2d + g)) / (8 dx) along x and
/// ((a + 2b + c) − (g + 2h + i)) / (8 dy) along y. They are exact on quadratic grounds.
namespace levelset {

struct SlopeOptions {
  /// Gives missing neighbours of a sample a height, also beyond the border. A neighbour along x or
  /// y continues the line through the sample, as b = 2e − h. A diagonal one continues the plane, as
  /// a = b + d − e. False: the samples beside a missing one are missing in the result.
  bool edges = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Angle between the ground and a horizontal plane at each sample, degrees from 0 to 90. Samples
/// with a missing neighbour are missing.
/// @throws InvalidInput for a field in degrees, or one that requireHeights() refuses
/// @throws ResourceLimit, Cancelled
[[nodiscard]] HeightField slopeDegrees(const HeightField& field, const SlopeOptions& options = {});
/// The same in the memory of the field.
[[nodiscard]] HeightField slopeDegrees(HeightField&& field, const SlopeOptions& options = {});

/// Direction in which the ground falls, degrees clockwise from north (y), from 0 to 360 without
/// 360. Samples where the ground is level are missing, too. @throws as slopeDegrees
[[nodiscard]] HeightField aspectDegrees(const HeightField& field, const SlopeOptions& options = {});
[[nodiscard]] HeightField aspectDegrees(HeightField&& field, const SlopeOptions& options = {});

struct HillshadeOptions {
  double azimuthDegrees = 315;  ///< direction of the light, clockwise from north
  double altitudeDegrees = 45;  ///< height of the light above the horizon, from 0 to 90
  double exaggeration = 1;      ///< factor of the heights, > 0
  bool edges = false;           ///< as in SlopeOptions
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Light of each sample: 1 + 254 × the cosine between normal and light, 1 for samples that face
/// away, 0 for missing ones. Rows in the order of the field.
/// @throws UsageError for options out of their range
/// @throws InvalidInput, ResourceLimit, Cancelled as slopeDegrees
[[nodiscard]] std::vector<std::uint8_t> hillshade(const HeightField& field,
                                                  const HillshadeOptions& options = {});

/// Passes the rows of hillshade() on, from the north. @throws as hillshade(), and what `take`
/// throws
void forEachShadedRow(const HeightField& field, const HillshadeOptions& options,
                      const std::function<void(std::span<const std::uint8_t>)>& take);

}  // namespace levelset
