#pragma once

#include <optional>

#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct OffsetOptions {
  std::optional<double> halfWidth = {};  ///< of the result, voxels; empty: as the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  const char* action = "offset";  ///< in messages
};

/// Moves the surface along its normal by `distance`; positive grows the solid. Distances are swept
/// out to the new zero set and re-distanced once, whatever `distance`.
/// @param distance  world units, any sign
/// @throws UsageError if `distance` is not finite; InvalidInput if `solid` is empty or nothing is
/// left;
///         ResourceLimit, before anything is allocated; Cancelled
[[nodiscard]] NarrowBand offset(NarrowBand solid, double distance,
                                const OffsetOptions& options = {});

/// Moves each point of the surface along its normal by the length that `distance` has there (world
/// units, any sign): a displacement map, or an offset under a mask. The new surface is the zero set
/// of φ(x) − distance(closest point of x), re-distanced once; what it does not reach is as before.
/// Where the length changes faster along the surface than the surface's own curvature lets normals
/// meet, the farthest point along each normal counts: no overhangs.
/// @throws as offset(), InvalidInput where `distance` is not finite, with the place
[[nodiscard]] NarrowBand offsetBy(NarrowBand solid, const ScalarField& distance,
                                  const OffsetOptions& options = {});

/// Estimates the cost of moving a surface.
/// @param before,after  layers of the two surfaces (ValuePlan::layer)
/// @param distance      voxels, any sign
/// @param halfWidth     of the result, voxels
[[nodiscard]] Cost costOfOffset(double before, double after, double distance, double halfWidth);

/// The operator `offset`.
struct OffsetOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "offset-sphere"};

  struct Options {
    std::optional<double> distance;  ///< world units; either this or `by`
    ScalarField by;                  ///< world units
    std::optional<double> halfWidth;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("distance", &Options::distance,
            {.help = "distance to move; negative shrinks",
             .unit = OptionUnit::Length,
             .position = 0});
      visit("by", &Options::by, {.help = "distance at each point of the surface, world units"});
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
      visit("mask", &Options::mask, {});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
