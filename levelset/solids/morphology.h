#pragma once

#include "levelset/solids/offset.h"

/// Opening, closing and hollowing of solids: offsets, of exact distances each.
namespace levelset {

/// All balls of that radius that fit into the solid: parts thinner than twice the radius go, convex
/// edges are rounded to it, concave ones and whatever is thicker stay. The solid moves inwards,
/// then back.
/// @param radius  world units, ≥ 0
/// @throws UsageError unless `radius` is finite and ≥ 0; InvalidInput if `solid` is empty or
///         nothing is left; ResourceLimit; Cancelled
[[nodiscard]] NarrowBand opening(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

/// The complement of all balls of that radius that fit beside the solid: gaps narrower than twice
/// the radius are filled, concave edges are rounded to it. The solid moves outwards, then back.
/// @throws as opening()
[[nodiscard]] NarrowBand closing(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

enum class ShellSide {
  In,   ///< the solid's surface is the outer one
  Out,  ///< the solid's surface is the inner one
  Both  ///< half the thickness to each side
};

/// The wall of that thickness along the surface of a solid.
/// @param thickness  world units, at least a voxel
/// @throws UsageError unless `thickness` is finite and positive; InvalidInput if `solid` is empty,
///         the wall thinner than a voxel, or the solid so thin that no cavity is left in it;
///         ResourceLimit; Cancelled
[[nodiscard]] NarrowBand shell(const NarrowBand& solid, double thickness,
                               ShellSide side = ShellSide::In, const OffsetOptions& options = {});

}  // namespace levelset
