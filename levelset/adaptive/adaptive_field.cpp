#include "levelset/adaptive/adaptive_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "levelset/adaptive/octree/adaptive_tree.h"
#include "levelset/adaptive/octree/edge_crossings.h"
#include "levelset/grid_tools_vdb.h"

namespace levelset {

using Imath::V3d;
using Imath::V3i;

double AdaptiveField::tolerance() const {
  return tree_ ? tree_->tolerance : 0;
}
double AdaptiveField::halfWidth() const {
  return tree_ ? tree_->halfWidth : 0;
}

Imath::Box3d AdaptiveField::box() const {
  if (!tree_) return {};
  return {tree_->origin, tree_->toWorld(V3i(1 << tree_->octree.depth()))};
}

bool AdaptiveField::isTricubic() const {
  return tree_ && tree_->data.isTricubic();
}

std::size_t AdaptiveField::leafCount() const {
  return tree_ ? tree_->octree.leafCount() : 0;
}

std::size_t AdaptiveField::memoryUse() const {
  if (!tree_) return 0;
  return sizeof(AdaptiveTree) + tree_->octree.memoryUse() +
         tree_->data.values.capacity() * sizeof(CornerValues) +
         tree_->data.gradients.capacity() * sizeof(CornerGradients);
}

Imath::Box3d AdaptiveField::zeroSetBounds() const {
  Imath::Box3d box;
  if (!tree_) return box;
  forEachEdgeCrossing(*tree_, [&](const V3d& world) { box.extendBy(world); });
  return box;
}

std::uint64_t AdaptiveField::contentHash() const {
  if (!tree_) return 0;
  const HashedOctree& octree = tree_->octree;
  const double place[] = {tree_->origin.x,  tree_->origin.y,  tree_->origin.z,       tree_->unit,
                          tree_->tolerance, tree_->halfWidth, double(octree.depth())};
  std::uint64_t hash = mixBytes(0, place, std::size(place));
  for (std::uint32_t b = 0; b < octree.blockCount(); ++b)
    hash = mixHash(hash, octree.parent(b).packed());
  const CornerData& data = tree_->data;
  hash = mixBytes(hash, data.values.data(), data.values.size());
  return data.isTricubic() ? mixBytes(hash, data.gradients.data(), data.gradients.size()) : hash;
}

struct AdaptiveSampler::Impl {
  std::shared_ptr<const AdaptiveTree> tree;
  CachedOctree octree;

  explicit Impl(std::shared_ptr<const AdaptiveTree> shared)
      : tree(std::move(shared)), octree(tree->octree) {}

  struct Local {
    HashedOctree::Place place;
    V3d at;         ///< in the leaf, from 0 to 1
    V3d clamped;    ///< position in the root, cells of level 0
    double beyond;  ///< distance from the root, world units
  };
  [[nodiscard]] Local locate(const V3d& world) const {
    const int side = 1 << tree->octree.depth();
    const V3d p = (world - tree->origin) / tree->unit;
    Local local{};
    V3i cell;
    for (int axis = 0; axis < 3; ++axis) {
      local.clamped[axis] = std::clamp(p[axis], 0.0, double(side));
      cell[axis] = std::min(static_cast<int>(local.clamped[axis]), side - 1);
    }
    local.beyond = (p - local.clamped).length() * tree->unit;
    local.place = octree.findLeaf(cell);
    local.at = (local.clamped - V3d(local.place.leaf.low())) / local.place.leaf.edge();
    return local;
  }
};

AdaptiveSampler::AdaptiveSampler(const AdaptiveField& field)
    : impl_(std::make_unique<Impl>(field.shared())) {}
AdaptiveSampler::~AdaptiveSampler() = default;
AdaptiveSampler::AdaptiveSampler(AdaptiveSampler&&) noexcept = default;
AdaptiveSampler& AdaptiveSampler::operator=(AdaptiveSampler&&) noexcept = default;

double AdaptiveSampler::value(const V3d& world) const {
  if (!std::isfinite(world.length())) return NAN;
  const Impl::Local local = impl_->locate(world);
  const double value = impl_->tree->interpolate(local.place, local.at);
  return value < 0 ? value - local.beyond : value + local.beyond;
}

V3d AdaptiveSampler::gradient(const V3d& world) const {
  if (!std::isfinite(world.length())) return V3d(NAN);
  const Impl::Local local = impl_->locate(world);
  return impl_->tree->interpolant(local.place).slope(local.at) /
         (local.place.leaf.edge() * impl_->tree->unit);
}

double AdaptiveSampler::leafRadius(const V3d& world) const {
  return 0.5 * std::sqrt(3.0) * impl_->locate(world).place.leaf.edge() * impl_->tree->unit;
}

}  // namespace levelset
