#pragma once

#include <Imath/ImathVec.h>

#include <array>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Makes patches on a surface from their corners [Brodersen07 §8.2].
namespace mapping {

struct PatchResult {
  Patch patch;
  PatchReport report;
};

/// @param corners  u runs from corner 0 to 1, v from corner 0 to 3; projected along φ to the zero
/// set
/// @param height   of the patch space above the surface, world units, positive
/// @throws UsageError for corners that run clockwise seen from outside (the message has the right
///         order) or a height that is not positive; InvalidInput when a corner is further from the
///         surface than its bounding diagonal, corners or points of a side coincide, or no geodesic
///         joins them
[[nodiscard]] PatchResult makePatch(const levelset::NarrowBand& base,
                                    const std::array<Imath::V3d, 4>& corners, double height,
                                    const PatchOptions& options = {});

/// Across a unit normal, the direction that projects best onto +x (or +y where +x is normal).
[[nodiscard]] Imath::V3d eastOf(const Imath::V3d& normal);

/// A patch of size a × b (world units along the surface) about a point, u turned by `rotation`
/// radians about the normal from eastOf.
[[nodiscard]] std::array<Imath::V3d, 4> cornersAround(const levelset::NarrowBand& base,
                                                      const Imath::V3d& point, double a, double b,
                                                      double rotation = 0);

}  // namespace mapping
