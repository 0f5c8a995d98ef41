#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Steps shared by the functions that build patches, such as makePatch and makeDecal.
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

/// Number of particles at a spacing s: (u/s + 3)(v/s + 3), including rims, summed over all given
/// layers of size u × v.
[[nodiscard]] double particlesAt(double spacing, std::span<const LayerSize> layers);

/// Chooses the spacing that gives about two thousand particles over all layers, world units; at
/// least 1.5 voxels.
/// @param times  number of patch layers that each given layer stands for
[[nodiscard]] double chooseSpacing(double voxelSize, std::span<const LayerSize> layers,
                                   std::size_t times = 1);

/// Number of particles along a length, at least four.
/// @throws ResourceLimit for more than a million
[[nodiscard]] std::size_t countAlong(double length, double spacing);

/// Checks the total number of particles of a patch.
/// @throws ResourceLimit for more than a million, or more than the memory limit allows
void checkParticleCount(double count, double spacing, const PatchOptions& options);

/// Computes distances to the base in the space above a patch, given points along the outline of the
/// patch.
/// @param lean  further sideways distance that slanted layers need, world units; a quarter of the
///         patch's shorter side is always added
[[nodiscard]] levelset::NarrowBand sweepAbove(const levelset::NarrowBand& base,
                                              std::span<const Imath::V3d> outline,
                                              const LayerSize& size, double height,
                                              const PatchOptions& options, double lean = 0);

/// Schemes A and C: builds the layers by moving the particles of the surface. A layer whose
/// particle spacing comes to differ by over a quarter from that on the surface is resampled, unless
/// the options give the numbers of cells.
[[nodiscard]] std::vector<ParticleLayer> layersFromSurface(const levelset::NarrowBand& base,
                                                           const ParticleLayer& surface,
                                                           std::span<const Imath::V3d> outline,
                                                           const LayerSize& size, double height,
                                                           const PatchOptions& options,
                                                           PatchReport& report);

/// Checks that an open surface lies under the entire layer, at samples one voxel apart. A closed
/// solid always passes.
/// @throws InvalidInput with the position where the surface breaks off
void requireCovered(const levelset::NarrowBand& base, const ParticleLayer& layer);

/// Twists, tapers and bends the layers as the options request. Adds the mean spacing to the patch,
/// and the variation of the cell areas to the report.
void finishPatch(const levelset::NarrowBand& base, const PatchOptions& options, Patch& patch,
                 PatchReport& report);

}  // namespace mapping
