#pragma once

#include "mapping/rbf/rbf_solve.h"

namespace mapping {

/// The weights of solveRbf by restarted, flexible GMRES [Saad93] in the space orthogonal to the
/// polynomials. Products with the matrix are RbfClusterSum's, or direct sums for the kernels that
/// grow faster than r; what a restart begins with, and what ends the search, is the residual by the
/// direct sum, so that the fast sum's errors do not matter in the end. The preconditioner solves
/// for the particles of each leaf of a tree, and others around it, apart, and then for a coarse
/// choice of all [Beatson00].
/// @param q  n × (1 + directions), orthonormal: the polynomials at the particles
/// @return weights, and what the matrix makes of them, whose residual, the polynomials' part aside,
/// is at most options.solveTolerance
///         times the targets' extent in u, v and w
/// @throws ResourceLimit before allocating too much, NumericalError where iteration stands still
[[nodiscard]] RbfFit solveIteratively(const RbfCloud& cloud, const RbfMapOptions& options,
                                      const Eigen::MatrixXd& q, const RbfColumns& values,
                                      RbfSolveReport& report);

}  // namespace mapping
