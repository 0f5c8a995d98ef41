#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Steps shared by all functions that build patches.
namespace mapping {

/// Formats a point as on the command line, exact to the last bit.
[[nodiscard]] std::string pointAsOption(const Imath::V3d& p);

/// Checks the height and options of a patch.
/// @throws UsageError for a height that is not positive and options out of range
void checkPatchOptions(double height, const PatchOptions& options);

/// Mean lengths of a layer's rows and columns, world units.
struct LayerSize {
  double u, v;
};

[[nodiscard]] LayerSize sizeOf(const ParticleLayer& layer);

/// Particle count at a spacing s: (u/s + 3)(v/s + 3), including rims, summed over the layers.
[[nodiscard]] double particlesAt(double spacing, std::span<const LayerSize> layers);

/// Spacing that gives about two thousand particles over all layers; at least 1.5 voxels.
/// @param times  number of copies of each layer
[[nodiscard]] double chooseSpacing(double voxelSize, std::span<const LayerSize> layers,
                                   std::size_t times = 1);

/// Number of particles along a length, at least four.
/// @throws ResourceLimit for over a million
[[nodiscard]] std::size_t countAlong(double length, double spacing);

/// Checks the total particle count.
/// @throws ResourceLimit for more than a million, or more than the memory limit allows
void checkParticleCount(double count, double spacing, const PatchOptions& options);

/// Computes distances throughout patch space, from points along the outline.
/// @param lean  how far layers may extend sideways beyond the space above the outline, world units
[[nodiscard]] levelset::NarrowBand sweepAbove(const levelset::NarrowBand& base,
                                              std::span<const Imath::V3d> outline,
                                              const LayerSize& size, double height,
                                              const PatchOptions& options, double lean = 0);

/// Schemes A and C: builds the layers by moving the particles of the surface. Unless the options
/// give counts, a layer whose spacing travel and taper change by over a quarter is resampled at the
/// surface's spacing.
[[nodiscard]] std::vector<ParticleLayer> layersFromSurface(const levelset::NarrowBand& base,
                                                           const ParticleLayer& surface,
                                                           std::span<const Imath::V3d> outline,
                                                           const LayerSize& size, double height,
                                                           const PatchOptions& options,
                                                           PatchReport& report);

/// Checks that an open surface lies under the entire layer, sampled every two voxels. A closed
/// solid always passes.
/// @throws InvalidInput with the position where the surface breaks off
void requireCovered(const levelset::NarrowBand& base, const ParticleLayer& layer);

/// Twists, tapers and bends the layers as the options request, and measures them.
void finishPatch(const levelset::NarrowBand& base, const PatchOptions& options, Patch& patch,
                 PatchReport& report);

}  // namespace mapping
