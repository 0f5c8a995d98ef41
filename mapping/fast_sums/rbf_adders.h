#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "mapping/fast_sums/rbf_sum.h"

/// The vector code that addRbfSums chooses from, for tests that compare it.
namespace mapping {

/// Adds `count` chosen particles of six numbers each at `points` points.
using RbfAdder = void (*)(const double* particles, const std::uint32_t* chosen, std::size_t count,
                          const double* x, const double* y, const double* z, double* u, double* v,
                          double* w, std::size_t points);

/// One source, compiled for one instruction set.
struct RbfAdders {
  const char* name;      ///< plain, avx2, avx512
  const RbfAdder* each;  ///< in the order of RbfKernel
};

/// Those that the processor can run: plain ones first, the widest last.
[[nodiscard]] std::span<const RbfAdders> supportedRbfAdders();

/// addRbfSums by one of them.
void addRbfSums(const RbfAdders& adders, RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points);

}  // namespace mapping
