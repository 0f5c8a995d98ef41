#pragma once

#include <cstddef>

#include "levelset/deform/control_lattice.h"
#include "levelset/deform/deformation_certificate.h"
#include "levelset/progress.h"

/// Proof that a lattice folds nowhere in its box.
namespace levelset {

struct LatticeCertificateOptions {
  double tolerance = 0.01;        ///< width of the bracket over the least Jacobian
  std::size_t mostBoxes = 20000;  ///< limit of the boxes that are halved
  /// Memory of the boxes that are not decided yet, bytes.
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Bounds the Jacobian determinant in the box. On each piece the determinant is a polynomial of
/// degree (3l − 1, 3m − 1, 3n − 1); with weights its numerator has the degree (4l − 1, 4m − 1,
/// 4n − 1). Its Bernstein coefficients bound it. Boxes are halved, the one with the least bound
/// first, until the least value is bracketed. A determinant that is zero within rounding errors
/// counts as a fold.
///
/// A positive Jacobian proves that the map is injective near each point, not that it is injective.
/// It is if the map of the faces is injective as well. The faces are tested as triangles between
/// samples, by exact predicates: this finds overlaps larger than the triangles' chord errors.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] FoldCertificate certifyLattice(const ControlLattice& lattice,
                                             const LatticeCertificateOptions& options = {});

}  // namespace levelset
