#pragma once

#include <vector>

#include "levelset/molecules/molecule.h"
#include "levelset/progress.h"

namespace levelset {

struct BondOptions {
  bool isByDistance = true;  ///< false: only the bonds that the file gives
  Progress progress = {};
};

/// Finds the bonds of a molecule: those that its file gives, and those by distance. Two atoms are
/// bonded if their distance is from 0.4 Å to the sum of their covalent radii and 0.45 Å. Atoms of
/// different alternate locations have no bond. A hydrogen atom without a bond of the file has at
/// most one, to the nearest atom. Helium, neon, argon and the metals lithium, sodium, potassium,
/// rubidium, caesium, calcium, strontium and barium, which are ions in molecules, have only the
/// bonds of the file. Time and memory are linear in the number of atoms.
/// @return each bond once, sorted
/// @throws InvalidInput if thousands of atoms lie within a few ångström, or a position is not
///         finite
/// @throws Cancelled
[[nodiscard]] std::vector<Bond> moleculeBonds(const Molecule& molecule,
                                              const BondOptions& options = {});

}  // namespace levelset
