#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/deform/deformation.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct DeformPatchesOptions {
  /// Deformed base, onto which the particles at w = 0 are moved; null: they stay where the map
  /// moves them. It must outlive the call.
  const levelset::NarrowBand* onto = nullptr;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct DeformPatchesResult {
  std::vector<Patch> patches;
  levelset::FoldCertificate certificate;
  /// Largest distance by which a particle at w = 0 was moved onto the base, world units.
  double largestSnap = 0;
};

/// Deforms patches. The map moves the corners, all particles and their rims. So the layers keep
/// their texture coordinates, but are no iso-surfaces of φ any more. The height of a patch is
/// multiplied by the ratio of the mean distances between its first and its last layer. Particles
/// that patches share stay equal to the bit. An identity returns the patches, unless `onto` is
/// given.
///
/// The certificate of a cage covers the space of the patches without their rims, that of a lattice
/// its entire box.
/// @throws InvalidInput for a map that is not proven to be injective, a particle where it is not
///         defined, or a particle further than a voxel from the surface of `onto`
/// @throws ResourceLimit, Cancelled
[[nodiscard]] DeformPatchesResult deformPatches(std::span<const Patch> patches,
                                                const levelset::Deformation& deformation,
                                                const DeformPatchesOptions& options = {});

/// Positions of all particles of patches, with their rims.
[[nodiscard]] std::vector<Imath::V3d> particlesOf(std::span<const Patch> patches);

}  // namespace mapping
