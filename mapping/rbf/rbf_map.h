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

/// Smooth maps from world positions to texture coordinates, through scattered particles.
namespace mapping {

struct RbfMapOptions {
  RbfKernel kernel = RbfKernel::Biharmonic;
  /// Relaxation λ ≥ 0 of the particles at the surface (lambdaNear) and of all others (lambdaFar).
  /// It is added to the diagonal of the matrix of ±φ(r), with φ the kernel and r the distance of
  /// two particles in mean particle spacings. For φ(r) = r, λ is a length in mean particle
  /// spacings; decaying kernels have φ(0) = 1.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  /// Support radius of a compact kernel, mean particle spacings, > 1. A larger radius reduces the
  /// error and increases the time, in proportion to its cube.
  double support = 4;
  /// Largest number of particles for a direct solution. Above it, or if the matrix factors exceed
  /// maxMemory, the system is solved iteratively. Systems of at most 500 particles are always
  /// solved directly.
  std::size_t denseLimit = 10000;
  /// Tolerance of the iterative solver: largest residual in u, v and w, as a share of the extent of
  /// the particles' texture coordinates.
  double solveTolerance = 1e-6;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Φ(x) = A x + b + Σ ω_i φ(|x − p_i|) through particles (p_i, uvw_i), smoothed by the matrix ±φ +
/// λ on the diagonal [Brodersen07 §8.3]. The sign is that of the kernel, see RbfKernel: φ(r) = r is
/// conditionally negative definite, and needs φ − λ [Carr01]. Affine maps are reproduced exactly
/// for every λ. A map does not depend on the unit of length, nor on the position and orientation of
/// the patch.
///
/// Linear polynomials suffice for all kernels, see RbfKernel. If the particles sample a smooth map
/// and λ = 0, the error inside their cloud decreases with their spacing h. It decreases as h⁴ or
/// faster for growing kernels. It decreases as h² for the three decaying kernels, whose width
/// shrinks with the spacing. For n particles, a direct solution takes n² doubles and n³/3
/// operations. An iterative solution takes about 4 kB per particle, n² operations for each of a few
/// restarts, and n log n for each step between them. For kernels that grow faster than r each step
/// takes n² operations. The matrix of a compact kernel is sparse. It is always factored, for any
/// denseLimit.
///
/// Coincident particles count as one, with the mean of their targets. If all particles lie in one
/// plane, A maps the plane's normal to the normal of the plane's image, scaled by the mean scale in
/// the plane. If they lie on one line, A is a similarity that follows the line. A single particle
/// gives a constant.
class RbfMap final : public PatchMap {
 public:
  /// Builds the map.
  /// @param points, targets  n positions in world units, and their n texture coordinates
  /// @param near  n values; true for particles with lambdaNear
  /// @throws UsageError for λ or a tolerance that is negative or not finite, and for the support
  ///         radius of a compact kernel that is not finite or not greater than 1
  /// @throws InvalidInput for no points, numbers that are not finite, and coincident points whose
  ///         targets differ by more than those of nearest neighbours do on average
  /// @throws ResourceLimit if the memory estimate of the solution exceeds options.maxMemory, before
  ///         it is allocated
  /// @throws NumericalError if the iteration stagnates
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  /// Jacobian of the map. At a particle the particle's own term adds nothing; for φ(r) = r it has
  /// no derivative there.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  /// Largest residual over the particles, for u, v and w separately.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return axisResidual_; }
  /// Mean distance of a particle to its nearest neighbour, world units; 1 for a single particle.
  [[nodiscard]] double meanSpacing() const { return spacing_; }
  /// Number of particles; coincident ones count once.
  [[nodiscard]] std::size_t size() const { return particles_.size(); }
  [[nodiscard]] const RbfSolveReport& solveReport() const { return solveReport_; }
  [[nodiscard]] RbfKernel kernel() const { return kernel_; }
  /// Unit of length of particles() and linearPart(), world units: the mean spacing, or the support
  /// radius of a compact kernel.
  [[nodiscard]] double unit() const { return unit_; }
  /// Particles with their weights; positions in units of unit() relative to origin().
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  [[nodiscard]] const Imath::V3d& origin() const { return origin_; }
  /// Affine part of the map: gradients of u, v and w as rows, per unit(); and its value
  /// at origin().
  [[nodiscard]] const Imath::M33d& linearPart() const { return linear_; }
  [[nodiscard]] const Imath::V3d& constantPart() const { return constant_; }

 private:
  friend class RbfBlock;
  void measureResidual(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets);
  /// Affine part of the map.
  /// @param local  position in units of unit() relative to the origin
  [[nodiscard]] Imath::V3d affine(const Imath::V3d& local) const;

  RbfKernel kernel_;
  std::vector<RbfParticle> particles_;
  std::vector<double> weightNorm_;  ///< |ω_i| of each particle
  Imath::V3d origin_{0};            ///< mean of the particle positions, world units
  double spacing_ = 1;  ///< mean distance of a particle to its nearest neighbour, world units
  double unit_ = 1;
  Imath::M33d linear_;  ///< gradients of the affine part as rows, per unit
  Imath::V3d constant_{0};
  double maxResidual_ = 0;
  Imath::V3d axisResidual_{0};
  RbfSolveReport solveReport_;
};

}  // namespace mapping
