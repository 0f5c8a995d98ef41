#include "mapping/placement/shared_particles.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/geometry/disjoint_sets.h"

namespace mapping {
namespace {

using Imath::V3d;

struct SideParticle {
  std::size_t layer;
  V3d before;
  double tolerance;
  V3d* after;
};

void addSides(std::size_t number, const ParticleLayer& before, ParticleLayer& after,
              double tolerance, std::vector<SideParticle>& particles) {
  for (std::size_t j = 0; j < before.rows; ++j)
    for (std::size_t i = 0; i < before.columns; ++i) {
      const bool isSide = i == 0 || j == 0 || i + 1 == before.columns || j + 1 == before.rows;
      if (!isSide) continue;
      const std::size_t n = j * before.columns + i;
      particles.push_back({number, before.positions[n], tolerance, &after.positions[n]});
    }
}

}  // namespace

void joinSharedParticles(std::span<const Patch> before, std::span<Patch> after) {
  constexpr double kTolerance = 1e-3;  // largest distance of shared particles, particle spacings
  std::vector<SideParticle> particles;
  for (std::size_t p = 0; p < before.size(); ++p)
    for (std::size_t k = 0; k < before[p].layers.size(); ++k)
      addSides(k, before[p].layers[k], after[p].layers[k], kTolerance * before[p].spacing,
               particles);
  std::stable_sort(particles.begin(), particles.end(),
                   [](const SideParticle& a, const SideParticle& b) {
                     return std::pair(a.layer, a.before.x) < std::pair(b.layer, b.before.x);
                   });
  levelset::DisjointSets sets(particles.size());
  for (std::size_t a = 0; a < particles.size(); ++a) {
    const double tolerance = particles[a].tolerance;
    for (std::size_t b = a + 1; b < particles.size(); ++b) {
      if (particles[b].layer != particles[a].layer ||
          particles[b].before.x - particles[a].before.x > tolerance)
        break;
      if ((particles[b].before - particles[a].before).length() <= tolerance)
        sets.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    }
  }
  std::vector<V3d> sum(particles.size(), V3d(0));
  std::vector<double> count(particles.size(), 0);
  std::vector<std::uint32_t> top(particles.size());
  for (std::size_t n = 0; n < particles.size(); ++n) {
    top[n] = sets.find(static_cast<std::uint32_t>(n));
    sum[top[n]] += *particles[n].after;
    ++count[top[n]];
  }
  for (std::size_t n = 0; n < particles.size(); ++n)
    if (count[top[n]] > 1) *particles[n].after = sum[top[n]] / count[top[n]];
}

}  // namespace mapping
