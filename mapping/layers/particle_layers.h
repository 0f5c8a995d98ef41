#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/layers/relaxation.h"
#include "mapping/patches/patch.h"

/// Builds the particles of a patch, layer by layer [Brodersen07 §8.2].
namespace mapping {

/// Sides of a patch on one layer as polylines, between the corners 0 → 1, 1 → 2, 3 → 2 and 0 → 3.
/// Opposite sides run in the same direction.
using PatchSides = std::array<std::vector<Imath::V3d>, 4>;

/// Computes the geodesic sides between the corners on φ = height, through the given points between
/// them.
/// @param between  points on φ = height on each side; often none
/// @param below    sides on the layer below, whose course the new sides follow if possible; or
///         nullptr
/// @param ground   sides on the surface, or nullptr. A path longer than four times the sum of the
///         side's length there and the height is rejected.
/// @throws InvalidInput if the surface does not connect two corners, or only by a rejected path
[[nodiscard]] PatchSides makeSides(const levelset::NarrowBand& band, double height,
                                   const std::array<Imath::V3d, 4>& corners,
                                   const PatchSides& between = {},
                                   const PatchSides* below = nullptr,
                                   const PatchSides* ground = nullptr);

/// Mean length of the two sides along u, and of the two sides along v; world units.
[[nodiscard]] double sideLengthU(const PatchSides& sides);
[[nodiscard]] double sideLengthV(const PatchSides& sides);

/// Fills a layer with a grid of particles blended between the sides, projected onto φ =
/// layer.height and relaxed. Adds the rim around it.
/// @param layer  input with counts, w and height; its positions and rim are computed
/// @param guide  distances to the base, possibly on a coarser grid, that cover all positions
///         blended between the sides
/// @throws InvalidInput if no path on φ = layer.height joins opposite side points
Relaxation fillLayer(const levelset::NarrowBand& band, const levelset::NarrowBand& guide,
                     const PatchSides& sides, ParticleLayer& layer);

/// Computes the rim: one particle beyond each end of the rows and columns, at their last spacing.
/// Where the surface ends or turns away, rows and columns continue straight through space, so that
/// no rim particle folds back under the layer.
void addRim(const levelset::NarrowBand& band, ParticleLayer& layer);

/// Moves points along ∇φ from one height to another, in steps of at most half a voxel (RK2).
/// @throws InvalidInput where a point meets the medial axis of the base before height `to`
void advectPoints(const levelset::NarrowBand& band, double from, double to,
                  std::span<Imath::V3d> points);

/// Moves points straight along unit directions from below φ = height up to it.
/// @throws InvalidInput where φ = height is further away than ten times the height difference
void raisePoints(const levelset::NarrowBand& band, double height,
                 std::span<const Imath::V3d> directions, std::span<Imath::V3d> points);

}  // namespace mapping
