#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/rbf/sums/rbf_kernel.h"

namespace levelset::rbf {

/// Position of a particle, in the kernel's unit of length, and its weights for u, v and w.
struct RbfParticle {
  Imath::V3d position, weight;
};

/// Positions (x, y, z) and sums (u, v, w) of a set of points, one array for each component, so that
/// plain loops over them are vectorised. The instruction set is chosen at run time; all instruction
/// sets give the same bits.
struct RbfPoints {
  std::vector<double> x, y, z, u, v, w;
  explicit RbfPoints(std::size_t count)
      : x(count), y(count), z(count), u(count), v(count), w(count) {}
  [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// Adds Σ ω_i φ(|x − p_i|) to the sums u, v and w of each point x, over the particles with the
/// indices `chosen`, in this order. A particle has the position p_i and the weights ω_i.
void addRbfSums(RbfKernel kernel, std::span<const RbfParticle> particles,
                std::span<const std::uint32_t> chosen, RbfPoints& points);

}  // namespace levelset::rbf
