#pragma once

#include <Imath/ImathMatrix.h>

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct ResampleOptions {
  std::optional<double> halfWidth = {};  ///< of the result, voxels; empty: as the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// How far beside the surface a solid is sampled, in its own voxels: a band that is too narrow is
/// made wider first.
/// @param ratio  voxel of the result to that of the solid
[[nodiscard]] double sampledWidth(double ratio);

/// The same solid on the axis-aligned grid of integer multiples of `voxelSize`: tricubic
/// (Catmull-Rom) where the source band allows, re-distanced towards the rim of the new band. Per
/// leaf block, so the bits do not depend on the number of threads.
[[nodiscard]] NarrowBand resample(const NarrowBand& solid, double voxelSize,
                                  const ResampleOptions& options = {});

/// The same, on the grid points of another transform (rotation, uniform scale, translation).
[[nodiscard]] NarrowBand resampleTo(const NarrowBand& solid, const Imath::M44d& indexToWorld,
                                    const ResampleOptions& options = {});

/// The same, on the grid points and with the half width of `like`.
[[nodiscard]] NarrowBand resampleLike(const NarrowBand& solid, const NarrowBand& like,
                                      const ResampleOptions& options = {});

/// True when both bands sit on the same grid points with the same half width.
[[nodiscard]] bool shareGrid(const NarrowBand& a, const NarrowBand& b);

/// The operator `resample`.
struct ResampleOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr ErrorModel errorModel{2, 0.65, 0, "resample-chain"};

  struct Options {
    VoxelSize voxel;
    std::optional<double> halfWidth;  ///< of the result, voxels

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

/// Cost of laying a solid on another grid, and of the distances there.
[[nodiscard]] Cost costOfSamples(const ValuePlan& source, const ValuePlan& target);

/// Region of interest of a solid that is laid on another grid.
/// @param toSource  from the world of the result to that of the solid
[[nodiscard]] RegionOfInterest sampledRegion(const OperatorPlans& plans,
                                             const RegionOfInterest& ofResult,
                                             const Imath::M44d& toSource);

}  // namespace levelset
