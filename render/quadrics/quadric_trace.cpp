#include "render/quadrics/quadric_trace.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace render {

namespace sse2 {
#include "render/quadrics/quadric_lanes.inc"
}  // namespace sse2

#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
#include "render/quadrics/quadric_lanes.inc"
}  // namespace avx2
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
  static const bool kHas = __builtin_cpu_supports("avx2") != 0;
  return kHas;
}

NearestQuadric traceQuadrics(const QuadricTables& tables, const Camera::Ray& ray, bool any,
                             bool isWide) {
  return isWide ? avx2::trace(tables, ray, any) : sse2::trace(tables, ray, any);
}

}  // namespace render
