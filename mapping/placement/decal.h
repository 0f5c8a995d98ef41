#pragma once

#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "mapping/placement/make_patch.h"

namespace mapping {

/// Builds a square patch around one point: u and v run from −radius to radius along the surface. It
/// uses the exponential map: each particle is the end of a geodesic from the centre. The geodesic
/// has the particle's direction and distance in the (u, v) plane. So distances and directions from
/// the centre are preserved, and developable surfaces are mapped without distortion. Each geodesic
/// is traced separately (see SurfaceWalk), because passing coordinates from neighbour to neighbour
/// [Schmidt06] accumulates errors. With LayerScheme::Reduced each layer has its own exponential
/// map, whose centre moves along ∇φ from layer to layer. The size of a layer grows with the
/// distances from its centre to the middles of its sides, which also move along ∇φ.
/// @param at         centre, moved to the nearest point of the zero set
/// @param direction  direction of u; its tangential part is used
/// @param radius     half of the square's side, along the surface, world units
/// @param height     height of the space above the surface that the patch covers, world units,
///         positive
/// @param options    with mirror, v runs in the opposite direction; sides must be empty
/// @throws UsageError for a direction along the normal, and lengths that are not positive
/// @throws InvalidInput if the surface breaks off within the radius, if the decal folds or overlaps
///         itself, or where an edge is thinner than the particle spacing. The message suggests a
///         radius that works.
[[nodiscard]] PatchResult makeDecal(const levelset::NarrowBand& base, const Imath::V3d& at,
                                    const Imath::V3d& direction, double radius, double height,
                                    const PatchOptions& options = {});

}  // namespace mapping
