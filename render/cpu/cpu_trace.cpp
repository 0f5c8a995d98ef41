#include "render/cpu/cpu_trace.h"

#include <immintrin.h>

#include <algorithm>
#include <cstring>

namespace render {

// GCC 12 does not define __AVX2__ after a pragma, and clang ignores the pragma.
#define WIDE_VECTORS 0
#define LANES 8
namespace sse2 {
#include "render/cpu/lanes.inc"
}
#undef LANES
#ifndef __clang__
#undef WIDE_VECTORS
#define WIDE_VECTORS 1
#endif

#pragma GCC push_options
#pragma GCC target("avx2")
#define LANES 8
namespace avx2 {
#include "render/cpu/lanes.inc"
}
#undef LANES
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw,prefer-vector-width=512")
#define LANES 16
namespace avx512 {
#include "render/cpu/lanes.inc"
}
#undef LANES
#undef WIDE_VECTORS
#pragma GCC pop_options

std::vector<InstructionSet> instructionSets() {
  std::vector<InstructionSet> sets = {InstructionSet::Sse2};
  if (__builtin_cpu_supports("avx2")) sets.push_back(InstructionSet::Avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
    sets.push_back(InstructionSet::Avx512);
  return sets;
}

namespace {

template <typename... What>
void traceOn(InstructionSet set, What&&... what) {
  switch (set) {
    case InstructionSet::Avx512:
      return avx512::traceAll(what...);
    case InstructionSet::Avx2:
      return avx2::traceAll(what...);
    default:
      return sse2::traceAll(what...);
  }
}

void findNothing(HitBlock& hits) {
  std::fill(hits.found.begin(), hits.found.end(), 0);
}

}  // namespace

void traceRays(const BrickPool& pool, const RayBlock& rays, HitBlock& hits, InstructionSet set) {
  if (pool.brickCount() == 0) return findNothing(hits);
  traceOn(set, pool, rays, hits, static_cast<ShapeBlock*>(nullptr));
}

void traceRays(const BrickPool& pool, const RayBlock& rays, HitBlock& hits, ShapeBlock& shapes,
               InstructionSet set) {
  if (pool.brickCount() == 0) return findNothing(hits);
  traceOn(set, pool, rays, hits, &shapes);
}

void tracePixels(const BrickPool& pool, const RayFan& fan, const PixelBlock& pixels, HitBlock& hits,
                 ShapeBlock& shapes, InstructionSet set) {
  if (pool.brickCount() == 0) return findNothing(hits);
  traceOn(set, pool, fan, pixels, hits, shapes);
}

}  // namespace render
