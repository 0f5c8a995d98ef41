#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

/// Proofs that a map is nowhere inverted in the part of patch space that holds the texture, not
/// only at sample points.
namespace mapping {

class RbfMap;
class PrismMap;

enum class FoldVerdict {
  Certified,  ///< the Jacobian is positive everywhere
  Folds,      ///< the Jacobian is zero or negative at a known point
  Undecided   ///< no fold was found, but some parts remain undecided
};
[[nodiscard]] const char* foldVerdictName(FoldVerdict verdict);

/// A point where a map is inverted.
struct FoldPoint {
  Imath::V3d position{0}, uvw{0};  ///< world position; texture coordinates
  double jacobian = 0;             ///< determinant / median, as FoldCertificate::leastJacobian
};

struct FoldCertificate {
  static constexpr std::size_t kMostPoints = 5;
  std::size_t pieces = 0;  ///< number of tetrahedra, parts of cells, or cubes that were tested
  /// Shares of the tested volume that certainly fold and that remain undecided. The volume is in
  /// world space for smooth maps, in texture space otherwise.
  double foldedShare = 0, undecidedShare = 0;
  /// Least Jacobian determinant found, divided by the median determinant; 1 if the patch is a box,
  /// ≤ 0 at folds. Prism maps and meshes use the determinant of texture → patch, smooth maps that
  /// of patch → texture, each in the direction in which the map is defined.
  double leastJacobian = 0;
  /// Median determinant, world units³ per unit cube; for smooth maps unit cubes per world unit³.
  double unit = 1;
  /// Folds in different cells or cubes, the least Jacobian first; at most kMostPoints.
  std::vector<FoldPoint> worst;

  [[nodiscard]] FoldVerdict verdict() const {
    if (!worst.empty()) return FoldVerdict::Folds;
    return undecidedShare > 0 ? FoldVerdict::Undecided : FoldVerdict::Certified;
  }
};

/// Certifies a prism map by the exact sign of the determinant of each tetrahedron [Shewchuk97].
[[nodiscard]] FoldCertificate certifyPrisms(const PrismMap& map, bool isMirrored);

/// Certifies the piecewise linear map of the particle layers (see layer_map.h) by the Bernstein
/// coefficients of the determinant of each trilinear cell. A determinant that is zero within
/// rounding errors counts as a fold.
/// @param embedDepth  depth of the texture below the surface, in w; negative: its lift above w = 1
[[nodiscard]] FoldCertificate certifyLayers(const Patch& patch, double embedDepth);

/// Certifies a smooth map (an RBF map). In a cube around c the Jacobian is J(c) (I + E). The bound
/// on |E| comes from the Taylor polynomials of the far particles and from the near particles, at
/// which the map is not smooth. If |E| < 1, the determinant has the sign of det J(c) in the entire
/// cube. Cubes are halved until they are decided, or until their number exceeds a limit. The cubes
/// cover the cells of the particles, as far as the map sends them into the unit cube or down to
/// `embedDepth` below it. The bounds hold for the kernel φ(r) = r. With other kernels the map stays
/// undecided, and `leastJacobian` is NaN.
[[nodiscard]] FoldCertificate certifyRbf(const RbfMap& map, const Patch& patch, double embedDepth);

/// Combines several certificates. Pieces are summed; shares and the least Jacobian are those of the
/// worst map; the worst points of all maps are kept.
/// @pre certificates is not empty
[[nodiscard]] FoldCertificate worstOf(std::span<const FoldCertificate> certificates);

/// Computes texture coordinates and Jacobians of a smooth map at the positions of the samples. Far
/// particles are summed by polynomials; the error of the slopes is at most 1e-5 of the mean slope.
void evaluateRbf(const RbfMap& map, const Patch& patch, std::vector<MapSample>& samples);

/// Samples a smooth map like sampleMap in distortion.h, by evaluateRbf if there are 4000 particles
/// or more and the kernel is φ(r) = r.
[[nodiscard]] std::vector<MapSample> sampleRbf(const RbfMap& map, const Patch& patch,
                                               double embedDepth);

}  // namespace mapping
