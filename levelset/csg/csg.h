#pragma once

#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Union, intersection and difference of solids. Operands on different grids are brought to the
/// finest of them first (resample.h), and the result says so.
namespace levelset {

enum class CsgOperation { Union, Intersection, Difference };

struct CsgOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct CsgResult {
  NarrowBand band;
  std::vector<std::string> notes;  ///< for each operand that had to be resampled or cut
};

/// First op second op third …; Difference subtracts all others from the first.
/// The result has the finest voxel size and, in voxels, the smallest half width among the operands;
/// min and max of distances are exact at the surface and a bound beyond it, so the band is
/// re-distanced where the two differ.
/// @throws UsageError for fewer than two solids
[[nodiscard]] CsgResult combine(CsgOperation operation, std::span<const NarrowBand> solids,
                                const CsgOptions& options = {});

[[nodiscard]] NarrowBand unite(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand intersect(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand subtract(const NarrowBand& a, const NarrowBand& b);

}  // namespace levelset
