#pragma once

#include <cstddef>
#include <optional>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"
#include "levelset/volumes/volume.h"

namespace levelset {

struct SegmentLabelsOptions {
  /// Standard deviation of the Gaussian that smooths the indicator function of each label, voxels,
  /// from 0.5 to 3. 0: interfaces are the faces between samples, halfway between different labels.
  double smooth = 0;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Makes a segmented field of a volume of labels, on its grid. Samples outside the volume belong to
/// the void. Without smoothing the distances are exact to the faces of the cubes around samples.
/// With smoothing a sample belongs to the label with the largest smoothed indicator. The distance
/// to an interface is that at which a flat interface has the same indicators. Smoothing removes
/// steps, and shrinks parts that are not much thicker than the deviation.
/// @param labels  integers 0…65535, on a grid with perpendicular axes of one spacing
/// @throws InvalidInput for a value that is no integer from 0 to 65535, named with its place; for a
///         grid that is anisotropic or oblique; for a volume without any region
/// @throws UsageError for another deviation
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField segmentLabels(const Volume& labels,
                                           const SegmentLabelsOptions& options = {});

}  // namespace levelset
