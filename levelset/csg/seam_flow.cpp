#include "levelset/csg/seam_flow.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/distance/surface/interpolant.h"

namespace levelset::solids {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;
using Manager = openvdb::tree::LeafManager<FloatTree>;

// The weight of the flow is 1 up to this distance from the seam curve, as a fraction of the radius
// of the rounding.
constexpr double kFullWeight = 0.7;
// Largest stable explicit step for κ = k1 + k2 in three dimensions, voxels², with a margin.
constexpr double kExplicitStep = 0.15;
// Largest curvature that the grid can represent, voxels⁻¹.
constexpr double kSharpest = 2;
// Distance from the zero set within which speed and motion are measured, voxels.
constexpr float kNearSurface = 1;

/// Falls from 1 at x ≤ 0 to 0 at x ≥ 1, twice differentiable.
double fade(double x) {
  if (x <= 0) return 1;
  if (x >= 1) return 0;
  return 1 - x * x * x * (10 + x * (6 * x - 15));
}

/// Computes φ_t at a grid point of a dense block by central differences, without the factor D of
/// seamStep().
double speed(const eikonal::DenseBlock& b, int x, int y, int z, const SeamFlow& flow) {
  const auto v = [&](int i, int j, int k) {
    return static_cast<double>(b.at(x + i, y + j, z + k));
  };
  const double c = 2 * v(0, 0, 0);
  const double gx = (v(1, 0, 0) - v(-1, 0, 0)) / 2, gy = (v(0, 1, 0) - v(0, -1, 0)) / 2,
               gz = (v(0, 0, 1) - v(0, 0, -1)) / 2;
  const double xx = v(1, 0, 0) + v(-1, 0, 0) - c, yy = v(0, 1, 0) + v(0, -1, 0) - c,
               zz = v(0, 0, 1) + v(0, 0, -1) - c;
  const double xy = (v(1, 1, 0) - v(1, -1, 0) - v(-1, 1, 0) + v(-1, -1, 0)) / 4,
               xz = (v(1, 0, 1) - v(1, 0, -1) - v(-1, 0, 1) + v(-1, 0, -1)) / 4,
               yz = (v(0, 1, 1) - v(0, 1, -1) - v(0, -1, 1) + v(0, -1, -1)) / 4;
  const double squared = gx * gx + gy * gy + gz * gz;
  if (squared < 1e-4) return 0;
  const double slope = std::sqrt(squared);
  const double curvature = (gx * gx * (yy + zz) + gy * gy * (xx + zz) + gz * gz * (xx + yy) -
                            2 * (gx * gy * xy + gx * gz * xz + gy * gz * yz)) /
                           (squared * slope);
  const double bound = 1 / flow.radius;
  double excess = std::clamp(curvature, -kSharpest, kSharpest);
  excess -= std::clamp(excess, -bound, bound);
  // Adding material decreases φ.
  if (flow.side == BlendSide::Add) excess = std::min(excess, 0.0);
  if (flow.side == BlendSide::Remove) excess = std::max(excess, 0.0);
  return excess * slope;
}

/// Leaves that have nonzero weights, and their weights, in tree order.
struct MovingLeaves {
  std::vector<std::size_t> number;  ///< indices in the leaf manager
  std::vector<const SeamWeights::Block*> weights;

  MovingLeaves(const Manager& manager, SeamWeights& all) {
    std::vector<Coord> origins;
    for (std::size_t i = 0; i < manager.leafCount(); ++i)
      origins.push_back(manager.leaf(i).origin());
    all.prepare(origins);
    for (std::size_t i = 0; i < manager.leafCount(); ++i)
      if (const SeamWeights::Block* block = all.at(origins[i])) {
        number.push_back(i);
        weights.push_back(block);
      }
  }
};

/// Calls visit(leaf index, index in `moving`, buffer offset, φ_t) at each active grid point with a
/// nonzero weight.
template <typename Visit>
void forEachMoving(const Manager& manager, const MovingLeaves& moving, const SeamFlow& flow,
                   const Visit& visit) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, moving.number.size(), 8), [&](const auto& range) {
        const openvdb::FloatGrid::ConstAccessor accessor(manager.tree());
        const auto block = std::make_unique<eikonal::DenseBlock>();
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const LeafNode& leaf = manager.leaf(moving.number[i]);
          block->load(accessor, leaf.origin());
          for (auto it = leaf.valueMask().beginOn(); it; ++it) {
            const double weight = (*moving.weights[i])[it.pos()];
            if (weight == 0) continue;
            const Coord c = LeafNode::offsetToLocalCoord(it.pos());
            visit(moving.number[i], i, it.pos(), weight * speed(*block, c.x(), c.y(), c.z(), flow));
          }
        }
      });
}

}  // namespace

SeamWeights::SeamWeights(std::span<const Vec3d> curve, double radius)
    : curve_(makePointSearch(curve)), radius_(radius) {}

std::unique_ptr<SeamWeights::Block> SeamWeights::make(const Coord& origin) const {
  const Vec3d centre = origin.asVec3d() + Vec3d(3.5);
  if (!isNear(curve_, toImath(centre), radius_ + 6.1)) return nullptr;
  auto block = std::make_unique<Block>();
  bool any = false;
  for (openvdb::Index n = 0; n < 512; ++n) {
    const Vec3d p = (origin + LeafNode::offsetToLocalCoord(n)).asVec3d();
    const FoundItem nearest = curve_.closest(toImath(p), radius_ * radius_);
    double weight = 0;
    if (nearest.isValid()) {
      const double d = std::sqrt(nearest.squared) / radius_;
      weight = fade((d - kFullWeight) / (1 - kFullWeight));
    }
    (*block)[n] = static_cast<float>(weight);
    any = any || weight > 0;
  }
  return any ? std::move(block) : nullptr;
}

void SeamWeights::prepare(const std::vector<Coord>& origins) {
  std::vector<Coord> absent;
  for (const Coord& origin : origins)
    if (!blocks_.count(origin)) absent.push_back(origin);
  std::vector<std::unique_ptr<Block>> made(absent.size());
  tbb::parallel_for(std::size_t{0}, absent.size(),
                    [&](std::size_t i) { made[i] = make(absent[i]); });
  for (std::size_t i = 0; i < absent.size(); ++i) blocks_[absent[i]] = std::move(made[i]);
}

const SeamWeights::Block* SeamWeights::at(const Coord& origin) {
  const auto found = blocks_.find(origin);
  if (found != blocks_.end()) return found->second.get();
  prepare({origin});
  return blocks_[origin].get();
}

double seamStep(FloatTree& field, SeamWeights& weights, const SeamFlow& flow, double dt) {
  Manager manager(field, 1);  // the tree holds Runge-Kutta stage j - 1, buffer 1 holds stage j - 2
  const MovingLeaves moving(manager, weights);
  std::vector<SeamWeights::Block> before(moving.number.size());
  for (std::size_t i = 0; i < before.size(); ++i)
    std::copy_n(manager.leaf(moving.number[i]).buffer().data(), 512, before[i].begin());

  const int stages =
      std::max(1, static_cast<int>(std::ceil((std::sqrt(1 + 8 * dt / kExplicitStep) - 1) / 2)));
  const double w = 2.0 / (stages * stages + stages);
  for (int j = 1; j <= stages; ++j) {
    const double mu = j == 1 ? 1 : (2.0 * j - 1) / j, nu = j == 1 ? 0 : (1.0 - j) / j;
    forEachMoving(
        manager, moving, flow, [&](std::size_t leaf, std::size_t, openvdb::Index n, double rate) {
          const double last = manager.leaf(leaf).getValue(n);
          float& value = manager.getBuffer(leaf, 1).data()[n];
          value =
              static_cast<float>(mu * last + nu * static_cast<double>(value) + mu * w * dt * rate);
        });
    manager.swapLeafBuffer(1);
  }

  float largest = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const float* after = manager.leaf(moving.number[i]).buffer().data();
    for (std::size_t n = 0; n < 512; ++n)
      if (std::abs(before[i][n]) < kNearSurface)
        largest = std::max(largest, std::abs(after[n] - before[i][n]));
  }
  return static_cast<double>(largest);
}

double seamSpeed(FloatTree& field, SeamWeights& weights, const SeamFlow& flow) {
  Manager manager(field);
  const MovingLeaves moving(manager, weights);
  std::vector<double> largest(moving.number.size(), 0);
  forEachMoving(manager, moving, flow,
                [&](std::size_t leaf, std::size_t i, openvdb::Index n, double rate) {
                  if (std::abs(manager.leaf(leaf).getValue(n)) < kNearSurface)
                    largest[i] = std::max(largest[i], std::abs(rate));
                });
  return largest.empty() ? 0 : *std::max_element(largest.begin(), largest.end());
}

}  // namespace levelset::solids
