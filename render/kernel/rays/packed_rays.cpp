#include "render/kernel/rays/packed_rays.h"

#include <algorithm>
#include <cmath>

namespace render {
namespace {

using Imath::V3d;

// Padding of the box of a surface's blocks, voxels, so that rounding does not lose a crossing on a
// face of the box.
constexpr double kBesideBox = 0.0625;
constexpr double kParallel = 1e30;

/// An interval of a ray's parameter, which is the distance from its origin in voxels.
struct Span {
  double enter, leave;
};

Span clipped(const BrickPool& pool, const V3d& origin, const V3d& direction, double maxDistance) {
  Span span{0, maxDistance};
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double inverse = std::abs(direction[a]) < 1 / kParallel ? kParallel : 1 / direction[a];
    const double t0 = (pool.low[i] - kBesideBox - origin[a]) * inverse,
                 t1 = (pool.high[i] + kBesideBox - origin[a]) * inverse;
    span.enter = std::max(span.enter, std::min(t0, t1));
    span.leave = std::min(span.leave, std::max(t0, t1));
  }
  return span;
}

}  // namespace

PackedRays::PackedRays(const KernelSolid& solid, const std::vector<LightRay>& rays,
                       const std::vector<std::size_t>& asked, bool hasEnd) {
  for (const std::size_t i : asked) {
    // Choose a voxel as the unit of the ray parameter t, so that single precision suffices for
    // any world unit.
    V3d origin, direction;
    solid.worldToTable.multVecMatrix(rays[i].origin, origin);
    solid.worldToTable.multDirMatrix(rays[i].direction * solid.voxelSize, direction);
    const double maxDistance = hasEnd ? rays[i].maxDistance / solid.voxelSize : kParallel;
    const Span span = clipped(solid.pool, origin, direction, maxDistance);
    if (!(span.enter <= span.leave)) continue;
    exact_.push_back(
        {origin + direction * span.enter, direction, span.enter, span.leave - span.enter});
    number.push_back(i);
  }
  block = RayBlock(exact_.size());
  for (std::size_t n = 0; n < exact_.size(); ++n) {
    const Exact& ray = exact_[n];
    const auto set = [&](std::vector<float>& to, double value) {
      to[n] = static_cast<float>(value);
    };
    set(block.ox, ray.start.x);
    set(block.oy, ray.start.y);
    set(block.oz, ray.start.z);
    set(block.dx, ray.direction.x);
    set(block.dy, ray.direction.y);
    set(block.dz, ray.direction.z);
    block.ix[n] = rayInverse(block.dx[n]);
    block.iy[n] = rayInverse(block.dy[n]);
    block.iz[n] = rayInverse(block.dz[n]);
    block.start[n] = 0;
    set(block.end, ray.length);
  }
}

}  // namespace render
