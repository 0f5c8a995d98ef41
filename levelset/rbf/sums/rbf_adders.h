#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "levelset/rbf/sums/rbf_sum.h"

/// Variants of the vector code behind addRbfSums, one for each instruction set, for tests that
/// compare them.
namespace levelset::rbf {

/// Adds weight × φ(distance) of `count` particles to the sums u, v and w at `points` points.
/// `particles` has six numbers for each particle: position and weights. `chosen` has the indices of
/// the particles.
using RbfAdder = void (*)(const double* particles, const std::uint32_t* chosen, std::size_t count,
                          const double* x, const double* y, const double* z, double* u, double* v,
                          double* w, std::size_t points);

/// The functions for all kernels, compiled for one instruction set.
struct RbfAdders {
  const char* name;      ///< instruction set: plain, avx2 or avx512
  const RbfAdder* each;  ///< array with one function for each RbfKernel, in the order of the enum
};

/// Variants that the processor supports, ordered from scalar to the widest.
[[nodiscard]] std::span<const RbfAdders> supportedRbfAdders();

/// Runs addRbfSums with a given variant.
void addRbfSums(const RbfAdders& adders, RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points);

}  // namespace levelset::rbf
