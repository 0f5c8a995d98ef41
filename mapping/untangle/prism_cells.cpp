#include "mapping/untangle/prism_cells.h"

#include <algorithm>
#include <cmath>

namespace mapping {
namespace {

using Imath::V3d;

// Largest difference of cell borders in u or v that count as equal. For up to a million particles,
// different borders are further apart, and rounding errors are much smaller.
constexpr double kSameEnd = 1e-9;

void addEnds(std::vector<double>& ends, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    ends.push_back(static_cast<double>(i) / static_cast<double>(count - 1));
}

std::vector<double> endsOf(std::size_t below, std::size_t above) {
  std::vector<double> ends;
  addEnds(ends, below);
  if (above != below) addEnds(ends, above);
  std::sort(ends.begin(), ends.end());
  ends.erase(
      std::unique(ends.begin(), ends.end(), [](double a, double b) { return b - a < kSameEnd; }),
      ends.end());
  return ends;
}

struct Share {
  std::size_t index;
  /// Weight of particle `index` + 1; particle `index` has the weight 1 − fraction.
  double fraction;
};

Share shareAt(double t, std::size_t count) {
  double x = t * static_cast<double>(count - 1);
  if (std::abs(x - std::round(x)) < kSameEnd * static_cast<double>(count)) x = std::round(x);
  const double cell = std::clamp(std::floor(x), 0.0, static_cast<double>(count - 2));
  return {static_cast<std::size_t>(cell), x - cell};
}

}  // namespace

PrismCells::PrismCells(const Patch& patch, double embedDepth) {
  std::size_t particles = 0, cells = 0;
  for (const ParticleLayer& layer : patch.layers) {
    layers_.push_back({layer.columns, layer.rows, particles});
    w_.push_back(layer.w);
    particles += layer.positions.size();
  }
  for (std::size_t k = 0; k + 1 < layers_.size(); ++k) {
    Slab slab{k,
              cells,
              w_[k],
              w_[k + 1],
              endsOf(layers_[k][0], layers_[k + 1][0]),
              endsOf(layers_[k][1], layers_[k + 1][1])};
    if (k == 0 && embedDepth > 0) slab.from = -embedDepth;
    if (k + 2 == layers_.size() && embedDepth < 0) slab.to -= embedDepth;
    cells += slab.count();
    slabs_.push_back(std::move(slab));
  }
}

void PrismCells::addLayer(ParticleSum& sum, std::size_t layer, double u, double v,
                          double share) const {
  if (share == 0) return;
  const auto& [columns, rows, first] = layers_[layer];
  const Share i = shareAt(u, columns), j = shareAt(v, rows);
  for (const std::size_t b : {0u, 1u})
    for (const std::size_t a : {0u, 1u}) {
      const double weight =
          share * (a ? i.fraction : 1 - i.fraction) * (b ? j.fraction : 1 - j.fraction);
      if (weight == 0) continue;
      const std::size_t particle = first + (j.index + b) * columns + i.index + a;
      sum.terms[sum.count++] = {static_cast<std::uint32_t>(particle), weight};
    }
}

PrismCell PrismCells::at(std::size_t index) const {
  const auto slab =
      std::prev(std::upper_bound(slabs_.begin(), slabs_.end(), index,
                                 [](std::size_t i, const Slab& s) { return i < s.first; }));
  const std::size_t rest = index - slab->first, columns = slab->u.size() - 1;
  const std::size_t i = rest % columns, j = rest / columns;
  PrismCell cell;
  cell.box = {V3d(slab->u[i], slab->v[j], slab->from),
              V3d(slab->u[i + 1], slab->v[j + 1], slab->to)};
  const double below = w_[slab->lower], above = w_[slab->lower + 1];
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const double u = slab->u[i + (corner & 1)], v = slab->v[j + (corner >> 1 & 1)];
    const double share = ((corner & 4 ? slab->to : slab->from) - below) / (above - below);
    addLayer(cell.corners[corner], slab->lower, u, v, 1 - share);
    addLayer(cell.corners[corner], slab->lower + 1, u, v, share);
  }
  return cell;
}

V3d meanExtents(const Patch& patch) {
  const ParticleLayer& layer = patch.layers.front();
  double u = 0, v = 0;
  for (std::size_t j = 0; j < layer.rows; ++j)
    for (std::size_t i = 1; i < layer.columns; ++i)
      u += (layer.at(i, j) - layer.at(i - 1, j)).length();
  for (std::size_t j = 1; j < layer.rows; ++j)
    for (std::size_t i = 0; i < layer.columns; ++i)
      v += (layer.at(i, j) - layer.at(i, j - 1)).length();
  return {u / static_cast<double>(layer.rows), v / static_cast<double>(layer.columns),
          patch.height};
}

std::vector<V3d> particlePositions(const Patch& patch) {
  std::vector<V3d> positions;
  for (const ParticleLayer& layer : patch.layers)
    positions.insert(positions.end(), layer.positions.begin(), layer.positions.end());
  return positions;
}

V3d positionOf(const ParticleSum& sum, const std::vector<V3d>& positions) {
  V3d result = positions[sum.terms[0].particle] * sum.terms[0].weight;
  for (std::size_t n = 1; n < sum.count; ++n)
    result += positions[sum.terms[n].particle] * sum.terms[n].weight;
  return result;
}

}  // namespace mapping
