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
  /// Half width of the result, voxels; empty: the half width of the given solid.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Offsets the surface along its normal by `distance`; a positive distance grows the solid.
/// Computes distances to the old zero set, as far as the new band reaches. Where parts of the moved
/// surface meet, the nearest point of their crease is found by Newton's method. Small distances and
/// narrow bands are re-distanced instead, see followsFromOld().
/// @param distance  displacement of the surface, world units, any sign
/// @throws UsageError if `distance` is not finite
/// @throws InvalidInput if `solid` or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit, before any allocation
/// @throws Cancelled
[[nodiscard]] NarrowBand offset(NarrowBand solid, double distance,
                                const OffsetOptions& options = {});

/// Offsets each point of the surface along its normal by the local value of `distance`. Implements
/// displacement maps and masked offsets. The new surface is the zero set of φ(x) − distance(closest
/// point of x), re-distanced once. Parts of the surface with `distance` 0 stay. Overhangs cannot
/// occur: where the distance varies too fast along the surface, the new surface passes through the
/// farthest point along each normal.
/// @param distance  displacement at a point of the surface, world units, any sign
/// @throws as offset()
/// @throws InvalidInput if `distance` is not finite at a point, which the message gives
[[nodiscard]] NarrowBand offsetBy(NarrowBand solid, const ScalarField& distance,
                                  const OffsetOptions& options = {});

/// Returns true if offset() computes the distances to the moved surface from the old one alone.
/// @param distance, halfWidth  voxels
[[nodiscard]] bool followsFromOld(double distance, double halfWidth);

/// Distance along each axis, voxels, from a grid point within which the solid determines the result
/// of offset() there.
/// @param distance, halfWidth  voxels
[[nodiscard]] double offsetReach(double distance, double halfWidth);

/// Estimates the cost of moving a surface.
/// @param before,after  grid points in a layer along the surface before and after the offset, from
///         ValuePlan::layer()
/// @param distance      distance by which the surface moves, voxels, any sign
/// @param halfWidth     half width of the result, voxels
[[nodiscard]] Cost costOfOffset(double before, double after, double distance, double halfWidth);

/// The operator `offset`.
struct OffsetOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 2;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "offset-sphere"};

  struct Options {
    std::optional<double> distance;  ///< world units, for all points; empty if `by` is given
    ScalarField by;                  ///< offset at each point, world units; else empty
    std::optional<double> halfWidth;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("distance", &Options::distance,
            {.help = "distance by which the surface moves outwards; negative shrinks the solid",
             .unit = OptionUnit::Length,
             .position = 0});
      visit("by", &Options::by,
            {.help = "field with the distance at each point of the surface, world units; in place "
                     "of one distance for all"});
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
