#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/layers/relaxation.h"
#include "mapping/patches/patch.h"

/// Particles of a patch, layer by layer [Brodersen07 §8.2].
namespace mapping {

/// Sides of a patch on one layer: 0 → 1, 1 → 2, 3 → 2 and 0 → 3, so that opposite sides run alike.
using PatchSides = std::array<std::vector<Imath::V3d>, 4>;

/// Geodesics between the corners on φ = height, and through the points between them.
/// @param between  points on φ = height that a side passes on its way; often none
/// @param below    the sides on the layer below, which these run like where they can; or nullptr
/// @param ground   the sides on the surface, or nullptr: a side that is over four times as long as
/// its own there and the height is none
/// @throws InvalidInput when two corners are not joined, or by such a side only
[[nodiscard]] PatchSides makeSides(const levelset::NarrowBand& band, double height,
                                   const std::array<Imath::V3d, 4>& corners,
                                   const PatchSides& between = {},
                                   const PatchSides* below = nullptr,
                                   const PatchSides* ground = nullptr);

/// Mean length of the sides along u, and along v.
[[nodiscard]] double sideLengthU(const PatchSides& sides);
[[nodiscard]] double sideLengthV(const PatchSides& sides);

/// A grid of particles swept between the sides onto φ = layer.height and relaxed, and the rim
/// around it.
/// @param layer  with its counts, w and height; its positions are made
/// @param guide  distances, perhaps coarser, that reach where the blend of the sides may lie
/// @throws InvalidInput where the surface cannot be followed
Relaxation fillLayer(const levelset::NarrowBand& band, const levelset::NarrowBand& guide,
                     const PatchSides& sides, ParticleLayer& layer);

/// Makes the rim: rows and columns go on by their last spacing; straight through space where the
/// surface ends or turns away, so that no particle comes to lie behind others.
void addRim(const levelset::NarrowBand& band, ParticleLayer& layer);

/// Carries points along ∇φ from one height to another, in steps of at most half a voxel (RK2).
/// @throws InvalidInput where one meets the medial axis of the base before that height
void advectPoints(const levelset::NarrowBand& band, double from, double to,
                  std::span<Imath::V3d> points);

/// Carries points straight along unit directions to φ = height, from below it.
/// @throws InvalidInput where a way does not get there within ten times the difference
void raisePoints(const levelset::NarrowBand& band, double height,
                 std::span<const Imath::V3d> directions, std::span<Imath::V3d> points);

}  // namespace mapping
