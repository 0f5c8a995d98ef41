#pragma once

#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

enum class SmoothKind {
  Gaussian,  ///< convolution of φ with a Gaussian of that σ, out to 4 σ
  Mean,      ///< with a box of the same variance
  Median,    ///< median over the grid points within σ, one voxel at least
  Taubin     ///< a Gaussian, then sharpened by as much as long waves lost: keeps the volume
};

struct SmoothOptions {
  std::optional<Mask> mask = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// How far from a place the surface decides what smoothing makes of it there.
/// @param sigma  of the filter, voxels
/// @param halfWidth  of the solid, voxels
/// @return voxels
[[nodiscard]] double smoothingReach(SmoothKind kind, double sigma, double halfWidth);

/// How far from the surface a filter has to know distances: a narrower band is made as wide first.
/// @param sigma  of the filter, voxels
/// @return voxels
[[nodiscard]] double smoothingWidth(SmoothKind kind, double sigma);

/// Smooths the surface: filters φ and makes distances of the result.
/// @param sigma  world units
/// @throws UsageError unless `sigma` is positive and finite; InvalidInput if `solid` is empty or
/// nothing is left of it; ResourceLimit, also for a median over more than 1e12 values in all;
/// Cancelled
[[nodiscard]] NarrowBand smooth(NarrowBand solid, SmoothKind kind, double sigma,
                                const SmoothOptions& options = {});

/// The operator `smooth`.
struct SmoothOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "smooth"};

  struct Options {
    SmoothKind kind = SmoothKind::Gaussian;
    double sigma = 0;  ///< world units
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("kind", &Options::kind,
            {{"gaussian", SmoothKind::Gaussian},
             {"mean", SmoothKind::Mean},
             {"median", SmoothKind::Median},
             {"taubin", SmoothKind::Taubin}},
            {.help = "kind of the filter"});
      visit("sigma", &Options::sigma,
            {.help = "standard deviation of the filter",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive,
             .required = true});
      visit("mask", &Options::mask, {});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
