#include "render/quadrics/quadric_trace.h"

#include <Imath/ImathVec.h>
#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace render {
namespace {

using Imath::V3f;

// Fewer rays are traced one by one.
constexpr int kLeastBeamRays = 4;
// Largest difference of the slopes of rays that are searched together.
constexpr float kMostSlopes = 0.2f;
// Assumed distance of an intersection from the start of a ray near the quadrics, as a share of the
// bound on their distance from the origin. There the rays must be as close as the primitives of a
// block: otherwise single rays are faster.
constexpr float kMeanDepth = 0.25f;

}  // namespace

// GCC 12 does not define __AVX2__ after a pragma, and clang ignores the pragma.
#define WIDE_VECTORS 0
namespace sse2 {
#include "render/quadrics/quadric_lanes.inc"
// After the lanes, which it uses.
#include "render/quadrics/quadric_beam.inc"
}  // namespace sse2
#undef WIDE_VECTORS

#pragma GCC push_options
#pragma GCC target("avx2,fma")
#ifdef __clang__
#define WIDE_VECTORS 0
#else
#define WIDE_VECTORS 1
#endif
namespace avx2 {
#include "render/quadrics/quadric_lanes.inc"
// After the lanes, which it uses.
#include "render/quadrics/quadric_beam.inc"
}  // namespace avx2
#undef WIDE_VECTORS
#pragma GCC pop_options

QuadricKernel::QuadricRay relativeRay(const QuadricTables& tables, const Camera::Ray& ray) {
  const Imath::V3d from = ray.origin - tables.origin;
  return {from.x, from.y, from.z, ray.direction.x, ray.direction.y, ray.direction.z, ray.near};
}

std::optional<double> startAt(const QuadricTables& tables, const QuadricKernel::QuadricRay& ray) {
  const double middle = -((ray.x * ray.dx + ray.y * ray.dy) + ray.z * ray.dz);
  const double px = ray.x + middle * ray.dx, py = ray.y + middle * ray.dy,
               pz = ray.z + middle * ray.dz;
  const double reach = 1.0001 * tables.reach + tables.pad();
  if (px * px + py * py + pz * pz > reach * reach || middle + reach < ray.near) return std::nullopt;
  return std::max(ray.near, middle - reach);
}

bool hasWideVectors() {
  static const bool kHas =
      __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  return kHas;
}

NearestQuadric traceQuadrics(const QuadricTables& tables, const Camera::Ray& ray, bool any,
                             bool isWide) {
  return isWide ? avx2::trace(tables, ray, any) : sse2::trace(tables, ray, any);
}

bool traceQuadricBeam(const QuadricTables& tables, std::span<const Camera::Ray> rays, bool isWide,
                      NearestQuadric* nearest) {
  const int count = static_cast<int>(rays.size());
  return isWide ? avx2::traceNear(tables, rays.data(), count, nearest)
                : sse2::traceNear(tables, rays.data(), count, nearest);
}

}  // namespace render
