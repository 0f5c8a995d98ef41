#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <span>
#include <vector>

#include "levelset/rbf/rbf_cloud.h"
#include "levelset/rbf/sums/rbf_kernel.h"
#include "levelset/rbf/sums/rbf_sum.h"

/// Smooth functions through scattered particles.
namespace levelset::rbf {

/// Φ(x) = A x + b + Σ ω_i φ(|x − p_i|) through particles (p_i, t_i) with positions p_i and values
/// t_i of three components, smoothed by the matrix ±φ + λ on the diagonal [Brodersen07 §8.3]. The
/// sign is that of the kernel, see RbfKernel: φ(r) = r is conditionally negative definite, and
/// needs φ − λ [Carr01]. Affine functions are reproduced exactly for every λ. The function does not
/// depend on the unit of length, nor on the position and orientation of the particles.
///
/// Linear polynomials suffice for all kernels, see RbfKernel. If the particles sample a smooth
/// function and λ = 0, the error inside their cloud decreases with their spacing h. It decreases as
/// h⁴ or faster for growing kernels. It decreases as h² for the three decaying kernels, whose width
/// shrinks with the spacing. For n particles, a direct solution takes n² doubles and n³/3
/// operations. An iterative solution takes about 4 kB per particle, n² operations for each of a few
/// restarts, and n log n for each step between them. For kernels that grow faster than r each step
/// takes n² operations. The matrix of a compact kernel is sparse. It is always factored, for any
/// denseLimit.
///
/// Coincident particles count as one, with the mean of their values. If all particles lie in one
/// plane, A maps the plane's normal to the normal of the plane's image, scaled by the mean scale in
/// the plane. If they lie on one line, A is a similarity that follows the line. A single particle
/// gives a constant.
class RbfFunction {
 public:
  /// Fits the function.
  /// @param points, targets  n positions in world units, and their n values
  /// @param near  n flags; true for particles with lambdaNear
  /// @throws UsageError for λ or a tolerance that is negative or not finite, and for the support
  ///         radius of a compact kernel that is not finite or not greater than 1
  /// @throws InvalidInput for no points, numbers that are not finite, and coincident points whose
  ///         values differ by more than those of nearest neighbours do on average
  /// @throws ResourceLimit if the memory estimate of the solution exceeds options.maxMemory, before
  ///         it is allocated
  /// @throws NumericalError if the iteration stagnates
  RbfFunction(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
              std::span<const char> near, const RbfOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const;
  /// Jacobian of the function. At a particle the particle's own term adds nothing; for φ(r) = r it
  /// has no derivative there.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const;

  /// Largest |Φ(p_i) − t_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  /// Largest residual over the particles, for each component.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return axisResidual_; }
  /// Mean distance of a particle to its nearest neighbour, world units; 1 for a single particle.
  [[nodiscard]] double meanSpacing() const { return spacing_; }
  [[nodiscard]] const RbfSolveReport& solveReport() const { return solveReport_; }
  [[nodiscard]] RbfKernel kernel() const { return kernel_; }
  /// Unit of length of particles() and linearPart(), world units: the mean spacing, or the support
  /// radius of a compact kernel.
  [[nodiscard]] double unit() const { return unit_; }
  /// Particles with their weights, one for each position; positions in units of unit() relative to
  /// origin().
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  /// |ω_i| of each particle.
  [[nodiscard]] std::span<const double> weightNorms() const { return weightNorms_; }
  /// Mean of the positions of the particles, world units.
  [[nodiscard]] const Imath::V3d& origin() const { return origin_; }
  /// Affine part: gradients of the components as rows, per unit(); and its value at origin().
  [[nodiscard]] const Imath::M33d& linearPart() const { return linear_; }
  [[nodiscard]] const Imath::V3d& constantPart() const { return constant_; }
  /// Value of the affine part.
  /// @param local  position in units of unit() relative to the origin
  [[nodiscard]] Imath::V3d affine(const Imath::V3d& local) const;

 private:
  /// Values at many positions, by sums over all particles.
  [[nodiscard]] std::vector<Imath::V3d> valuesAt(std::span<const Imath::V3d> points) const;
  void measureResidual(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets);

  RbfKernel kernel_;
  std::vector<RbfParticle> particles_;
  std::vector<double> weightNorms_;
  Imath::V3d origin_{0};
  double spacing_ = 1;
  double unit_ = 1;
  Imath::M33d linear_;
  Imath::V3d constant_{0};
  double maxResidual_ = 0;
  Imath::V3d axisResidual_{0};
  RbfSolveReport solveReport_;
};

}  // namespace levelset::rbf
