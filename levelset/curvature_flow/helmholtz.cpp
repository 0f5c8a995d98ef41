#include <cmath>

#include "levelset/curvature_flow/helmholtz_vdb.h"

namespace levelset::flow {
namespace {

struct NoBuffer {};

// Tolerance of the preconditioned residual, relative to its initial value.
constexpr double kSolved = 1e-5;
// Largest eigenvalue of the negative Laplacian, voxels⁻².
constexpr double kLargestEigenvalue = 12;
// A smaller mask weight counts as zero, since it would make the system nearly singular.
constexpr float kLeastWeight = 1e-3f;

}  // namespace

HelmholtzSolver::HelmholtzSolver(const BandBlocks& blocks, const Field& weights)
    : blocks_(blocks), weights_(weights), unknown_(blocks.size()) {
  for (Field* field : {&neighbours_, &residual_, &scaled_, &direction_, &product_})
    field->assign(blocks.size(), Values{});
  Field inBand(blocks.size(), Values{});
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (auto it = blocks.active(i).beginOn(); it; ++it) {
      inBand[i][it.pos()] = 1;
      if (weight(i, it.pos()) >= kLeastWeight) unknown_[i].setOn(it.pos());
    }
  blocks.forEach<PaddedBlock>([&](std::size_t i, PaddedBlock& block) {
    blocks.gather(inBand, i, 0, block);
    for (auto it = unknown_[i].beginOn(); it; ++it)
      neighbours_[i][it.pos()] = block.neighbourSum(it.pos());
  });
}

double HelmholtzSolver::predictedIterations(double dt) {
  return 1 + 0.5 * std::sqrt(1 + kLargestEigenvalue * dt) * std::log(2 / kSolved);
}

void HelmholtzSolver::multiply(float dt, const Field& in, Field& out) const {
  blocks_.forEach<PaddedBlock>([&](std::size_t i, PaddedBlock& block) {
    blocks_.gather(in, i, 0, block);
    for (auto it = unknown_[i].beginOn(); it; ++it) {
      const openvdb::Index n = it.pos();
      out[i][n] =
          in[i][n] / weight(i, n) - dt * (block.neighbourSum(n) - neighbours_[i][n] * in[i][n]);
    }
  });
}

double HelmholtzSolver::dot(const Field& a, const Field& b) const {
  return blocks_.sum<double>([&](std::size_t i) {
    double sum = 0;
    for (std::size_t n = 0; n < 512; ++n)
      sum += static_cast<double>(a[i][n]) * static_cast<double>(b[i][n]);
    return sum;
  });
}

int HelmholtzSolver::solve(double dt, const Field& rate, Field& change,
                           const std::function<void()>& pulse) {
  const auto step = static_cast<float>(dt);
  const auto precondition = [&](std::size_t i, openvdb::Index n) {
    scaled_[i][n] = residual_[i][n] / (1 / weight(i, n) + step * neighbours_[i][n]);
  };
  blocks_.forEach<NoBuffer>([&](std::size_t i, NoBuffer&) {
    for (auto it = unknown_[i].beginOn(); it; ++it) {
      residual_[i][it.pos()] = step * rate[i][it.pos()] / weight(i, it.pos());
      precondition(i, it.pos());
    }
    change[i].fill(0);
    direction_[i] = scaled_[i];
  });
  double energy = dot(residual_, scaled_);
  const double enough = kSolved * kSolved * energy;
  const int most = static_cast<int>(4 * predictedIterations(dt)) + 20;
  int iteration = 0;
  for (; iteration < most && energy > enough; ++iteration) {
    pulse();
    multiply(step, direction_, product_);
    const auto alpha = static_cast<float>(energy / dot(direction_, product_));
    blocks_.forEach<NoBuffer>([&](std::size_t i, NoBuffer&) {
      for (auto it = unknown_[i].beginOn(); it; ++it) {
        change[i][it.pos()] += alpha * direction_[i][it.pos()];
        residual_[i][it.pos()] -= alpha * product_[i][it.pos()];
        precondition(i, it.pos());
      }
    });
    const double next = dot(residual_, scaled_);
    const auto beta = static_cast<float>(next / energy);
    energy = next;
    blocks_.forEach<NoBuffer>([&](std::size_t i, NoBuffer&) {
      for (auto it = unknown_[i].beginOn(); it; ++it)
        direction_[i][it.pos()] = scaled_[i][it.pos()] + beta * direction_[i][it.pos()];
    });
  }
  return iteration;
}

}  // namespace levelset::flow
