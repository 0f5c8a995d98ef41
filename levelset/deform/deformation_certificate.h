#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>

/// Proof that a deformation folds nowhere.
namespace levelset {

enum class FoldVerdict {
  Certified,  ///< the Jacobian is positive in the entire domain
  Folds,      ///< the Jacobian is zero or negative at a known point
  Undecided   ///< no fold was found, but the bounds do not exclude one
};
[[nodiscard]] const char* foldVerdictName(FoldVerdict verdict);
/// Verdict on a least Jacobian between two bounds. @param high  value that the Jacobian has
[[nodiscard]] FoldVerdict verdictOf(double low, double high);

struct FoldCertificate {
  FoldVerdict verdict = FoldVerdict::Undecided;
  /// Bracket of the least Jacobian determinant in the domain: a proven lower bound, and the least
  /// value found. Volume ratio of deformed to undeformed.
  double leastLow = 0, leastHigh = 0;
  Imath::V3d place{0};  ///< point of `leastHigh`, world coordinates before the deformation
  /// Polynomial pieces of a lattice or triangles of a cage, and boxes that were bounded.
  std::size_t pieces = 0, boxes = 0;
  /// True when triangles of the deformed surface intersect: the result overlaps itself although the
  /// map may fold nowhere. Of a lattice, it is the surface of its box.
  bool overlaps = false;
  Imath::V3d overlapPlace{0};  ///< a point of an overlap, world coordinates after the deformation
  const char* subject = "lattice";  ///< the deformation in words
  /// Boxes at `place` reach a face of the cage, where the bounds fail.
  bool isNearCage = false;

  /// Returns true for a map that is proven to fold nowhere, and whose surfaces do not intersect.
  [[nodiscard]] bool isInjective() const { return verdict == FoldVerdict::Certified && !overlaps; }
};

/// Returns the certificate in one line of text.
[[nodiscard]] std::string describe(const FoldCertificate& certificate);

/// Refuses a map that is not proven to be injective.
/// @throws InvalidInput with the place of the fold, of the open question or of the overlap
void requireInjective(const FoldCertificate& certificate);

}  // namespace levelset
