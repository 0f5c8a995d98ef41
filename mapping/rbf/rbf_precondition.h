#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mapping/fast_sums/cluster_tree.h"
#include "mapping/rbf/rbf_solve.h"

namespace mapping {

/// An approximate inverse of s φ + λ in two layers [Beatson00]: the particles of each leaf of a
/// tree, with those around them, are solved for apart, and of each solution only the leaf's own
/// weights are kept; what that leaves at a coarse choice of particles is then solved for. It refers
/// to the cloud and the tree.
class RbfPreconditioner {
 public:
  /// @param cloud  in the order of the tree
  /// @param q      orthonormal: the polynomials at the particles
  RbfPreconditioner(const RbfCloud& cloud, RbfKernel kernel, const PointTree& tree,
                    const Eigen::MatrixXd& q);

  /// Weights orthogonal to the polynomials.
  [[nodiscard]] RbfColumns operator()(const RbfColumns& residual) const;

  /// Bytes for so many particles.
  [[nodiscard]] static double estimateBytes(double particles);

 private:
  struct Leaf {
    std::uint32_t begin, end;
    std::vector<std::uint32_t> members;
    Eigen::MatrixXf inverse;  ///< own × members
  };
  void chooseCoarse();
  void makeLeaf(const PointTree& tree, Leaf& leaf) const;
  void factorCoarse();
  [[nodiscard]] RbfColumns solveLeaves(const RbfColumns& residual) const;
  /// (s φ + λ) times the weights, at the coarse particles.
  [[nodiscard]] RbfColumns atCoarse(const RbfColumns& weights) const;

  const RbfCloud& cloud_;
  RbfKernel kernel_;
  const Eigen::MatrixXd& q_;
  std::vector<Leaf> leaves_;
  std::vector<std::uint32_t> coarse_;
  Eigen::MatrixXd coarseQ_;  ///< whole orthogonal basis, polynomials first
  Eigen::LLT<Eigen::MatrixXd> coarseFactors_;
};

}  // namespace mapping
