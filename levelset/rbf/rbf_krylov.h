#pragma once

#include "levelset/rbf/rbf_solve.h"

namespace levelset::rbf {

/// Computes the weights of solveRbf by restarted, flexible GMRES [Saad93] in the space orthogonal
/// to the linear polynomials. Matrix products use RbfClusterSum, or direct sums for kernels that
/// grow faster than r. Each restart and the final test use the residual of the direct sum, so that
/// errors of the fast sum do not affect the result. The preconditioner solves separately for the
/// particles of each leaf of a tree with their neighbours, and then for a coarse subset of all
/// particles [Beatson00].
/// @param q  orthonormal basis of the linear polynomials' values at the n particles, n × (1 +
///         cloud.directions)
/// @return weights and their image under the matrix. The residual, projected orthogonally to the
///         linear polynomials, is at most options.solveTolerance times the extent of `values` in u,
///         v and w.
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws NumericalError if the iteration stagnates
[[nodiscard]] RbfFit solveIteratively(const RbfCloud& cloud, const RbfOptions& options,
                                      const Eigen::MatrixXd& q, const RbfColumns& values,
                                      RbfSolveReport& report);

}  // namespace levelset::rbf
