#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/point_field.h"
#include "levelset/progress.h"

namespace levelset::points {

/// Partition of unity over the planes through the points [Sigg06, 4.3.4]:
/// s(x) = Σ φᵢ (cᵢ + nᵢ · (x − xᵢ)) / Σ φᵢ with φᵢ = (1 − |x − xᵢ|² / r²)³. The cut-off r is the
/// distance to the point after the last neighbour, so the field is defined everywhere.
///
/// In the thesis, the constants c solve s(xᵢ) = 0. But this system is nearly singular unless the
/// points are regular, since the weights suppress constants that alternate between neighbours.
/// Biconjugate gradients do not converge for 12 neighbours. So c minimises |A c − b|² + 0.01 |c|²,
/// with rows of A that sum to 1. The surface then misses the points by about a hundredth of their
/// spacing. With less damping, the error between the points grows.
/// @param points      must outlive the field
/// @param neighbours  number of points that determine the field at a position
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointField meshless(const OrientedPoints& points, std::size_t neighbours,
                                  std::size_t maxMemory, const Progress& progress);

}  // namespace levelset::points
