#pragma once

#include "levelset/solids/offset.h"

/// Opening, closing and hollowing of solids, by offsets with exact distances.
namespace levelset {

/// Computes the union of all balls of that radius that fit into the solid. Parts thinner than twice
/// the radius disappear. Convex edges become round; concave edges and thicker parts stay. Offsets
/// the solid inwards, then outwards.
/// @param radius  world units, ≥ 0
/// @throws UsageError unless `radius` is finite and ≥ 0
/// @throws InvalidInput if `solid` or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
[[nodiscard]] NarrowBand opening(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

/// Computes the complement of all balls of that radius that fit outside the solid. Fills gaps
/// narrower than twice the radius and rounds concave edges. Offsets the solid outwards, then
/// inwards.
/// @throws as opening()
[[nodiscard]] NarrowBand closing(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

enum class ShellSide {
  In,   ///< wall inside the surface of the solid
  Out,  ///< wall outside the surface of the solid
  Both  ///< half of the thickness on each side
};

/// Hollows a solid: keeps a wall of that thickness along its surface.
/// @param thickness  world units, at least one voxel
/// @throws UsageError unless `thickness` is finite and positive
/// @throws InvalidInput if `solid` is empty, the wall is thinner than a voxel, or the solid is too
///         thin for a cavity
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
[[nodiscard]] NarrowBand shell(const NarrowBand& solid, double thickness,
                               ShellSide side = ShellSide::In, const OffsetOptions& options = {});

}  // namespace levelset
