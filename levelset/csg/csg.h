#pragma once

#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Union, intersection and difference of solids. Operands on different grids are resampled to the
/// finest of these grids first (resample.h); a note reports each resampled operand.
namespace levelset {

enum class CsgOperation { Union, Intersection, Difference };

struct CsgOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct CsgResult {
  NarrowBand band;
  std::vector<std::string> notes;  ///< one for each operand that was resampled or narrowed
};

/// Combines solids from left to right; Difference subtracts all others from the first. The result
/// has the finest voxel size and, in voxels, the smallest half width of the operands. The minimum
/// or maximum of distances is exact at the surface, but only a bound away from it. The band is
/// re-distanced where the two differ.
/// @throws UsageError for fewer than two solids
/// @throws InvalidInput if a solid or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit
[[nodiscard]] CsgResult combine(CsgOperation operation, std::span<const NarrowBand> solids,
                                const CsgOptions& options = {});

[[nodiscard]] NarrowBand unite(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand intersect(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand subtract(const NarrowBand& a, const NarrowBand& b);

}  // namespace levelset
