#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "levelset/rbf/rbf_solve.h"
#include "levelset/rbf/sums/cluster_tree.h"

namespace levelset::rbf {

/// A two-level approximate inverse of the RBF matrix s φ + λ, with s the sign of the kernel
/// [Beatson00]. First, each leaf of a tree is solved separately together with neighbouring
/// particles, and only the leaf's own weights are kept. Then the remaining residual at a coarse
/// subset of particles is solved. The object keeps references to the cloud and the tree.
class RbfPreconditioner {
 public:
  /// @param cloud  particles in the order of the tree, each leaf a contiguous range
  /// @param q      orthonormal basis of the linear polynomials' values at the particles
  RbfPreconditioner(const RbfCloud& cloud, RbfKernel kernel, const ClusterTree& tree,
                    const Eigen::MatrixXd& q);

  /// Applies the approximate inverse. The resulting weights are orthogonal to the linear
  /// polynomials.
  [[nodiscard]] RbfColumns operator()(const RbfColumns& residual) const;

  /// Memory of the preconditioner for a number of particles, bytes.
  [[nodiscard]] static double estimateBytes(double particles);

 private:
  struct Leaf {
    std::uint32_t begin, end;
    std::vector<std::uint32_t> members;
    Eigen::MatrixXf inverse;  ///< rows: the leaf's own particles; columns: all members
  };
  void chooseCoarse();
  void makeLeaf(const ClusterTree& tree, Leaf& leaf) const;
  void factorCoarse();
  [[nodiscard]] RbfColumns solveLeaves(const RbfColumns& residual) const;
  /// Computes (s φ + λ) times the weights, only at the coarse particles.
  [[nodiscard]] RbfColumns atCoarse(const RbfColumns& weights) const;

  const RbfCloud& cloud_;
  RbfKernel kernel_;
  const Eigen::MatrixXd& q_;
  std::vector<Leaf> leaves_;
  std::vector<std::uint32_t> coarse_;
  /// Orthonormal basis of the weights of the coarse particles that are orthogonal to the linear
  /// polynomials.
  Eigen::MatrixXd coarseQ_;
  Eigen::LLT<Eigen::MatrixXd> coarseFactors_;
};

}  // namespace levelset::rbf
