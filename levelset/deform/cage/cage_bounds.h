#pragma once

#include <Imath/ImathVec.h>

#include "levelset/deform/cage/cage.h"

namespace levelset::cage {

/// Bounds of a cage deformation in a ball. Internal.
struct BallBounds {
  /// False if the ball reaches the cage, or is too large: there is no bound.
  bool isBounded = false;
  bool isNearCage = false;  ///< the ball reaches the cage
  DeformationJet centre;    ///< at the centre of the ball
  /// Largest spectral norm of the Jacobian minus that at the centre.
  double spread = 0;
  /// Lower bound of the determinant of the Jacobian; negative infinity: none.
  double least = 0;
  /// Largest stretch in the ball.
  double stretch = 0;
};

/// Bounds the Jacobian in a ball [docs/deform.md]. With the affine map A at the centre, the
/// deformation minus A is given by the same coordinates and vertices p'_i − A(p_i). Its second
/// derivatives are integrals over the cage of kernels whose norms are known.
[[nodiscard]] BallBounds ballBounds(const CageDeformation& cage, const Imath::V3d& centre,
                                    double radius);

}  // namespace levelset::cage
