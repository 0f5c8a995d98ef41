#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SmoothSegmentedOptions {
  /// Number of equal time steps. Empty: as many as steps of half a voxel² need, or
  /// of a quarter with more than two regions.
  std::optional<std::size_t> steps = {};
  /// Keeps the volume of each region, by a pressure in it. The void takes no part.
  bool keepsVolumes = false;
  /// Labels of regions that do not move. Other interfaces meet them at right angles.
  std::vector<RegionLabel> fixed = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Region that has vanished during a flow.
struct VanishedRegion {
  RegionLabel label = kVoid;
  double time = 0;  ///< end of the step in which it vanished, world units²
};

struct SmoothSegmentedResult {
  SegmentedField field;
  std::size_t steps = 0;
  std::vector<VanishedRegion> vanished;  ///< by time, then label
  /// With `keepsVolumes`: largest relative error of a volume for which no constant was found.
  double volumeError = 0;
};

/// Moves all interfaces with the speed of their mean curvature κ = k1 + k2 for a `time` in world
/// units²: a ball obeys R² = R0² − 4 time, as in curvatureFlow(). All interfaces have the same
/// energy, so three regions meet at 120°. The void is a region like the others. Regions may split
/// and vanish.
///
/// Each step convolves the signed distance to each region with a Gaussian of variance 2 × step, and
/// gives each point to the region with the least value [Esedoglu10]. The new interfaces are located
/// on the convolved distances, and then redistanced by closest points, so they move by any fraction
/// of a voxel. Indicator functions in place of distances would not move over less than a voxel.
/// Where three regions meet, one Gaussian turns curved interfaces by an angle of first order in its
/// width. So steps of up to half a voxel² use a sum of three Gaussians in which this error cancels.
/// With `keepsVolumes` a constant for each region is added to its distances. Newton's method finds
/// the constants that keep the volumes.
/// @throws UsageError for a time that is negative, not finite, or needs more than 1e9 steps; for no
///         steps; for a step of more than 4 voxels²; for a fixed label that the field does not have
/// @throws InvalidInput for a field without interfaces, or when all regions vanish
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SmoothSegmentedResult smoothSegmented(const SegmentedField& field, double time,
                                                    const SmoothSegmentedOptions& options = {});

}  // namespace levelset
