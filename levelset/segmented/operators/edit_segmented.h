#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct EditSegmentedOptions {
  /// Labels of the regions that the solid takes space from, 0 for the void. Empty: all.
  std::optional<std::vector<RegionLabel>> over = {};
  /// Largest gap between the solid and a region that counts as contact, voxels, from 0 to 0.5. See
  /// SegmentSolidsOptions.
  double gap = 0.01;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Gives the space of a solid to a region, which is extended, or new. The interfaces inside that
/// space vanish; the surface of the solid becomes an interface. Blocks of 8³ grid points that the
/// band of the solid does not reach keep their bits. A solid on another grid is resampled to that
/// of the field. With all regions in `over`, the result is that of segmentSolids() with the solid
/// as its last operand.
/// @param label  1 to 65535
/// @throws UsageError for label 0; for a label in `over` that the field does not have; for a gap
///         out of range
/// @throws InvalidInput if the field has no interface, or the solid is empty or an open surface
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField addSolid(const SegmentedField& field, const NarrowBand& solid,
                                      RegionLabel label, const EditSegmentedOptions& options = {});

/// Removes the space of a solid from the regions, or from those in `over`. It becomes void.
/// @throws NoSurface if no region is left
/// @throws as addSolid()
[[nodiscard]] SegmentedField cut(const SegmentedField& field, const NarrowBand& solid,
                                 const EditSegmentedOptions& options = {});

struct RelabelOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Gives regions new labels. Regions with equal new labels become one; those with the new label 0
/// become void. Interfaces inside a region vanish. All others stay, and blocks without the labels
/// keep their bits.
/// @param labels  new label by old label; other regions keep theirs
/// @throws UsageError for the void as an old label, or an old label that the field does not have
/// @throws NoSurface if no region is left
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField relabel(const SegmentedField& field,
                                     const std::map<RegionLabel, RegionLabel>& labels,
                                     const RelabelOptions& options = {});

}  // namespace levelset
