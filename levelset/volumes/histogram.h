#pragma once

#include <cstdint>
#include <vector>

#include "levelset/progress.h"
#include "levelset/volumes/volume.h"

namespace levelset {

struct HistogramOptions {
  int bins = 256;   ///< number of bins, 2 to 65536
  int classes = 3;  ///< number of classes that Otsu's limits separate, 2 to 6
  Progress progress = {};
};

/// Histogram of the values of a volume, and isovalues that it suggests.
struct VolumeHistogram {
  double low = 0, high = 0;           ///< lower limit of the first bin, upper limit of the last
  std::vector<std::uint64_t> counts;  ///< number of grid points in each bin
  /// Mean magnitude of the gradient at the grid points of each bin, by central differences, value
  /// units per world unit; 0 for an empty bin.
  std::vector<double> meanGradient;
  /// Limits that separate classes of values with the least variance within the classes, in
  /// ascending order [Otsu79]. The optimum over all limits between bins, by dynamic programming.
  std::vector<double> otsu;
  /// Isovalue at which the mean gradient is largest, among the bins with at least a thousandth of
  /// the grid points outside the fullest bin: surfaces there are the sharpest [Pekar01].
  double steepest = 0;

  /// Value in the middle of a bin.
  [[nodiscard]] double center(std::size_t bin) const {
    return low +
           (static_cast<double>(bin) + 0.5) * (high - low) / static_cast<double>(counts.size());
  }
};

/// Counts the values of a volume. Integers in a small range get one bin for each number.
/// @throws UsageError for a number of bins or classes out of range
/// @throws Cancelled
[[nodiscard]] VolumeHistogram histogram(const Volume& volume, const HistogramOptions& options = {});

}  // namespace levelset
