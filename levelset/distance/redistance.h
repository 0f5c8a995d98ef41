#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct RedistanceOptions {
  std::optional<double> halfWidth = {};     ///< of the result, voxels; empty: as the operand
  std::optional<Imath::Box3d> region = {};  ///< world box: distances are made only inside it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Voxels beside the surface that distances are made from, edges and the faces that meet there
/// included.
inline constexpr double kReadBySurface = 6;

/// Voxels about a place that decide which distances are made there, of a surface and of those
/// beside it.
/// @param halfWidth  of the result, voxels
[[nodiscard]] inline double distanceReach(double halfWidth) {
  return halfWidth + 2 * kReadBySurface;
}

/// Makes a signed distance again out of a field that has the right zero set, without moving that.
/// Beside the interface each grid point finds the closest point on a tricubic interpolant by
/// Newton's method [Chopp01, Saye14]; from there closest points travel outwards block by block, and
/// each grid point keeps the nearest and polishes it on the interpolant. Second order in the voxel
/// size and better on smooth surfaces; edges and corners of faces that are flat beside them are
/// those of `mesh --sharp`, others are rounded by up to 0.75 voxel. The result does not depend on
/// the order of blocks or on the number of threads. A value that is right to the tricubic's own
/// error (1e-3 voxel at a radius of curvature of 8, less where it is flatter) is kept, so a
/// distance keeps its bits where radii of curvature exceed 10 voxels.
/// @param field  right sign everywhere, Lipschitz, any slope; only values beside the zero set are
///               read
/// @return       with `region`, distances on the smallest box of grid points that holds it;
///               signs everywhere
/// @throws InvalidInput if the field has no zero crossing; UsageError for a half width below 1 or
///         an empty region; ResourceLimit; Cancelled
[[nodiscard]] NarrowBand redistance(NarrowBand field, const RedistanceOptions& options = {});

/// Estimates the cost of distances that are computed again.
/// @param layer      ValuePlan::layer() of the surface
/// @param halfWidth  of the result, voxels
[[nodiscard]] Cost costOfDistances(double layer, double halfWidth);

/// Options of the operators `reinitialize` and `rebuild-band`.
template <bool isRequired>
struct HalfWidthOptions {
  std::optional<double> halfWidth;  ///< of the result, voxels

  template <class Visitor>
  static void describe(Visitor& visit) {
    OptionInfo info = kResultHalfWidth;
    info.required = isRequired;
    if (isRequired) info.help = "half width of the result, in voxels";
    visit("half-width", &HalfWidthOptions::halfWidth, info);
  }
};

/// Estimates that the two operators share.
template <bool isRequired>
struct RedistanceOperator {
  using Options = HalfWidthOptions<isRequired>;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// The operator `reinitialize`.
struct ReinitializeOperator : RedistanceOperator<false> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "redistance"};
};
/// The operator `rebuild-band`.
struct RebuildBandOperator : RedistanceOperator<true> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "half-widths"};
};

}  // namespace levelset
