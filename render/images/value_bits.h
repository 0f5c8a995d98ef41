#pragma once

#include "levelset/narrow_band.h"

namespace render {

/// Quantization of values to few bits: evenly spaced between minus and plus the largest magnitude.
/// Zero is not among the quantized values and no value changes its sign, so the surface crosses the
/// same cells.
struct ValueBits {
  int bits = 32;   ///< 8 or 16; 32: single precision, not quantized
  float step = 0;  ///< difference of consecutive values, in the band's unit

  /// Code of the nearest quantized value. The magnitude of `value` is at most the largest one.
  [[nodiscard]] int codeOf(float value) const;
  /// Value of a code, as the kernel computes it.
  [[nodiscard]] float valueOf(int code) const;
  [[nodiscard]] bool operator==(const ValueBits&) const = default;
};

/// Displacement of a surface, voxels, measured at its crossings with grid edges.
struct SurfaceShift {
  double largest = 0, rms = 0;
};

/// A band with quantized values.
struct QuantizedBand {
  levelset::NarrowBand band;  ///< values are multiples of the quantization
  ValueBits quantization;
  SurfaceShift shift;
};

/// Quantizes the values of a band. @param bits  8 or 16
/// @pre the band is not empty
[[nodiscard]] QuantizedBand quantized(const levelset::NarrowBand& band, int bits);

}  // namespace render
