#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>

#include "levelset/deform/control_lattice.h"
#include "levelset/progress.h"

/// Proof that a lattice folds nowhere in its box.
namespace levelset {

enum class LatticeVerdict {
  Certified,  ///< the Jacobian is positive in the entire box
  Folds,      ///< the Jacobian is zero or negative at a known point
  Undecided   ///< no fold was found, but the bounds do not exclude one
};
[[nodiscard]] const char* latticeVerdictName(LatticeVerdict verdict);

struct LatticeCertificate {
  LatticeVerdict verdict = LatticeVerdict::Undecided;
  /// Bracket of the least Jacobian determinant in the box: a proven lower bound, and the least
  /// value found. Volume ratio of deformed to undeformed.
  double leastLow = 0, leastHigh = 0;
  Imath::V3d place{0};  ///< point of `leastHigh`, world coordinates before the deformation
  std::size_t pieces = 0, boxes = 0;  ///< polynomial pieces, and boxes that were bounded
  /// True when triangles of the deformed faces of the box intersect: the deformed box overlaps
  /// itself although it may fold nowhere.
  bool overlaps = false;
  Imath::V3d overlapPlace{0};  ///< a point of an overlap, world coordinates after the deformation

  /// Returns true for a map that is proven to fold nowhere, and whose faces do not intersect.
  [[nodiscard]] bool isInjective() const {
    return verdict == LatticeVerdict::Certified && !overlaps;
  }
};

struct LatticeCertificateOptions {
  double tolerance = 0.01;        ///< width of the bracket over the least Jacobian
  std::size_t mostBoxes = 20000;  ///< limit of the boxes that are halved
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
/// @throws Cancelled
[[nodiscard]] LatticeCertificate certifyLattice(const ControlLattice& lattice,
                                                const LatticeCertificateOptions& options = {});

/// Returns the certificate in one line of text.
[[nodiscard]] std::string describe(const LatticeCertificate& certificate);

/// Refuses a map that is not proven to be injective.
/// @throws InvalidInput with the place of the fold, of the open question or of the overlap
void requireInjective(const LatticeCertificate& certificate);

}  // namespace levelset
