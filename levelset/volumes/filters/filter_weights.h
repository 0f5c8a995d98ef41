#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>

#include "levelset/splines/grid_extension.h"
#include "levelset/volumes/filters/volume_filter.h"

namespace levelset {

/// Weights of the samples along one axis. All samples lie in the grid: the weights of samples
/// beyond the border are given to those that extend them.
///
/// A filter without tetrahedra is a product of functions of one coordinate, except BSplineQi. With
/// the weights q (`weight`) and w (`uncorrected`) it is qww + wqw + wwq − 2www: each q corrects the
/// coefficients by a sixth of the second difference along one axis.
struct FilterWeights {
  static constexpr int kMost = 6;
  int first = 0;  ///< index of the first sample
  int count = 1;  ///< number of samples
  /// Weights for the value, the first and the second derivative, per grid spacing.
  std::array<std::array<double, kMost>, 3> weight{};
  /// Weights of the B-spline without the correction, for BSplineQi only.
  std::array<std::array<double, kMost>, 3> uncorrected{};
};

/// Returns the weights at a position on an axis. At a point where a derivative jumps, it is that of
/// the cell above, and at the end of the axis that of the last cell.
/// @param position  0 ≤ position ≤ size − 1
/// @pre the filter is none of the splines on tetrahedra
[[nodiscard]] FilterWeights filterWeights(VolumeFilter filter, double position, int size,
                                          GridExtension border);

}  // namespace levelset
