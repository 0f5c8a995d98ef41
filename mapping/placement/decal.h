#pragma once

#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "mapping/placement/make_patch.h"

namespace mapping {

/// A square patch about one point: u and v from −radius to radius along the surface. A particle
/// lies where the straightest way from the centre ends that sets out in its direction and is as
/// long as it is far in the (u, v) plane: the exponential map. So distances and directions from the
/// centre are kept, whatever lies between, and surfaces that unfold are mapped without distortion.
/// Each way is followed by itself (see SurfaceWalk); carrying coordinates from neighbour to
/// neighbour [Schmidt06] adds up errors. With LayerScheme::Reduced each layer has an exponential
/// map of its own, about the centre carried along ∇φ, as much wider as the ways from the centre to
/// the middles of the sides have grown.
/// @param at         projected along φ to the zero set
/// @param direction  of u; its part in the tangent plane counts
/// @param radius     half of the square's side, along the surface, world units
/// @param height     of the patch space above the surface, world units, positive
/// @param options    mirror: v runs the other way round; sides: none
/// @throws UsageError for a direction along the normal, and lengths that are not positive;
///         InvalidInput when the surface breaks off within the radius, when the decal folds or
///         comes round to itself, and where it goes around an edge thinner than its particles are
///         apart; the message has a radius that does
[[nodiscard]] PatchResult makeDecal(const levelset::NarrowBand& base, const Imath::V3d& at,
                                    const Imath::V3d& direction, double radius, double height,
                                    const PatchOptions& options = {});

}  // namespace mapping
