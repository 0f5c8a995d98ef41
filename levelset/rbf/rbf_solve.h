#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <Eigen/Core>
#include <vector>

#include "levelset/rbf/rbf_cloud.h"
#include "levelset/rbf/sums/rbf_kernel.h"

namespace levelset::rbf {

/// Columns u, v and w; one row per particle.
using RbfColumns = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Weights orthogonal to the linear polynomials, and their product with the RBF matrix s φ + λ,
/// with s the sign of the kernel.
struct RbfFit {
  RbfColumns weights, image;
};

/// Coefficients of Φ(x) = constant + linear x + Σ weights_i φ(|x − p_i|), with x and p_i in the
/// coordinates of the cloud.
struct RbfSolution {
  std::vector<Imath::V3d> weights;
  Imath::V3d constant{0};
  Imath::M33d linear;  ///< gradients of u, v and w as rows
};

/// Solves for the weights. With s the kernel's sign, s φ + λ is positive definite on the vectors
/// orthogonal to the linear polynomials that the particles distinguish. The system is solved there
/// by Cholesky factorisation, or iteratively above options.denseLimit particles and if the factors
/// exceed options.maxMemory, but never for 500 particles or fewer. The sparse system of a compact
/// kernel is always solved by sparse factorisation. If the particles span fewer than
/// three directions, the affine part is completed so that it also scales the missing directions,
/// see RbfFunction.
/// @throws ResourceLimit if the memory estimate exceeds options.maxMemory
/// @throws NumericalError if the iteration stagnates
[[nodiscard]] RbfSolution solveRbf(const RbfCloud& cloud, const RbfOptions& options,
                                   RbfSolveReport& report);

/// Computes (s φ + λ) times the weights by direct summation, with s the sign of the kernel.
[[nodiscard]] RbfColumns multiplyDirectly(const RbfCloud& cloud, RbfKernel kernel,
                                          const RbfColumns& weights);

/// Matrix s φ + λ between chosen particles, with s the sign of the kernel.
[[nodiscard]] Eigen::MatrixXd rbfMatrix(const RbfCloud& cloud, RbfKernel kernel,
                                        std::span<const std::uint32_t> chosen);

}  // namespace levelset::rbf
