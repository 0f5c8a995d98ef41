#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/point_field.h"
#include "levelset/progress.h"

namespace levelset::points {

struct RbfFieldOptions {
  /// Points farther than this from the surface become centres of the function, world units.
  double tolerance = 0;
  /// Relaxation λ ≥ 0, in mean distances between centres; 0 interpolates the centres.
  double lambda = 0;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Radial basis function φ(r) = r through the points, where it is zero, and through two more
/// particles on the normal of each point, where it is their distance [Carr01]. A part of the points
/// are centres: it grows until all other points lie within the tolerance of the surface.
/// @param points  must outlive the field
/// @throws UsageError for λ that is negative or not finite
/// @throws ResourceLimit, NumericalError, Cancelled
[[nodiscard]] PointField rbfField(const OrientedPoints& points, const RbfFieldOptions& options);

}  // namespace levelset::points
