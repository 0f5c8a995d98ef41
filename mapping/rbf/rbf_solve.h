#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <Eigen/Core>
#include <vector>

#include "mapping/fast_sums/rbf_kernel.h"
#include "mapping/rbf/rbf_cloud.h"

namespace mapping {

struct RbfMapOptions;

using RbfColumns = Eigen::Matrix<double, Eigen::Dynamic, 3>;  ///< of u, v and w, a row a particle

/// Weights orthogonal to the polynomials, and s φ + λ times them.
struct RbfFit {
  RbfColumns weights, image;
};

/// Φ(x) = constant + linear x + Σ weights_i φ(|x − p_i|), in the coordinates of the cloud.
struct RbfSolution {
  std::vector<Imath::V3d> weights;
  Imath::V3d constant{0};
  Imath::M33d linear;  ///< rows: gradients
};

/// With s the kernel's sign, s φ + λ is positive definite on the vectors that are orthogonal to the
/// polynomials that the particles tell apart, and there the system is solved: by Cholesky's
/// factors, or by iteration beyond options.denseLimit and where the factors pass options.maxMemory.
/// Where the particles spread in fewer than three directions, the affine part is completed by a
/// similarity: see RbfMap.
/// @throws ResourceLimit before too much is allocated; NumericalError where iteration stands still
[[nodiscard]] RbfSolution solveRbf(const RbfCloud& cloud, const RbfMapOptions& options,
                                   RbfSolveReport& report);

/// (s φ + λ) times the weights, added up directly.
[[nodiscard]] RbfColumns multiplyDirectly(const RbfCloud& cloud, RbfKernel kernel,
                                          const RbfColumns& weights);

/// s φ + λ between chosen particles.
[[nodiscard]] Eigen::MatrixXd rbfMatrix(const RbfCloud& cloud, RbfKernel kernel,
                                        std::span<const std::uint32_t> chosen);

}  // namespace mapping
