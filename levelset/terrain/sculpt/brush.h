#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>
#include <optional>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/sample_range.h"

namespace levelset {

/// Effect of a brush on the heights below it. w is the weight of a sample, s the strength.
enum class BrushEffect {
  Raise,    ///< adds s·w; a negative strength lowers
  Flatten,  ///< moves heights by the share s·w towards BrushDab::level
  Smooth,   ///< diffuses heights; planes do not change
  Noise,    ///< adds s·w times gradient noise from −1 to 1
  Erode     ///< moves ground down slopes that are steeper than the talus; the volume stays
};

/// One touch of a round brush. The weight is (1 − r²/R²)² at the distance r from the centre: 1
/// there, and 0 with a level tangent at the radius R.
struct BrushDab {
  BrushEffect effect = BrushEffect::Raise;
  Imath::V2d center = Imath::V2d(0);  ///< position, world units
  double radius = 0;                  ///< R > 0, world units
  /// Raise and Noise: height, world units. The others: share from 0 to 1.
  double strength = 0;
  std::optional<double> level =
      {};                    ///< Flatten: height; default: the weighted mean below the brush
  double wavelength = 0;     ///< Noise: size of its features, world units; 0: radius / 4
  double talusDegrees = 33;  ///< Erode: steepest slope that stays, from 0 to below 90
  int passes = 8;            ///< Smooth and Erode: number of steps, from 1 to 1000
  std::uint32_t seed = 0;    ///< Noise: number of the pattern
};

/// Checks a dab. @throws UsageError for a number out of range
void requireDab(const BrushDab& dab);

/// Samples that a dab may change, with a border that it does not change; empty if the brush is
/// beside the field.
[[nodiscard]] SampleRange dabRange(const HeightField& field, const BrushDab& dab);

/// Applies a dab. Missing samples stay missing. The same bits for any number of threads.
/// @return dabRange(); empty if no known sample is below the brush
/// @throws UsageError as requireDab()
/// @throws InvalidInput for Erode on a field in degrees
/// @throws InvalidInput, too, if a height would exceed the range of float; the field is unchanged
/// then
/// @throws ResourceLimit
SampleRange applyDab(HeightField& field, const BrushDab& dab,
                     std::size_t maxMemory = kNoMemoryLimit);

}  // namespace levelset
