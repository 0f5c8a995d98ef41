#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>

#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Solver of a linearly implicit Euler step, (1/w − dt Δ) change = dt rate / w, on the grid points
/// of a band, with homogeneous Neumann conditions at the ends of the band. Uses conjugate gradients
/// with sums in a fixed order. Here dt is the step in voxels², `rate` is φ_t, `change` is that of φ
/// over the step, and w is the mask weight. The change is zero where w is zero.
///
/// Eigen's ConjugateGradient is not used: it needs contiguous vectors, while the fields of this
/// solver are blocks that are read with an apron. It adds the products of single-precision vectors
/// in single precision. This solver adds them in double precision, in parallel and in tree order,
/// so that any number of threads gives the same bits. The loop of Eigen's solver also has no
/// callback that could report progress or cancel.
class HelmholtzSolver {
 public:
  /// Keeps a reference to both arguments.
  /// @param weights  weights w of the grid points; empty: all are 1
  HelmholtzSolver(const BandBlocks& blocks, const Field& weights);
  /// Solves for `change`, which may be the same field as `rate`. Calls `pulse` in each iteration;
  /// it may throw to stop the solver.
  /// @return the number of iterations
  int solve(double dt, const Field& rate, Field& change, const std::function<void()>& pulse);
  [[nodiscard]] static double predictedIterations(double dt);

 private:
  [[nodiscard]] float weight(std::size_t i, std::size_t n) const {
    return weights_.empty() ? 1.0f : weights_[i][n];
  }
  void multiply(float dt, const Field& in, Field& out) const;
  [[nodiscard]] double dot(const Field& a, const Field& b) const;

  const BandBlocks& blocks_;
  const Field& weights_;
  std::vector<BandBlocks::Mask> unknown_;
  Field neighbours_;  ///< number of neighbours (0 to 6) of each grid point that are in the band
  Field residual_, scaled_, direction_, product_;
};

}  // namespace levelset::flow
