#pragma once

#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

enum class SmoothKind {
  Gaussian,  ///< convolution of φ with a Gaussian of standard deviation σ, cut at 4 σ
  Mean,      ///< convolution of φ with a box of variance σ²
  Median,    ///< median of φ over the grid points within σ, or within one voxel if σ is smaller
  /// Gaussian, then a sharpening that restores the amplitude of long waves; preserves the volume.
  Taubin
};

struct SmoothOptions {
  /// Weight of the filtered values: 0 keeps the given value, 1 takes the filtered one. Empty: 1.
  std::optional<Mask> mask = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Returns the radius around a point within which the surface determines the smoothed result there.
/// @param sigma      standard deviation of the filter, voxels
/// @param halfWidth  half width of the solid, voxels
/// @return voxels
[[nodiscard]] double smoothingReach(SmoothKind kind, double sigma, double halfWidth);

/// Returns the half width that the filter needs. smooth() widens a narrower band to it first.
/// @param sigma  standard deviation of the filter, voxels
/// @return voxels
[[nodiscard]] double smoothingWidth(SmoothKind kind, double sigma);

/// Smooths the surface: filters φ and recomputes the distances.
/// @param sigma  standard deviation of the filter, world units
/// @throws UsageError unless `sigma` is positive and finite
/// @throws InvalidInput if `solid` is empty or nothing is left of it
/// @throws ResourceLimit when the band does not fit into memory, and for a median that reads more
///         than 1e12 values in all
/// @throws Cancelled
[[nodiscard]] NarrowBand smooth(NarrowBand solid, SmoothKind kind, double sigma,
                                const SmoothOptions& options = {});

/// The operator `smooth`.
struct SmoothOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 2;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "smooth"};

  struct Options {
    SmoothKind kind = SmoothKind::Gaussian;
    double sigma = 0;  ///< standard deviation of the filter, world units
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("kind", &Options::kind,
            {{"gaussian", SmoothKind::Gaussian},
             {"mean", SmoothKind::Mean},
             {"median", SmoothKind::Median},
             {"taubin", SmoothKind::Taubin}},
            {.help = "filter: gaussian; mean, a box; median; taubin, which preserves the volume"});
      visit("sigma", &Options::sigma,
            {.help = "standard deviation of the filter; for median its radius",
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
