#pragma once

#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
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

/// Extent, in voxels, around a part of a cut or joined solid that decides the part. A seam is
/// corrected up to the half width, from all surfaces within the half width. Faces that touch the
/// blocks of 8³ beside the seam are computed again from as many voxels beyond those blocks.
[[nodiscard]] constexpr double seamReach(double halfWidth) {
  constexpr double kBlocks = 3 * 8;
  return 2 * halfWidth + kBlocks;
}

/// Plan of a union, intersection or difference, as if surfaces were spread evenly over their boxes.
[[nodiscard]] ValuePlan planCombined(CsgOperation operation, Plans operands);

/// Estimates that the three operators share.
template <CsgOperation operation>
struct CsgOperator {
  using Options = NoOptions;
  static constexpr std::size_t operandCount = 2;
  static constexpr bool takesMore = true;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "csg-balls"};

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// The operator `union`.
struct UnionOperator : CsgOperator<CsgOperation::Union> {
  static const OperatorText text;
};
/// The operator `intersection`.
struct IntersectionOperator : CsgOperator<CsgOperation::Intersection> {
  static const OperatorText text;
};
/// The operator `difference`.
struct DifferenceOperator : CsgOperator<CsgOperation::Difference> {
  static const OperatorText text;
};

}  // namespace levelset
