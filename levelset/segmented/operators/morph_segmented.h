#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct MorphSegmentedOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes a partition between two others, on the grid of the first. Regions are matched by their
/// labels. Each point goes to the region with the least weighted mean of its signed distances in
/// both partitions. Two regions give the zero set of the mean distance, as in morph(). The mean of
/// stored values of different labels, as in [Yamazaki02], would mix the labels. A region that only
/// one partition has shrinks to nothing, or grows from nothing.
/// @param fraction  0: the first partition; 1: the second one
/// @throws UsageError for a fraction outside [0, 1]
/// @throws InvalidInput if a field has no interface
/// @throws NoSurface if no region is left at the fraction
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField morphSegmented(const SegmentedField& from, const SegmentedField& to,
                                            double fraction,
                                            const MorphSegmentedOptions& options = {});

}  // namespace levelset
