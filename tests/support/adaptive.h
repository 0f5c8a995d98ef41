#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <utility>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/adaptive/build_adaptive.h"
#include "levelset/adaptive/octree/adaptive_tree.h"

namespace support {

/// Distance from a formula.
class FormulaDistance final : public levelset::SignedDistance {
 public:
  explicit FormulaDistance(std::function<double(const Imath::V3d&)> phi) : phi_(std::move(phi)) {}
  [[nodiscard]] double at(const Imath::V3d& position, const Known&) const override {
    return phi_(position);
  }

 private:
  std::function<double(const Imath::V3d&)> phi_;
};

/// Errors at random points in the root of a field.
struct AdaptiveErrors {
  double largest = 0;                   ///< within the half width, in tolerances
  std::size_t inside = 0, outside = 0;  ///< number of points within the half width
  std::size_t wrongSigns = 0;           ///< farther from the surface than the tolerance
};
inline AdaptiveErrors errorsOf(const levelset::AdaptiveField& field,
                               const levelset::SignedDistance& truth, int count) {
  const levelset::AdaptiveSampler sampler(field);
  const Imath::Box3d box = field.box();
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  AdaptiveErrors errors;
  for (int k = 0; k < count; ++k) {
    Imath::V3d p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = box.min[axis] + unit(random) * (box.max[axis] - box.min[axis]);
    const double expected = truth.at(p, {}), found = sampler.value(p);
    if (std::abs(expected) > field.tolerance()) errors.wrongSigns += (expected < 0) != (found < 0);
    if (std::abs(expected) > field.halfWidth()) continue;
    errors.largest = std::max(errors.largest, std::abs(found - expected) / field.tolerance());
    ++(expected < 0 ? errors.inside : errors.outside);
  }
  return errors;
}

/// Largest difference of the interpolants on the two sides of the faces of leaves.
struct FaceJumps {
  double largest = 0;
  int changes = 0;  ///< faces beside a larger leaf
};
inline FaceJumps faceJumps(const levelset::AdaptiveTree& tree) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  FaceJumps jumps;
  for (std::uint32_t block = 0; block < tree.octree.blockCount(); ++block)
    for (int octant = 0; octant < 8; ++octant) {
      const levelset::CellKey leaf = tree.octree.parent(block).child(octant);
      if (tree.octree.isSplit(leaf)) continue;
      for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
          const auto beside = tree.octree.neighbour(leaf, axis, side);
          if (!beside || tree.octree.isSplit(*beside)) continue;
          jumps.changes += beside->level > leaf.level;
          Imath::V3d at(unit(random), unit(random), unit(random));
          at[axis] = side > 0 ? 1 : 0;
          const Imath::V3d p = Imath::V3d(leaf.low()) + at * leaf.edge();
          const Imath::V3d there = (p - Imath::V3d(beside->low())) / beside->edge();
          const double own = tree.interpolate({leaf, block}, at),
                       other =
                           tree.interpolate({*beside, tree.octree.block(beside->parent())}, there);
          jumps.largest = std::max(jumps.largest, std::abs(own - other));
        }
    }
  return jumps;
}

}  // namespace support
