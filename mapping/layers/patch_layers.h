#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// What all ways of making a patch share.
namespace mapping {

/// As one would give it on the command line, to the last bit.
[[nodiscard]] std::string pointAsOption(const Imath::V3d& p);

/// @param action  begins the message
/// @throws UsageError for a height that is not positive and options out of range
void checkPatchOptions(const char* action, double height, const PatchOptions& options);

/// Mean lengths of a layer's rows and columns, world units.
struct LayerSize {
  double u, v;
};

[[nodiscard]] LayerSize sizeOf(const ParticleLayer& layer);

/// (u/s + 3)(v/s + 3), rims and all, summed over the layers.
[[nodiscard]] double particlesAt(double spacing, std::span<const LayerSize> layers);

/// The spacing that makes some two thousand particles of all layers together, and no less than 1.5
/// voxels.
/// @param times  how often each layer comes
[[nodiscard]] double chooseSpacing(double voxelSize, std::span<const LayerSize> layers,
                                   std::size_t times = 1);

/// How many particles lie along a length, at least four. @throws ResourceLimit for over a million
[[nodiscard]] std::size_t countAlong(double length, double spacing);

/// @throws ResourceLimit for more than a million, or more than memory holds
void checkParticleCount(double count, double spacing, const PatchOptions& options);

/// Distances throughout patch space, from points along the outline.
/// @param lean  how far layers may leave the room above the outline sideways, world units
[[nodiscard]] levelset::NarrowBand sweepAbove(const levelset::NarrowBand& base,
                                              std::span<const Imath::V3d> outline,
                                              const LayerSize& size, double height,
                                              const PatchOptions& options, double lean = 0);

/// Schemes A and C: the particles on the surface travel. Unless the options give counts, a layer
/// that travel and taper spread or crowd by over a quarter gets the surface's spacing again.
[[nodiscard]] std::vector<ParticleLayer> layersFromSurface(const levelset::NarrowBand& base,
                                                           const ParticleLayer& surface,
                                                           std::span<const Imath::V3d> outline,
                                                           const LayerSize& size, double height,
                                                           const PatchOptions& options,
                                                           PatchReport& report);

/// An open surface lies under all of a layer, looked for every two voxels; a solid does anyway.
/// @throws InvalidInput with the place where it breaks off
void requireCovered(const levelset::NarrowBand& base, const ParticleLayer& layer);

/// Turns, scales and bends the layers as the options ask, and measures them.
void finishPatch(const levelset::NarrowBand& base, const PatchOptions& options, Patch& patch,
                 PatchReport& report);

}  // namespace mapping
