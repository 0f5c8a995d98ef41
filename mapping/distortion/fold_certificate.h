#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

/// Proofs that a map turns over nowhere in the texture's part of patch space, not only where it was
/// looked at.
namespace mapping {

class RbfMap;
class PrismMap;

enum class FoldVerdict {
  Certified,  ///< the Jacobian is positive everywhere
  Folds,      ///< it is not at some place
  Undecided   ///< no fold was met, but parts are left that were not decided
};
[[nodiscard]] const char* foldVerdictName(FoldVerdict verdict);

/// A place where a map turns over.
struct FoldPoint {
  Imath::V3d position{0}, uvw{0};
  double jacobian = 0;  ///< in the unit of FoldCertificate::leastJacobian
};

struct FoldCertificate {
  static constexpr std::size_t kMostPoints = 5;
  std::size_t pieces = 0;  ///< tetrahedra, or parts of cells, that were judged
  /// Of the volume, in the space that the map starts from: not positive for certain, and not
  /// decided.
  double foldedShare = 0, undecidedShare = 0;
  /// The least determinant that was met, over its median: of texture → patch for shells and meshes,
  /// of patch → texture for the smooth map, each in the direction in which it is given. 1 for a
  /// box, ≤ 0 folds.
  double leastJacobian = 0;
  double unit = 1;               ///< that median: world units³ a unit cube, or its reciprocal
  std::vector<FoldPoint> worst;  ///< of different cells, the worst first; at most kMostPoints

  [[nodiscard]] FoldVerdict verdict() const {
    if (!worst.empty()) return FoldVerdict::Folds;
    return undecidedShare > 0 ? FoldVerdict::Undecided : FoldVerdict::Certified;
  }
};

/// Of the map that is straight in tetrahedra: the exact sign of each [Shewchuk97].
[[nodiscard]] FoldCertificate certifyPrisms(const PrismMap& map, bool isMirrored);

/// Of the map that is straight between particles (see layer_map.h): Bernstein coefficients of the
/// determinant of each trilinear cell. What cannot be told from zero by rounding folds.
/// @param sink  in w, see PrismCells
[[nodiscard]] FoldCertificate certifyLayers(const Patch& patch, double embedDepth);

/// Of the smooth map: in a box about c the slopes are J(c) (I + E) with |E| bounded through the
/// Taylor polynomials of the particles that are far and the kinks of those that are near; where
/// |E| < 1 the determinant has the sign of that of J(c). Boxes are halved until that decides them,
/// or their number passes a bound. Looked at are the boxes of the particles' cells, as far as the
/// map sends them into the unit cube, and `sink` below it. The bounds are those of φ(r) = r: of
/// another kernel nothing is decided, and its least Jacobian is not looked for.
[[nodiscard]] FoldCertificate certifyRbf(const RbfMap& map, const Patch& patch, double embedDepth);

/// Of several maps: pieces are added up, shares and the least Jacobian are those of the map where
/// they are worst, and the worst of all places are kept. @pre certificates is not empty
[[nodiscard]] FoldCertificate worstOf(std::span<const FoldCertificate> certificates);

/// Texture coordinates and slopes of the smooth map at the samples' places: far particles by
/// polynomials, right to 1e-5 of the mean slope.
void evaluateRbf(const RbfMap& map, const Patch& patch, std::vector<MapSample>& samples);

/// As sampleMap in distortion.h; where there are many particles, by evaluateRbf.
[[nodiscard]] std::vector<MapSample> sampleRbf(const RbfMap& map, const Patch& patch,
                                               double embedDepth);

}  // namespace mapping
