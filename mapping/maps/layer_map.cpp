#include "mapping/maps/layer_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/maps/dual_basis.h"

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

/// The cell of a level, and where in it.
struct LevelCell {
  Interval i, j;
};

LevelCell cellOf(const ParticleLevel& level, double u, double v) {
  return {locate(u, level.columns), locate(v, level.rows)};
}

/// Levels are alike as a rule: one search for both.
LevelCell cellAbove(const ParticleLevel& low, const LevelCell& cell, const ParticleLevel& high,
                    double u, double v) {
  return low.columns == high.columns && low.rows == high.rows ? cell : cellOf(high, u, v);
}

V3d onLevel(const ParticleLevel& level, const LevelCell& cell) {
  const auto& [i, j] = cell;
  return lerp(lerp(level.at(i.cell, j.cell), level.at(i.cell + 1, j.cell), i.fraction),
              lerp(level.at(i.cell, j.cell + 1), level.at(i.cell + 1, j.cell + 1), i.fraction),
              j.fraction);
}

LevelFrame frameOnLevel(const ParticleLevel& level, const LevelCell& cell) {
  const auto& [i, j] = cell;
  const V3d &a = level.at(i.cell, j.cell), &b = level.at(i.cell + 1, j.cell),
            &c = level.at(i.cell, j.cell + 1), &d = level.at(i.cell + 1, j.cell + 1);
  const V3d low = lerp(a, b, i.fraction), high = lerp(c, d, i.fraction);
  return {lerp(low, high, j.fraction),
          {lerp(b - a, d - c, j.fraction) * static_cast<double>(level.columns - 1),
           (high - low) * static_cast<double>(level.rows - 1), V3d(0)}};
}

/// Slopes by differences so small that they stay in one cell; exact to rounding, the map being
/// trilinear there.
MapSample sampleAt(const Patch& patch, const V3d& uvw, const V3d& step) {
  std::array<V3d, 3> along;  // how the place changes along u, v and w
  for (int axis = 0; axis < 3; ++axis) {
    V3d ahead = uvw, behind = uvw;
    ahead[axis] += step[axis];
    behind[axis] -= step[axis];
    along[static_cast<std::size_t>(axis)] =
        (levelPosition(patch, ahead) - levelPosition(patch, behind)) / (2 * step[axis]);
  }
  const std::array<V3d, 3> gradients = dualBasis(along[0], along[1], along[2]);
  MapSample sample{levelPosition(patch, uvw), uvw, {}};
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis)
      sample.jacobian[k][axis] = gradients[static_cast<std::size_t>(k)][axis];
  return sample;
}

}  // namespace

V3d levelPosition(const Patch& patch, const V3d& uvw) {
  const Interval k = locate(uvw.z, patch.levels.size());  // levels are evenly spaced in w
  const ParticleLevel &low = patch.levels[k.cell], &high = patch.levels[k.cell + 1];
  const LevelCell cell = cellOf(low, uvw.x, uvw.y);
  return lerp(onLevel(low, cell), onLevel(high, cellAbove(low, cell, high, uvw.x, uvw.y)),
              k.fraction);
}

LevelFrame levelFrame(const Patch& patch, const V3d& uvw) {
  const Interval k = locate(uvw.z, patch.levels.size());
  const ParticleLevel &below = patch.levels[k.cell], &above = patch.levels[k.cell + 1];
  const LevelCell cell = cellOf(below, uvw.x, uvw.y);
  const LevelFrame low = frameOnLevel(below, cell),
                   high = frameOnLevel(above, cellAbove(below, cell, above, uvw.x, uvw.y));
  return {lerp(low.position, high.position, k.fraction),
          {lerp(low.slopes[0], high.slopes[0], k.fraction),
           lerp(low.slopes[1], high.slopes[1], k.fraction),
           (high.position - low.position) * static_cast<double>(patch.levels.size() - 1)}};
}

std::vector<MapSample> sampleLevelMap(const Patch& patch, double sink) {
  constexpr double kInside = 1e-3;  // of a cell, from its corners
  std::vector<MapSample> samples;
  const double levels = static_cast<double>(patch.levels.size() - 1);
  for (std::size_t k = 0; k < patch.levels.size(); ++k) {
    const ParticleLevel& level = patch.levels[k];
    const V3d cell(1 / static_cast<double>(level.columns - 1),
                   1 / static_cast<double>(level.rows - 1), 1 / levels);
    std::vector<double> heights;
    if (k > 0) heights.push_back(level.w - kInside * cell.z);
    if (k + 1 < patch.levels.size()) heights.push_back(level.w + kInside * cell.z);
    if (k == 0 && sink > 0) heights.push_back(-sink);
    if (k + 1 == patch.levels.size() && sink < 0) heights.push_back(1 - sink);
    for (std::size_t j = 0; j + 1 < level.rows; ++j)
      for (std::size_t i = 0; i + 1 < level.columns; ++i)
        for (const double w : heights)
          for (const double u : {kInside, 0.5, 1 - kInside})
            for (const double v : {kInside, 0.5, 1 - kInside}) {
              if ((u == 0.5) != (v == 0.5)) continue;
              samples.push_back(sampleAt(
                  patch,
                  {(static_cast<double>(i) + u) * cell.x, (static_cast<double>(j) + v) * cell.y, w},
                  cell * (0.5 * kInside)));
            }
  }
  return samples;
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
