#include "mapping/rbf/rbf_map.h"

#include "mapping/rbf/rbf_block.h"

namespace mapping {

using Imath::V3d;

RbfMap::RbfMap(std::span<const V3d> points, std::span<const V3d> targets,
               std::span<const char> near, const RbfMapOptions& options)
    : function_(points, targets, near, options) {}

V3d RbfMap::operator()(const V3d& x) const {
  return function_(x);
}

Imath::M33d RbfMap::jacobian(const V3d& x) const {
  return function_.jacobian(x);
}

std::unique_ptr<BlockMap> RbfMap::restrictTo(const GridBlock& block, double tolerance) const {
  return std::make_unique<RbfBlock>(function_, block, tolerance);
}

}  // namespace mapping
