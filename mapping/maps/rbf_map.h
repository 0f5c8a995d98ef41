#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "levelset/progress.h"
#include "mapping/maps/patch_map.h"
#include "mapping/maps/rbf_sum.h"

/// Smooth maps from patch space to texture space through scattered particles.
namespace mapping {

struct RbfMapOptions {
  /// Relaxation of the interpolation, in mean particle spacings (kernel φ(r) = r is homogeneous of
  /// degree one): at the surface, and everywhere else. ≥ 0.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Φ(x) = A x + b + Σ ω_i |x − p_i|: the biharmonic spline through particles (p_i, uvw_i), smoothed
/// by φ − λ on the diagonal [Brodersen07 §8.3, with the sign of Carr01: |x| is conditionally
/// negative]. Affine maps are reproduced exactly whatever λ. Setting up takes n² doubles and n³/3
/// operations.
class RbfMap final : public PatchMap {
 public:
  /// @param points, targets  n each; @param near  n, true where lambdaNear applies
  /// @throws UsageError for λ that is negative or not finite; InvalidInput for fewer than 5 points,
  ///         points in one plane, two points in one place, numbers that are not finite, or a solve
  ///         that fails; ResourceLimit before the matrix is allocated
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  /// At a particle, its own kink counts nothing.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  /// Largest residual in u, v and w apart.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return axisResidual_; }
  /// Mean distance of a particle to its nearest neighbour, world units.
  [[nodiscard]] double meanSpacing() const { return meanSpacing_; }
  [[nodiscard]] std::size_t size() const { return count_; }
  /// Positions relative to origin(), and weights.
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  [[nodiscard]] const Imath::V3d& origin() const { return origin_; }
  /// Rows: gradients of the affine part; its value at origin().
  [[nodiscard]] const Imath::M33d& linearPart() const { return linear_; }
  [[nodiscard]] const Imath::V3d& constantPart() const { return constant_; }

 private:
  friend class RbfBlock;
  void solve(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
             std::span<const double> lambda);
  void measureResidual(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets);
  [[nodiscard]] Imath::V3d affine(const Imath::V3d& local) const;

  std::size_t count_ = 0;
  std::vector<RbfParticle> particles_;  ///< positions relative to origin_
  std::vector<double> weightNorm_;      ///< |ω_i|, per particle
  Imath::V3d origin_{0};                ///< positions are taken relative to this
  Imath::M33d linear_;                  ///< rows: gradients of the affine part
  Imath::V3d constant_{0};
  double maxResidual_ = 0, meanSpacing_ = 0;
  Imath::V3d axisResidual_{0};
};

}  // namespace mapping
