#pragma once

#include "levelset/narrow_band.h"

namespace render {

/// Values held in few bits, evenly between −φ and φ of the largest in magnitude. There is no zero
/// among them, and none changes its sign, so the cells that the surface crosses stay the same.
struct ValueBits {
  int bits = 32;   ///< 8 or 16; 32: single precision, untouched
  float step = 0;  ///< between two values next to each other, in the band's unit

  /// Number of the value next to one that is at most as large as the largest.
  [[nodiscard]] int codeOf(float value) const;
  /// As the kernel takes it.
  [[nodiscard]] float valueOf(int code) const;
  [[nodiscard]] bool operator==(const ValueBits&) const = default;
};

/// How far a surface moved, voxels: measured where it crosses the grid's edges.
struct SurfaceShift {
  double largest = 0, rms = 0;
};

struct QuantizedBand {
  levelset::NarrowBand band;  ///< of values that `held` has
  ValueBits quantization;
  SurfaceShift shift;
};

/// A band in fewer bits. @param bits  8 or 16
/// @pre the band is not empty
[[nodiscard]] QuantizedBand quantized(const levelset::NarrowBand& band, int bits);

}  // namespace render
