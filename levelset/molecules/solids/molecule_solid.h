#pragma once

#include "levelset/molecules/molecule_model.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct MoleculeSolidOptions {
  double halfWidth = 3;  ///< half width of the band, voxels, at least 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct MoleculeSolidResult {
  NarrowBand band;
  std::size_t balls = 0, bonds = 0;  ///< numbers of the balls and of the sticks, one for each bond
  double volume = 0;  ///< exact volume of a solid without sticks, Å³; 0 if it has sticks
};

/// Makes a solid of the balls and sticks of a molecule (moleculeModel()), for prints. The distances
/// are exact on both sides, up to 1e-9 Å.
/// @param voxelSize  Å; grid points lie at its integer multiples
/// @throws as moleculeModel() and moleculeSurface()
[[nodiscard]] MoleculeSolidResult moleculeSolid(const Molecule& molecule, double voxelSize,
                                                const MoleculeModelOptions& model = {},
                                                const MoleculeSolidOptions& options = {});

}  // namespace levelset
