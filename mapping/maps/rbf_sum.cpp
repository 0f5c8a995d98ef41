// Compiled with -O3 -fno-math-errno -fno-trapping-math, so that plain loops become vector code; no
// flag changes a bit of the results, since each point's sum runs over the particles in one order.

#include "mapping/maps/rbf_sum.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace mapping {
namespace {

constexpr std::size_t kTile = 64;  // points, few enough for the first-level cache

const double kScale = rbf::kLaplacian.scale, kA = rbf::kLaplacian.a, kB = rbf::kLaplacian.b,
             kFast = rbf::kLaplacian.fast, kSlow = rbf::kLaplacian.slow;

/// Adds `count` chosen particles of six numbers each at `points` points.
using Adder = void (*)(const double* particles, const std::uint32_t* chosen, std::size_t count,
                       const double* x, const double* y, const double* z, double* u, double* v,
                       double* w, std::size_t points);

namespace plain {
#include "mapping/maps/rbf_sum_tile.inc"
}
#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
#include "mapping/maps/rbf_sum_tile.inc"
}
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,prefer-vector-width=512")
namespace avx512 {
#include "mapping/maps/rbf_sum_tile.inc"
}
#pragma GCC pop_options
#endif

/// The widest that the processor has, in the order of RbfKernel.
const Adder* chooseAdders() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    return avx512::kAdders;
  if (__builtin_cpu_supports("avx2")) return avx2::kAdders;
#endif
  return plain::kAdders;
}

static_assert(sizeof(RbfParticle) == 6 * sizeof(double) && std::is_standard_layout_v<RbfParticle>);

}  // namespace

void addRbfSums(RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points) {
  static const Adder* const adders = chooseAdders();
  if (particles.empty()) return;
  const Adder add = adders[static_cast<std::size_t>(kernel)];
  const double* numbers = &particles.front().position.x;
  for (std::size_t i = 0; i < points.size(); i += kTile)
    add(numbers, chosen.data(), chosen.size(), &points.x[i], &points.y[i], &points.z[i],
        &points.u[i], &points.v[i], &points.w[i], std::min(kTile, points.size() - i));
}

}  // namespace mapping
