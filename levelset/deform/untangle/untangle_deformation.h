#pragma once

#include <cstddef>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/control_lattice.h"
#include "levelset/deform/deformation.h"
#include "levelset/progress.h"

/// Removal of folds from lattices and cages.
namespace levelset {

struct UntangleOptions {
  /// Least Jacobian to reach, over the mean stretch of volume. In (0, 1).
  double leastShare = 0.05;
  /// Memory of the gradients at the test points, and of each certificate, bytes.
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Distances by which control points were moved, world units.
struct UntangleReport {
  std::size_t movedPoints = 0;    ///< points that were moved by more than 1e-9 of the diagonal
  double largestMove = 0;         ///< largest distance
  double rootMeanSquareMove = 0;  ///< over all control points
  std::size_t rounds = 0;         ///< certificates that were needed
};

struct UntangledLattice {
  ControlLattice lattice;
  UntangleReport report;
};
struct UntangledCage {
  CageDeformation cage;
  UntangleReport report;
};

/// Moves the control points of a lattice that folds by little, until its certificate proves that it
/// does not. The sum of the squared distances is minimised subject to a least Jacobian at test
/// points, by sequential quadratic programming [Hildreth57 for the quadratic part]; the place where
/// the certificate fails becomes a further test point. This finds a local minimum. If that fails,
/// all control points move towards the identity by the least share that suffices. A lattice that
/// does not fold is returned as it is.
/// @throws UsageError for a share out of range
/// @throws InvalidInput if the lattice overlaps itself without a fold, which is not repaired
/// @throws ResourceLimit, Cancelled
[[nodiscard]] UntangledLattice untangled(const ControlLattice& lattice,
                                         const UntangleOptions& options = {});

/// The same for the moved vertices of a cage, over a domain.
/// @throws InvalidInput also if the domain comes too close to the cage at rest or leaves it
[[nodiscard]] UntangledCage untangled(const CageDeformation& cage, const DeformationDomain& domain,
                                      const UntangleOptions& options = {});

}  // namespace levelset
