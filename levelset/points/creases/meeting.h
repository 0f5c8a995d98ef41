#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "levelset/points/projection/point_surface.h"

namespace levelset::points {

/// Position where the surfaces of pieces meet, and their normals there.
struct Meeting {
  Imath::V3d position = Imath::V3d(0);
  std::vector<Imath::V3d> normals;
};

/// Finds a position on the surfaces of two or more pieces by Newton's method, in least squares for
/// more than three. The surfaces are continued beyond their points.
/// @param sides    a normal for each piece: points with a normal against it are passed over
/// @param spacing  of the points nearby
/// @param reach    greatest distance from the start
/// @return nullopt if the iteration leaves the surfaces or does not converge
[[nodiscard]] std::optional<Meeting> meet(const PointSurface& surface,
                                          std::span<const std::uint32_t> pieces,
                                          std::span<const Imath::V3d> sides,
                                          const Imath::V3d& start, double spacing, double reach);

}  // namespace levelset::points
