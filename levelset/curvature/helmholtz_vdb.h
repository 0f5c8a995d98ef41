#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>

#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Solves (1/w − dt Δ) change = dt rate / w on the grid points of a band, no flow through its rim,
/// by conjugate gradients; sums in a fixed order. Where the weight w vanishes so does the change.
class HelmholtzSolver {
 public:
  /// Keeps a view of both. @param weights  empty: all one
  HelmholtzSolver(const BandBlocks& blocks, const Field& weights);
  /// `change` may be `rate`. @return the number of iterations
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
  Field neighbours_;  ///< how many of the six are in the band
  Field residual_, scaled_, direction_, product_;
};

}  // namespace levelset::flow
