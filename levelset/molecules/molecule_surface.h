#pragma once

#include <cstddef>
#include <vector>

#include "levelset/molecules/molecule.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Solids of molecules, with exact distances to their surfaces.
namespace levelset {

enum class MoleculeSurface {
  VanDerWaals,  ///< union of the balls of the atoms
  Accessible,   ///< the same with radii larger by that of the probe: where its centre cannot be
  Excluded      ///< all that the ball of the probe cannot reach [Connolly83]
};

struct MoleculeSurfaceOptions {
  MoleculeSurface kind = MoleculeSurface::Excluded;
  double probe = 1.4;     ///< radius of the probe, Å, positive; van der Waals surfaces ignore it
  double halfWidth = 3;   ///< half width of the band, voxels, at least 1
  bool volumes = false;   ///< true: divides the volume among the atoms
  bool cavities = false;  ///< true: lists the cavities
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// A void inside a molecule that its surface encloses.
struct MoleculeCavity {
  /// Å³ and Å². Exact for the van der Waals and the accessible surface; those of the mesh of the
  /// band for the excluded one. Atoms in the cavity that touch no other atom are not
  /// subtracted.
  double volume = 0, area = 0;
  std::vector<std::uint32_t> atoms = {};  ///< atoms that bound it, sorted
};

struct MoleculeSurfaceResult {
  NarrowBand band;
  /// Exact area of the sphere of each atom outside all other ones, Å²: of the accessible surface,
  /// or of the van der Waals surface if that was asked for.
  std::vector<double> areas;
  /// Exact volume of the union of those spheres' balls, Å³.
  double volume = 0;
  /// The part of that volume for each atom: its ball within its cell of the power diagram, Å³.
  std::vector<double> volumes = {};
  std::vector<MoleculeCavity> cavities = {};  ///< the largest first
  /// Number of distances beside edges of an excluded surface that are lower bounds, since many
  /// probes meet there.
  std::size_t unfinished = 0;
};

/// Makes the solid of a molecule. Radii are vanDerWaalsRadius().
/// @param voxelSize  Å; grid points lie at its integer multiples
/// @throws UsageError for options out of range
/// @throws InvalidInput for a molecule without atoms, or when the voxel is larger than it
/// @throws ResourceLimit, Cancelled
[[nodiscard]] MoleculeSurfaceResult moleculeSurface(const Molecule& molecule, double voxelSize,
                                                    const MoleculeSurfaceOptions& options = {});

/// Sums of areas or volumes of atoms over their residues. @param areas  one for each atom
[[nodiscard]] std::vector<double> residueAreas(const Molecule& molecule,
                                               const std::vector<double>& areas);

}  // namespace levelset
