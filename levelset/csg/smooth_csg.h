#pragma once

#include <optional>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct SmoothCsgOptions {
  double radius = 0;  ///< blending distance K, world units, ≥ 0; 0 is plain CSG
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Joins two solids by a smooth minimum of their exact distances a and b [Dekkers04, Quilez13]:
/// smin(a, b) = min(a, b) − max(K − |a − b|, 0)² / 4K. A union is the zero set of smin(a, b), an
/// intersection that of −smin(−a, −b), a difference that of −smin(−a, b). The smooth union extends
/// at most K/4 beyond the plain union, at the points where a = b, and equals it where |a − b| ≥ K.
/// Solids that do not touch are joined where the gap between them is smaller than K/2; blend()
/// leaves them apart.
/// @return  distances to the smooth surface, on the finer of the two grids, with the smaller half
///          width; notes on operands that were resampled or narrowed
/// @throws UsageError if the radius is negative or not finite
/// @throws InvalidInput if a solid is empty, or nothing is left of an intersection or difference
/// @throws ResourceLimit, Cancelled
/// @note The operands' distances are extended to 1.25 K where both solids are near. The error of
///       the surface is of second order in the voxel size. It is largest where |a − b| = K, since
///       the curvature jumps there.
[[nodiscard]] CsgResult smoothCombine(CsgOperation operation, const NarrowBand& a,
                                      const NarrowBand& b, const SmoothCsgOptions& options);

/// Members that the operators smooth-union, smooth-intersection and smooth-difference share.
template <CsgOperation operation>
struct SmoothCsgOperator {
  static constexpr std::size_t operandCount = 2;
  static constexpr Slope slope = Slope::One;
  static constexpr ErrorModel errorModel{2, 0.5, kCreaseError, "smooth-csg-balls"};

  struct Options {
    double radius = 0;  ///< blending distance K, world units

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("radius", &Options::radius,
            {.help = "blending distance: the result is smooth where the distances to both solids "
                     "differ by less",
             .unit = OptionUnit::Length,
             .range = OptionRange::NonNegative,
             .required = true});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
};

/// The operator `smooth-union`.
struct SmoothUnionOperator : SmoothCsgOperator<CsgOperation::Union> {
  static const OperatorText text;
};
/// The operator `smooth-intersection`.
struct SmoothIntersectionOperator : SmoothCsgOperator<CsgOperation::Intersection> {
  static const OperatorText text;
};
/// The operator `smooth-difference`.
struct SmoothDifferenceOperator : SmoothCsgOperator<CsgOperation::Difference> {
  static const OperatorText text;
};

}  // namespace levelset
