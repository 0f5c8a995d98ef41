#pragma once

#include <Imath/ImathVec.h>

#include <array>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Builds patches on a surface from their corners [Brodersen07 §8.2].
namespace mapping {

struct PatchResult {
  Patch patch;
  PatchReport report;
};

/// Builds a patch between four corners.
/// @param corners  u runs from corner 0 to 1, v from corner 0 to 3; moved to the nearest points of
///         the zero set
/// @param height   height of the space above the surface that the patch covers, world units,
///         positive
/// @throws UsageError for corners in clockwise order seen from outside (the message gives the right
///         order) or a height that is not positive
/// @throws InvalidInput if a corner is further from the surface than the diagonal of its bounding
///         box, corners (or points of one side) coincide after projection, or no geodesic connects
///         them
[[nodiscard]] PatchResult makePatch(const levelset::NarrowBand& base,
                                    const std::array<Imath::V3d, 4>& corners, double height,
                                    const PatchOptions& options = {});

/// Unit tangent direction at a unit normal that projects best onto +x (or onto +y where the normal
/// is within 26° of the x axis).
[[nodiscard]] Imath::V3d eastOf(const Imath::V3d& normal);

/// Corners, on the surface, of a patch of size a × b (world units along the surface) around a point
/// that is first projected onto the surface. The direction of u is eastOf the normal, rotated by
/// `rotation` radians about the normal.
[[nodiscard]] std::array<Imath::V3d, 4> cornersAround(const levelset::NarrowBand& base,
                                                      const Imath::V3d& point, double a, double b,
                                                      double rotation = 0);

}  // namespace mapping
