// This file is compiled with -O3 -fno-math-errno -fno-trapping-math, so that plain loops are
// vectorised. The flags do not change the results: each point's sum runs over the particles in a
// fixed order.

#include "levelset/rbf/sums/rbf_sum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "levelset/rbf/sums/rbf_adders.h"

namespace levelset::rbf {
namespace {

constexpr std::size_t kTile = 64;  // points per call of an adder; they fit the first-level cache

const double kScale = kernels::kLaplacian.scale, kA = kernels::kLaplacian.a,
             kB = kernels::kLaplacian.b, kFast = kernels::kLaplacian.fast,
             kSlow = kernels::kLaplacian.slow;

namespace plain {
#include "levelset/rbf/sums/rbf_sum_tile.inc"
}
#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
#include "levelset/rbf/sums/rbf_sum_tile.inc"
}
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,prefer-vector-width=512")
namespace avx512 {
#include "levelset/rbf/sums/rbf_sum_tile.inc"
}
#pragma GCC pop_options
#endif

struct Supported {
  std::array<RbfAdders, 3> adders;
  std::size_t count = 0;
  void add(const char* name, const RbfAdder* each) { adders[count++] = {name, each}; }
};

Supported findSupported() {
  Supported found;
  found.add("plain", plain::kAdders);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) found.add("avx2", avx2::kAdders);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    found.add("avx512", avx512::kAdders);
#endif
  return found;
}

static_assert(sizeof(RbfParticle) == 6 * sizeof(double) && std::is_standard_layout_v<RbfParticle>);

}  // namespace

std::span<const RbfAdders> supportedRbfAdders() {
  static const Supported supported = findSupported();
  return {supported.adders.data(), supported.count};
}

void addRbfSums(const RbfAdders& adders, RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points) {
  if (particles.empty()) return;
  const RbfAdder add = adders.each[static_cast<std::size_t>(kernel)];
  const double* numbers = &particles.front().position.x;
  for (std::size_t i = 0; i < points.size(); i += kTile)
    add(numbers, chosen.data(), chosen.size(), &points.x[i], &points.y[i], &points.z[i],
        &points.u[i], &points.v[i], &points.w[i], std::min(kTile, points.size() - i));
}

void addRbfSums(RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points) {
  static const RbfAdders& widest = supportedRbfAdders().back();
  addRbfSums(widest, kernel, particles, chosen, points);
}

}  // namespace levelset::rbf
