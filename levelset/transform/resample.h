#pragma once

#include <Imath/ImathMatrix.h>

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct ResampleOptions {
  /// Half width of the result, voxels; empty: the half width of the given solid, or of `like`.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Half width of the band that resampling reads, in voxels of the solid. A narrower band is widened
/// first.
/// @param ratio  voxel size of the result divided by that of the solid
[[nodiscard]] double sampledWidth(double ratio);

/// Resamples a solid on the axis-aligned grid of integer multiples of `voxelSize`. Interpolates
/// with tricubic Catmull-Rom splines where the source band holds all samples, else trilinearly.
/// Then re-distances the result. Works per leaf block, so the bits do not depend on the number of
/// threads.
/// @throws UsageError unless the voxel size is positive and finite, and the half width at least 1
/// @throws InvalidInput if the solid is empty or the voxels are too large for it
/// @throws ResourceLimit if the memory estimate or the 32-bit grid index exceeds its limit
[[nodiscard]] NarrowBand resample(const NarrowBand& solid, double voxelSize,
                                  const ResampleOptions& options = {});

/// Resamples a solid on the grid points of another transform.
/// @param indexToWorld  rotation, uniform scale, translation
/// @throws as resample(), and InvalidInput if the transform shears, mirrors or scales unevenly
[[nodiscard]] NarrowBand resampleTo(const NarrowBand& solid, const Imath::M44d& indexToWorld,
                                    const ResampleOptions& options = {});

/// Resamples a solid on the grid points of `like`, by default with its half width.
/// @throws as resampleTo()
[[nodiscard]] NarrowBand resampleLike(const NarrowBand& solid, const NarrowBand& like,
                                      const ResampleOptions& options = {});

/// Returns true when both bands have the same grid points and the same half width.
[[nodiscard]] bool shareGrid(const NarrowBand& a, const NarrowBand& b);

/// The operator `resample`.
struct ResampleOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 2;
  static constexpr ErrorModel errorModel{2, 0.65, 0, "resample-chain"};

  struct Options {
    VoxelSize voxel;
    std::optional<double> halfWidth;  ///< half width of the result, voxels

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("voxel", &Options::voxel, {});
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
    }
  };

  static double longestSide(const Options& options, Plans operands);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// Estimates the cost of resampling the solid `source` on the grid of `target` and of re-distancing
/// the result.
[[nodiscard]] Cost costOfSamples(const ValuePlan& source, const ValuePlan& target);

/// Region of a solid that is read when only `ofResult` of a resampled result is computed.
/// @param plans     plans of the solid, as the first operand, and of the result
/// @param toSource  matrix from world positions in the result to world positions in the solid
[[nodiscard]] RegionOfInterest sampledRegion(const OperatorPlans& plans,
                                             const RegionOfInterest& ofResult,
                                             const Imath::M44d& toSource);

}  // namespace levelset
