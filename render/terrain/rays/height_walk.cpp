#include "render/terrain/rays/height_walk.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace render {

// GCC 12 does not define __AVX2__ after a pragma, and clang ignores the pragma.
#define WIDE_VECTORS 0
namespace heights_sse2 {
#include "render/terrain/rays/height_lanes.inc"
}  // namespace heights_sse2
#undef WIDE_VECTORS

#pragma GCC push_options
#pragma GCC target("avx2")
#ifdef __clang__
#define WIDE_VECTORS 0
#else
#define WIDE_VECTORS 1
#endif
namespace heights_avx2 {
#include "render/terrain/rays/height_lanes.inc"
}  // namespace heights_avx2
#undef WIDE_VECTORS
#pragma GCC pop_options

bool hasWideHeights() {
  static const bool kHas = __builtin_cpu_supports("avx2") != 0;
  return kHas;
}

HeightKernel::HeightWalk walkGround(const TerrainTables& tables, const HeightKernel::HeightRay& ray,
                                    bool isAny, bool isWide) {
  return isWide ? heights_avx2::walkOf(tables, ray, isAny)
                : heights_sse2::walkOf(tables, ray, isAny);
}

}  // namespace render
