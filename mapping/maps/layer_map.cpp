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
  /// Position in the cell, 0 to 1; below 0 before the first cell, above 1 beyond the last.
  double fraction;
};

Interval locate(double t, std::size_t count) {
  const double x = t * static_cast<double>(count - 1);
  const double cell = std::clamp(std::floor(x), 0.0, static_cast<double>(count - 2));
  return {static_cast<std::size_t>(cell), x - cell};
}

V3d lerp(const V3d& a, const V3d& b, double t) {
  return a + (b - a) * t;
}

/// A cell of a layer, and the position inside it.
struct LayerCell {
  Interval i, j;
};

LayerCell cellOf(const ParticleLayer& layer, double u, double v) {
  return {locate(u, layer.columns), locate(v, layer.rows)};
}

/// Cell of the layer `high` at (u, v); `cell` is that of the layer `low`. Most layers have equal
/// counts, so that one search serves both layers.
LayerCell cellAbove(const ParticleLayer& low, const LayerCell& cell, const ParticleLayer& high,
                    double u, double v) {
  return low.columns == high.columns && low.rows == high.rows ? cell : cellOf(high, u, v);
}

V3d onLayer(const ParticleLayer& layer, const LayerCell& cell) {
  const auto& [i, j] = cell;
  return lerp(lerp(layer.at(i.cell, j.cell), layer.at(i.cell + 1, j.cell), i.fraction),
              lerp(layer.at(i.cell, j.cell + 1), layer.at(i.cell + 1, j.cell + 1), i.fraction),
              j.fraction);
}

ForwardFrame frameOnLayer(const ParticleLayer& layer, const LayerCell& cell) {
  const auto& [i, j] = cell;
  const V3d &a = layer.at(i.cell, j.cell), &b = layer.at(i.cell + 1, j.cell),
            &c = layer.at(i.cell, j.cell + 1), &d = layer.at(i.cell + 1, j.cell + 1);
  const V3d low = lerp(a, b, i.fraction), high = lerp(c, d, i.fraction);
  return {lerp(low, high, j.fraction),
          {lerp(b - a, d - c, j.fraction) * static_cast<double>(layer.columns - 1),
           (high - low) * static_cast<double>(layer.rows - 1), V3d(0)}};
}

/// Samples the layer map at uvw, and the slopes of its inverse. They follow from central
/// differences with `step` within one cell. The differences are exact up to rounding, because the
/// map is trilinear in a cell.
MapSample sampleAt(const Patch& patch, const V3d& uvw, const V3d& step) {
  std::array<V3d, 3> along;  // derivatives of the position along u, v and w
  for (int axis = 0; axis < 3; ++axis) {
    V3d ahead = uvw, behind = uvw;
    ahead[axis] += step[axis];
    behind[axis] -= step[axis];
    along[static_cast<std::size_t>(axis)] =
        (layerPosition(patch, ahead) - layerPosition(patch, behind)) / (2 * step[axis]);
  }
  const std::array<V3d, 3> gradients = dualBasis(along[0], along[1], along[2]);
  MapSample sample{layerPosition(patch, uvw), uvw, {}};
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis)
      sample.jacobian[k][axis] = gradients[static_cast<std::size_t>(k)][axis];
  return sample;
}

}  // namespace

V3d layerPosition(const Patch& patch, const V3d& uvw) {
  const Interval k = locate(uvw.z, patch.layers.size());  // layers are evenly spaced in w
  const ParticleLayer &low = patch.layers[k.cell], &high = patch.layers[k.cell + 1];
  const LayerCell cell = cellOf(low, uvw.x, uvw.y);
  return lerp(onLayer(low, cell), onLayer(high, cellAbove(low, cell, high, uvw.x, uvw.y)),
              k.fraction);
}

ForwardFrame layerFrame(const Patch& patch, const V3d& uvw) {
  const Interval k = locate(uvw.z, patch.layers.size());
  const ParticleLayer &below = patch.layers[k.cell], &above = patch.layers[k.cell + 1];
  const LayerCell cell = cellOf(below, uvw.x, uvw.y);
  const ForwardFrame low = frameOnLayer(below, cell),
                     high = frameOnLayer(above, cellAbove(below, cell, above, uvw.x, uvw.y));
  return {lerp(low.position, high.position, k.fraction),
          {lerp(low.slopes[0], high.slopes[0], k.fraction),
           lerp(low.slopes[1], high.slopes[1], k.fraction),
           (high.position - low.position) * static_cast<double>(patch.layers.size() - 1)}};
}

std::vector<MapSample> sampleLayerMap(const Patch& patch, double embedDepth) {
  constexpr double kInside = 1e-3;  // distance of samples from the corners of their cell, in cells
  std::vector<MapSample> samples;
  const double layers = static_cast<double>(patch.layers.size() - 1);
  for (std::size_t k = 0; k < patch.layers.size(); ++k) {
    const ParticleLayer& layer = patch.layers[k];
    const V3d cell(1 / static_cast<double>(layer.columns - 1),
                   1 / static_cast<double>(layer.rows - 1), 1 / layers);
    std::vector<double> heights;
    if (k > 0) heights.push_back(layer.w - kInside * cell.z);
    if (k + 1 < patch.layers.size()) heights.push_back(layer.w + kInside * cell.z);
    if (k == 0 && embedDepth > 0) heights.push_back(-embedDepth);
    if (k + 1 == patch.layers.size() && embedDepth < 0) heights.push_back(1 - embedDepth);
    for (std::size_t j = 0; j + 1 < layer.rows; ++j)
      for (std::size_t i = 0; i + 1 < layer.columns; ++i)
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
  for (std::size_t k = 0; k < patch.layers.size(); ++k) {
    const ParticleLayer& layer = patch.layers[k];
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const V3d& p = layer.at(i, j);
        if (i > 0) longest = std::max(longest, (p - layer.at(i - 1, j)).length());
        if (j > 0) longest = std::max(longest, (p - layer.at(i, j - 1)).length());
        if (k == 0) continue;
        const V3d uvw(static_cast<double>(i) / static_cast<double>(layer.columns - 1),
                      static_cast<double>(j) / static_cast<double>(layer.rows - 1),
                      patch.layers[k - 1].w);
        longest = std::max(longest, (p - layerPosition(patch, uvw)).length());
      }
  }
  return longest;
}

}  // namespace mapping
