#pragma once

#include <Eigen/SparseCore>

#include "levelset/rbf/rbf_solve.h"

namespace levelset::rbf {

/// Lower triangle of the matrix s φ + λ of a compact kernel. It has an entry for each pair of
/// particles within the support radius.
/// @throws ResourceLimit if the matrix exceeds options.maxMemory, before it is allocated
[[nodiscard]] Eigen::SparseMatrix<double, Eigen::ColMajor, Eigen::Index> sparseRbfMatrix(
    const RbfCloud& cloud, const RbfOptions& options);

/// Computes the weights of solveRbf for a compact kernel, by sparse Cholesky factors and the Schur
/// complement of the linear polynomials.
/// @param polynomial  values of the linear polynomials at the n particles, n × (1 +
///         cloud.directions)
/// @throws ResourceLimit if matrix and factors exceed options.maxMemory, before they are written
[[nodiscard]] RbfFit solveSparsely(const RbfCloud& cloud, const RbfOptions& options,
                                   const Eigen::MatrixXd& polynomial, const RbfColumns& values,
                                   RbfSolveReport& report);

}  // namespace levelset::rbf
