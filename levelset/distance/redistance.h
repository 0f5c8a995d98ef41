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
  /// Half width of the result, voxels; empty: that of the operand.
  std::optional<double> halfWidth = {};
  /// World box in which distances are computed; empty: everywhere.
  std::optional<Imath::Box3d> region = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Distance from the surface, in voxels, within which field values affect the position of the
/// surface. Includes the reconstruction of edges from the faces that meet there.
inline constexpr double kReadBySurface = 6;

/// Radius around a point, in voxels, within which the field determines the distance computed there.
/// @param halfWidth  half width of the result, voxels
[[nodiscard]] inline double distanceReach(double halfWidth) {
  return halfWidth + 2 * kReadBySurface;
}

/// Recomputes the signed distance from a field, without moving the zero set. Beside the surface
/// each grid point finds its closest point on a tricubic interpolant with Newton's method [Chopp01,
/// Saye14]. From there closest points propagate outwards block by block. Each grid point keeps the
/// nearest one and refines it on the interpolant. The error is of second order in the voxel size,
/// and smaller on smooth surfaces. Edges and corners between faces that are flat near them are as
/// sharp as those of `mesh --sharp`. Other edges are rounded by up to 0.75 voxel. The result does
/// not depend on the order of blocks or on the number of threads. A value of the field is kept if
/// it equals the computed distance within the error of tricubic interpolation: 1e-3 voxel at a
/// radius of curvature of 8 voxels, less on flatter parts. So a distance field keeps its bits where
/// radii of curvature exceed 10 voxels.
/// @param field  correct sign everywhere, Lipschitz continuous, any slope; values away from the
///               zero set are only compared with the computed distances
/// @return band of the requested half width; with `region`, distances only on the smallest box of
///         grid points that contains the region, and signs everywhere
/// @throws InvalidInput if the field has no zero crossing
/// @throws UsageError for a half width below 1 or an empty region
/// @throws ResourceLimit when the result does not fit into memory
/// @throws Cancelled
[[nodiscard]] NarrowBand redistance(NarrowBand field, const RedistanceOptions& options = {});

/// Estimates the cost of redistancing.
/// @param layer      number of grid points in a layer one voxel thick along the surface, see
///                   ValuePlan::layer()
/// @param halfWidth  half width of the result, voxels
[[nodiscard]] Cost costOfDistances(double layer, double halfWidth);

/// Options of the operators `reinitialize` and `rebuild-band`.
template <bool isRequired>
struct HalfWidthOptions {
  /// Half width of the result, voxels; empty: that of the operand.
  std::optional<double> halfWidth;

  template <class Visitor>
  static void describe(Visitor& visit) {
    OptionInfo info = kResultHalfWidth;
    info.required = isRequired;
    if (isRequired) info.help = "half width of the result, in voxels";
    visit("half-width", &HalfWidthOptions::halfWidth, info);
  }
};

/// Members that the operators reinitialize and rebuild-band share.
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

/// The operator `rebuild-band`.
struct RebuildBandOperator : RedistanceOperator<true> {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "half-widths"};
};

}  // namespace levelset
