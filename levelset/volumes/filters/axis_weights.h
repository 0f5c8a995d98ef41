#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>

#include "levelset/splines/grid_extension.h"
#include "levelset/volumes/filters/volume_filter.h"

namespace levelset {

/// Weights of the samples along one axis, of a filter that is a product of functions of one
/// coordinate. All samples lie in the grid: the weights of samples beyond the border are given to
/// those that extend them.
struct AxisWeights {
  static constexpr int kMost = 6;
  int first = 0;  ///< index of the first sample
  int count = 1;  ///< number of samples
  /// Weights for the value, the first and the second derivative, per grid spacing.
  std::array<std::array<double, kMost>, 3> weight{};
};

/// Returns true for filters that are products of functions of one coordinate.
[[nodiscard]] bool isTensorProduct(VolumeFilter filter);

/// Returns the weights at a position on an axis. At a point where a derivative jumps, it is that of
/// the cell above, and at the end of the axis that of the last cell.
/// @param position  0 ≤ position ≤ size − 1
/// @pre isTensorProduct(filter)
[[nodiscard]] AxisWeights axisWeights(VolumeFilter filter, double position, int size,
                                      GridExtension border);

}  // namespace levelset
