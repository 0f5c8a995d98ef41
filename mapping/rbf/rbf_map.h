#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "levelset/progress.h"
#include "mapping/fast_sums/rbf_kernel.h"
#include "mapping/fast_sums/rbf_sum.h"
#include "mapping/maps/patch_map.h"
#include "mapping/rbf/rbf_cloud.h"

/// Smooth maps from patch space to texture space through scattered particles.
namespace mapping {

struct RbfMapOptions {
  RbfKernel kernel = RbfKernel::Biharmonic;
  /// Relaxation of the interpolation at the surface, and everywhere else: what is added to ±φ on
  /// the diagonal, where φ is of r in mean particle spacings. ≥ 0. For φ(r) = r it is a length in
  /// mean particle spacings; kernels that fall off have φ(0) = 1.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  /// Beyond so many particles, or where factors pass maxMemory, the system is solved by iteration.
  std::size_t denseLimit = 10000;
  /// Of an iterative solve: largest residual in u, v and w over the targets' extent.
  double solveTolerance = 1e-6;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Φ(x) = A x + b + Σ ω_i φ(|x − p_i|) through particles (p_i, uvw_i), smoothed by ±φ + λ on the
/// diagonal [Brodersen07 §8.3]; the sign is the kernel's, see RbfKernel: φ(r) = r is conditionally
/// negative, and needs φ − λ [Carr01]. Affine maps are reproduced exactly whatever λ, and a map
/// does not depend on the unit of length, nor on where and how the patch lies.
///
/// Linear polynomials suffice for all kernels, see RbfKernel. In the middle of the particles of a
/// smooth map the error at λ = 0 falls with the spacing h like h⁴ or faster for the kernels that
/// grow; like h² for the two that fall off, which shrink with the spacing. Setting up takes n²
/// doubles and n³/3 operations; or, by iteration, about 4 kB a particle, n² operations for each of
/// a few restarts, and n log n for each step between them, but n² again for kernels that grow
/// faster than r.
///
/// Particles in one place are one, with the mean of their targets. Where all particles lie in one
/// plane, A takes its normal to what is at right angles to the plane's image, lengthened by the
/// mean scale in the plane; on one line, A turns and scales as it does along the line, and a single
/// particle gives a constant.
class RbfMap final : public PatchMap {
 public:
  /// @param points, targets  n each; @param near  n, true where lambdaNear applies
  /// @throws UsageError for λ or a tolerance that is negative or not finite; InvalidInput for no
  ///         points, two points in one place whose targets are further apart than those of
  ///         neighbours, numbers that are not finite; ResourceLimit before the matrix is allocated;
  ///         NumericalError where the iteration stands still
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  /// At a particle, the kink of φ(r) = r counts nothing.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  /// Largest residual in u, v and w apart.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return axisResidual_; }
  /// Mean distance of a particle to its nearest neighbour, world units; 1 for a single one.
  [[nodiscard]] double meanSpacing() const { return spacing_; }
  /// Particles, those in one place once.
  [[nodiscard]] std::size_t size() const { return particles_.size(); }
  [[nodiscard]] const RbfSolveReport& solveReport() const { return solveReport_; }
  [[nodiscard]] RbfKernel kernel() const { return kernel_; }
  /// Positions in mean particle spacings about origin(), and weights.
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  [[nodiscard]] const Imath::V3d& origin() const { return origin_; }
  /// Rows: gradients of the affine part, for each mean particle spacing; its value at origin().
  [[nodiscard]] const Imath::M33d& linearPart() const { return linear_; }
  [[nodiscard]] const Imath::V3d& constantPart() const { return constant_; }

 private:
  friend class RbfBlock;
  void measureResidual(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets);
  /// @param local  in mean particle spacings about the origin, as all that follows
  [[nodiscard]] Imath::V3d affine(const Imath::V3d& local) const;

  RbfKernel kernel_;
  std::vector<RbfParticle> particles_;
  std::vector<double> weightNorm_;  ///< |ω_i|, per particle
  Imath::V3d origin_{0};            ///< world
  double spacing_ = 1;              ///< world
  Imath::M33d linear_;              ///< rows: gradients of the affine part
  Imath::V3d constant_{0};
  double maxResidual_ = 0;
  Imath::V3d axisResidual_{0};
  RbfSolveReport solveReport_;
};

}  // namespace mapping
