#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SegmentSolidsOptions {
  double halfWidth = 2;  ///< half width of the field, voxels, at least 2
  /// Labels of the solids, different from each other and from the void. Empty: 1, 2, 3, …
  std::vector<RegionLabel> labels = {};
  /// Largest gap between two solids that counts as contact, voxels. Faces that should coincide
  /// differ by rounding and resampling. Distances of which the smallest is stored may differ by it.
  double gap = 0.01;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Part of a region, measured along a line of the grid, that is thinner than a voxel. The grid does
/// not represent such a part reliably.
struct ThinPart {
  RegionLabel label = kVoid;
  std::size_t places = 0;  ///< lines between grid points that cross such a part
  bool isLost = false;     ///< some of these places hold no grid point of the region, so it is cut
  double thickness = 0;    ///< least thickness along a grid line, world units
  Imath::V3d position = Imath::V3d(0);  ///< thinnest place, world units
};

/// Finds the parts of regions that are thinner than a voxel along a line of the grid. Parts that
/// hold no grid point are not in the field.
/// @return one entry for each label with thin parts, ascending
[[nodiscard]] std::vector<ThinPart> thinParts(const SegmentedField& field);

struct SegmentSolidsResult {
  SegmentedField field;
  std::vector<std::string> notes;  ///< one for each operand that was resampled, narrowed or widened
  /// Labels of the solids that own no grid point, because later solids cover them or they are too
  /// thin. Ascending.
  std::vector<RegionLabel> vanished;
  std::vector<ThinPart> thinParts;  ///< one for each label that has thin parts, ascending
};

/// Makes one partition of several solids, without gaps or overlaps. Where solids overlap, the later
/// operand wins. Operands on different grids are resampled to the finest of these grids first, as
/// in combine(). The interfaces are the visible parts of the surfaces of the solids, and as
/// accurate as those: second order in the voxel size also at junctions.
/// @throws UsageError for no solids; a half width below 2; labels that are repeated, 0, or not as
///         many as solids; a gap that is negative or above 1/2
/// @throws InvalidInput if a solid is empty or an open surface
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
[[nodiscard]] SegmentSolidsResult segmentSolids(std::span<const NarrowBand> solids,
                                                const SegmentSolidsOptions& options = {});

}  // namespace levelset
