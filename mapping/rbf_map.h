#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <span>
#include <vector>

#include "levelset/progress.h"

/// Smooth maps from patch space to texture space through scattered particles.
namespace mapping {

struct RbfMapOptions {
  /// Relaxation of the interpolation, in mean particle spacings (kernel φ(r) = r is homogeneous of
  /// degree one): at the surface, and everywhere else. ≥ 0.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  levelset::Progress progress = {};
};

/// Φ(x) = A x + b + Σ ω_i |x − p_i|: the biharmonic spline through particles (p_i, uvw_i), smoothed by
/// φ − λ on the diagonal [Brodersen07 §8.3, with the sign of Carr01: |x| is conditionally negative].
class RbfMap {
 public:
  /// @param points, targets  n each; @param near  n, true where lambdaNear applies
  /// @throws InvalidInput for fewer than 4 points, points in one plane, or a solve that fails
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const;
  /// Rows are the gradients of u, v and w.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const;
  /// A number L with |Φ(x) − Φ(y)| ≤ L |x − y| for all x, y in the ball about `center`.
  [[nodiscard]] double lipschitz(const Imath::V3d& center, double radius) const;
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  std::vector<Imath::V3d> points_;
  std::vector<Imath::V3d> weights_;  ///< one ω per particle, for u, v, w
  Imath::V3d origin_;                ///< positions are taken relative to this
  Imath::M33d linear_;               ///< rows: gradients of the affine part
  Imath::V3d constant_;
  double maxResidual_ = 0;
};

}  // namespace mapping
