#pragma once

#include "levelset/narrow_band.h"

namespace render {

/// Quantization of values to few bits. The quantized values are evenly spaced between minus and
/// plus the largest magnitude of the values. Zero is not among them, and no value changes its sign,
/// so the surface crosses the same cells of the grid.
struct ValueBits {
  int bits = 32;   ///< 8 or 16; 32: single precision, not quantized
  float step = 0;  ///< difference of neighbouring quantized values, world units

  /// Code of the quantized value that is nearest to `value`. Values beyond the largest quantized
  /// value are clamped.
  [[nodiscard]] int codeOf(float value) const;
  /// Quantized value of a code, with the same bits as in the kernel.
  [[nodiscard]] float valueOf(int code) const;
  [[nodiscard]] bool operator==(const ValueBits&) const = default;
};

/// Displacement of a surface by quantization, voxels, measured at the crossings of the surface with
/// grid edges.
struct SurfaceShift {
  double largest = 0, rms = 0;
};

/// A band with quantized values.
struct QuantizedBand {
  levelset::NarrowBand band;  ///< all values of the band are quantized values of `quantization`
  ValueBits quantization;
  SurfaceShift shift;
};

/// Quantizes the values of a band. @param bits  8 or 16
/// @pre the band is not empty
[[nodiscard]] QuantizedBand quantized(const levelset::NarrowBand& band, int bits);

}  // namespace render
