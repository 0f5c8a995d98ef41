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
/// or maximum of the operands' distances is exact at the surface, but only a bound away from it.
/// Where the bound differs from the distance, the distance is computed again.
/// @throws UsageError for fewer than two solids
/// @throws InvalidInput if a solid or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit
[[nodiscard]] CsgResult combine(CsgOperation operation, std::span<const NarrowBand> solids,
                                const CsgOptions& options = {});
/// Combines solids as combine() does, and takes them over: reuses the memory of each solid that no
/// other band shares.
[[nodiscard]] CsgResult combineMoved(CsgOperation operation, std::vector<NarrowBand> solids,
                                     const CsgOptions& options = {});

[[nodiscard]] NarrowBand unite(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand intersect(const NarrowBand& a, const NarrowBand& b);
[[nodiscard]] NarrowBand subtract(const NarrowBand& a, const NarrowBand& b);

/// Returns the distance, in voxels, around a region of the result within which the operands
/// determine the result in that region. Distances within the half width of the seam are corrected,
/// by measuring surfaces up to the half width away. Near faces where two operands coincide,
/// complete blocks of 8³ are redistanced, which adds three blocks.
[[nodiscard]] constexpr double seamReach(double halfWidth) {
  constexpr double kBlocks = 3 * 8;
  return 2 * halfWidth + kBlocks;
}

/// Estimates the plan of a union, intersection or difference. Assumes that the surface of each
/// operand is spread evenly over its bounding box.
[[nodiscard]] ValuePlan planCombined(CsgOperation operation, Plans operands);

/// Members that the operators union, intersection and difference share.
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
