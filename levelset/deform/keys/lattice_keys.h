#pragma once

#include <vector>

#include "levelset/deform/control_lattice.h"
#include "levelset/deform/keys/key_weights.h"

namespace levelset {

/// Checks that lattices can be interpolated: they must have the same box, degrees and knots, and
/// all or none of them weights.
/// @throws InvalidInput with the number of the first lattice that differs; the first has number 1
void requireSameLattices(const std::vector<ControlLattice>& keys);

/// Lattice between keys. Control points are interpolated in world coordinates, and weights on their
/// own.
/// @pre requireSameLattices() accepts the keys
/// @throws InvalidInput for interpolated weights that are not positive
[[nodiscard]] ControlLattice latticeBetween(const std::vector<ControlLattice>& keys,
                                            const std::vector<KeyWeight>& weights);

}  // namespace levelset
