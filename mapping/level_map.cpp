#include "mapping/level_map.h"

#include <algorithm>
#include <cmath>

namespace mapping {
namespace {

using Imath::V3d;

struct Interval {
  std::size_t cell;
  double fraction;  ///< outside [0, 1] beyond the first and last cell
};

Interval locate(double t, std::size_t count) {
  const double x = t * static_cast<double>(count - 1);
  const double cell = std::clamp(std::floor(x), 0.0, static_cast<double>(count - 2));
  return {static_cast<std::size_t>(cell), x - cell};
}

V3d lerp(const V3d& a, const V3d& b, double t) {
  return a + (b - a) * t;
}

V3d onLevel(const ParticleLevel& level, double u, double v) {
  const Interval i = locate(u, level.columns), j = locate(v, level.rows);
  return lerp(lerp(level.at(i.cell, j.cell), level.at(i.cell + 1, j.cell), i.fraction),
              lerp(level.at(i.cell, j.cell + 1), level.at(i.cell + 1, j.cell + 1), i.fraction),
              j.fraction);
}

}  // namespace

V3d levelPosition(const Patch& patch, const V3d& uvw) {
  const Interval k = locate(uvw.z, patch.levels.size());  // levels are evenly spaced in w
  return lerp(onLevel(patch.levels[k.cell], uvw.x, uvw.y),
              onLevel(patch.levels[k.cell + 1], uvw.x, uvw.y), k.fraction);
}

double longestCellEdge(const Patch& patch) {
  double longest = 0;
  for (std::size_t k = 0; k < patch.levels.size(); ++k) {
    const ParticleLevel& level = patch.levels[k];
    for (std::size_t j = 0; j < level.rows; ++j)
      for (std::size_t i = 0; i < level.columns; ++i) {
        const V3d& p = level.at(i, j);
        if (i > 0) longest = std::max(longest, (p - level.at(i - 1, j)).length());
        if (j > 0) longest = std::max(longest, (p - level.at(i, j - 1)).length());
        if (k == 0) continue;
        const V3d uvw(static_cast<double>(i) / static_cast<double>(level.columns - 1),
                      static_cast<double>(j) / static_cast<double>(level.rows - 1),
                      patch.levels[k - 1].w);
        longest = std::max(longest, (p - levelPosition(patch, uvw)).length());
      }
  }
  return longest;
}

}  // namespace mapping
