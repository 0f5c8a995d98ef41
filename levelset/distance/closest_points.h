#pragma once

#include <optional>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct ClosestPointOptions {
  /// Largest distance from the surface, voxels; empty: half width of the solid.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Closest-point transform: for each grid point nearer to the surface than the half width, the
/// closest point of the surface, in world units.
/// Uses the same search as redistance(), so φ at that point is zero to the order of the tricubic
/// interpolant. Stored as float: at coordinates of 10⁶ voxels the resolution is a sixteenth of a
/// voxel.
/// @throws InvalidInput for an empty solid
/// @throws UsageError for a half width below 1
/// @throws ResourceLimit when the result does not fit into memory
/// @throws Cancelled
[[nodiscard]] FieldGrid closestPoints(const NarrowBand& solid,
                                      const ClosestPointOptions& options = {});

/// Extends a scalar attribute off the surface along its normals: each grid point within the half
/// width gets the value of the attribute at its closest point, so ∇φ · ∇q = 0. Other grid points
/// get 0.
/// @throws UsageError also when the attribute is not set
/// @throws InvalidInput also when the attribute is not finite
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const ScalarField& attribute,
                                         const ClosestPointOptions& options = {});

/// Extends a vector attribute, taken at time 0, off the surface in the same way.
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const VectorField& attribute,
                                         const ClosestPointOptions& options = {});

}  // namespace levelset
