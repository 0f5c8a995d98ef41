#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct RedistanceOptions {
  /// Half width of the result, voxels; empty: that of the operand.
  std::optional<double> halfWidth = {};
  std::optional<Imath::Box3d> region = {};  ///< world box: distances are computed only inside it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Distance from the surface, in voxels, within which field values affect the surface points.
/// Includes edges and the faces that meet there.
inline constexpr double kReadBySurface = 6;

/// Radius around a point, in voxels, within which the field determines the distance computed there.
/// @param halfWidth  half width of the result, voxels
[[nodiscard]] inline double distanceReach(double halfWidth) {
  return halfWidth + 2 * kReadBySurface;
}

/// Recomputes a signed distance from a field with the right zero set, without moving the zero set.
/// Beside the surface each grid point finds its closest point on a tricubic interpolant with
/// Newton's method [Chopp01, Saye14]. From there closest points propagate outwards block by block.
/// Each grid point keeps the nearest one and refines it on the interpolant.
/// The error is of second order in the voxel size, and smaller on smooth surfaces. Edges and
/// corners between faces that are flat beside them are those of `mesh --sharp`. Other edges are
/// rounded by up to 0.75 voxel. The result does not depend on the order of blocks or on the number
/// of threads.
/// A value within the tricubic's own error is kept (1e-3 voxel at a radius of curvature of 8, less
/// on flatter parts). So a distance field keeps its bits where radii of curvature exceed 10 voxels.
/// @param field  right sign everywhere, Lipschitz, any slope; only values beside the zero set are
///               read
/// @return with `region`, distances on the smallest box of grid points that holds it; signs
///         everywhere
/// @throws InvalidInput if the field has no zero crossing
/// @throws UsageError for a half width below 1 or an empty region
/// @throws ResourceLimit when the result does not fit into memory
/// @throws Cancelled
[[nodiscard]] NarrowBand redistance(NarrowBand field, const RedistanceOptions& options = {});

}  // namespace levelset
