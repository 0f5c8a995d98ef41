#include "mapping/maps/lattice_nodes.h"

#include <algorithm>
#include <utility>

#include "mapping/layers/layer_resampling.h"

namespace mapping {
namespace {

using Imath::V3d;
using Node = LatticeNodes::Node;

/// Least width of an outer cell along u and v, in inner cells.
constexpr double kThinnest = 1e-3;

/// Evenly spaced coordinates from 0 to 1.
std::vector<double> evenly(std::size_t count) {
  std::vector<double> result(count, 1);
  for (std::size_t i = 0; i + 1 < count; ++i)
    result[i] = static_cast<double>(i) / static_cast<double>(count - 1);
  return result;
}

/// Distance by which [least, most] leaves [from, to], on the side where it leaves it further, and a
/// little more, so that rounding keeps its ends inside. 0: it does not leave the interval.
double excess(double least, double most, double from, double to) {
  return (1 + 1e-9) * std::max({0.0, from - least, most - to});
}

/// Mean distance of the outermost particles of a layer to their inner neighbours, along rows and
/// along columns; world units.
std::array<double, 2> endSpacings(const ParticleLayer& layer) {
  std::array<double, 2> sum{};
  for (std::size_t j = 0; j < layer.rows; ++j)
    sum[0] += (layer.at(1, j) - layer.at(0, j)).length() +
              (layer.at(layer.columns - 1, j) - layer.at(layer.columns - 2, j)).length();
  for (std::size_t i = 0; i < layer.columns; ++i)
    sum[1] += (layer.at(i, 1) - layer.at(i, 0)).length() +
              (layer.at(i, layer.rows - 1) - layer.at(i, layer.rows - 2)).length();
  return {sum[0] / (2 * static_cast<double>(layer.rows)),
          sum[1] / (2 * static_cast<double>(layer.columns))};
}

/// Builds the nodes of one lattice.
class LatticeBuilder {
 public:
  LatticeBuilder(const Patch& patch, const LatticeBorder& border) : patch_(patch), border_(border) {
    if (!border.reach.isEmpty()) {
      const V3d &least = border.reach.min, &most = border.reach.max;
      beyond_[0] = excess(least.x, most.x, 0, 1);
      beyond_[1] = excess(least.y, most.y, 0, 1);
      beyond_[2] = excess(least.z, most.z, -std::max(0.0, border.embedDepth),
                          1 + std::max(0.0, -border.embedDepth));
    }
    around_ = border.rim > 0 || std::max(beyond_[0], beyond_[1]) > 0 ? 1 : 0;
  }

  LatticeNodes build() {
    setCoordinatesAlongSides();
    setCoordinatesAcrossLayers();
    for (std::size_t axis = 0; axis < 3; ++axis)
      nodes_.cells[axis] = static_cast<int>(nodes_.coordinates[axis].size()) - 1;
    nodes_.positions.resize(nodes_.coordinates[0].size() * nodes_.coordinates[1].size() *
                            nodes_.coordinates[2].size());
    for (int k = below_; k <= lastLayer_; ++k) addLayer(k);
    for (int k = below_ - 1; k >= 0; --k) continueLayers(k, below_, below_ + 1);
    for (int k = lastLayer_ + 1; k <= nodes_.cells[2]; ++k)
      continueLayers(k, lastLayer_, lastLayer_ - 1);
    return std::move(nodes_);
  }

 private:
  /// Sets the coordinates along u and v, including those of the outer cells.
  void setCoordinatesAlongSides() {
    for (const ParticleLayer& layer : patch_.layers) {
      columns_ = std::max(columns_, layer.columns);
      rows_ = std::max(rows_, layer.rows);
    }
    nodes_.coordinates[0] = evenly(columns_);
    nodes_.coordinates[1] = evenly(rows_);
    if (!around_) return;
    const std::array<double, 2> spacing =
        endSpacings(withCounts(patch_.layers.front(), columns_, rows_));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<double>& at = nodes_.coordinates[axis];
      wide_[axis] = std::max(
          {border_.isTight ? kThinnest : 1.0, border_.rim / spacing[axis], beyond_[axis] / at[1]});
      const double step = wide_[axis] * at[1];
      at.insert(at.begin(), -step);
      at.push_back(1 + step);
    }
  }

  /// Sets the coordinates along w: those of the layers, and those of the outer nodes below and
  /// above the layers.
  void setCoordinatesAcrossLayers() {
    std::vector<double>& w = nodes_.coordinates[2];
    // As along u and v, cells that only reach for something are at least as wide as a layer.
    const double thickness =
        border_.isTight ? 0 : 1 / static_cast<double>(patch_.layers.size() - 1);
    const double rim = std::max(border_.rim / patch_.height,
                                beyond_[2] > 0 ? std::max(beyond_[2], thickness) : 0.0),
                 lift = std::max(0.0, -border_.embedDepth),
                 embedDepth = std::max(0.0, border_.embedDepth);
    if (rim > 0) w.push_back(-embedDepth - rim);
    if (embedDepth > 0) w.push_back(-embedDepth);
    below_ = static_cast<int>(w.size());
    for (const ParticleLayer& layer : patch_.layers) w.push_back(layer.w);
    lastLayer_ = static_cast<int>(w.size()) - 1;
    if (lift > 0) w.push_back(1 + lift);
    if (rim > 0) w.push_back(1 + lift + rim);
  }

  /// Adds the particles of one layer as the nodes (·, ·, k), and the outer nodes around them.
  void addLayer(int k) {
    const ParticleLayer layer =
        withCounts(patch_.layers[static_cast<std::size_t>(k - below_)], columns_, rows_);
    for (int j = 0; j < static_cast<int>(rows_); ++j)
      for (int i = 0; i < static_cast<int>(columns_); ++i)
        nodes_.positions[nodes_.index({i + around_, j + around_, k})] =
            layer.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    if (around_) addRim(layer, k);
  }

  /// Adds the outer nodes of the lattice along the sides and at the corners of layer k.
  void addRim(const ParticleLayer& layer, int k) {
    const std::array<int, 3>& cells = nodes_.cells;
    // The rim particles of the layer, if there are any, give the direction. Otherwise the last two
    // particles do.
    const auto end = [&](const Node& to, const Node& near, const Node& far, double share) {
      if (!layer.hasRim()) return extrapolate(to, near, far, share);
      const V3d p = nodes_.position(near);
      nodes_.positions[nodes_.index(to)] = p + (layer.beyond(to[0] - 1, to[1] - 1) - p) * share;
    };
    for (int j = 1; j <= static_cast<int>(rows_); ++j) {
      end({0, j, k}, {1, j, k}, {2, j, k}, wide_[0]);
      end({cells[0], j, k}, {cells[0] - 1, j, k}, {cells[0] - 2, j, k}, wide_[0]);
    }
    for (int i = 1; i <= static_cast<int>(columns_); ++i) {
      end({i, 0, k}, {i, 1, k}, {i, 2, k}, wide_[1]);
      end({i, cells[1], k}, {i, cells[1] - 1, k}, {i, cells[1] - 2, k}, wide_[1]);
    }
    for (const int i : {0, cells[0]})
      for (const int j : {0, cells[1]}) {
        const int a = i == 0 ? 1 : i - 1, b = j == 0 ? 1 : j - 1;
        nodes_.positions[nodes_.index({i, j, k})] =
            nodes_.position({i, b, k}) + nodes_.position({a, j, k}) - nodes_.position({a, b, k});
      }
  }

  /// Continues the columns linearly to the nodes (·, ·, to), from the nodes at w-indices `near` and
  /// `far`.
  void continueLayers(int to, int near, int far) {
    const std::vector<double>& w = nodes_.coordinates[2];
    const double share = (w[static_cast<std::size_t>(to)] - w[static_cast<std::size_t>(near)]) /
                         (w[static_cast<std::size_t>(near)] - w[static_cast<std::size_t>(far)]);
    for (int j = 0; j <= nodes_.cells[1]; ++j)
      for (int i = 0; i <= nodes_.cells[0]; ++i)
        extrapolate({i, j, to}, {i, j, near}, {i, j, far}, share);
  }

  void extrapolate(const Node& to, const Node& near, const Node& far, double share) {
    const V3d a = nodes_.position(near), b = nodes_.position(far);
    nodes_.positions[nodes_.index(to)] = a + (a - b) * share;
  }

  const Patch& patch_;
  const LatticeBorder& border_;
  int around_ = 0;                       ///< outer cells on each side, 0 or 1
  std::array<double, 3> beyond_ = {};    ///< width that `reach` needs of the outer cells; 0: none
  std::size_t columns_ = 2, rows_ = 2;   ///< largest numbers of columns and rows of all layers
  std::array<double, 2> wide_ = {1, 1};  ///< width of outer cells along u and v, in inner cells
  int below_ = 0, lastLayer_ = 0;        ///< w-indices of the nodes of the first and the last layer
  LatticeNodes nodes_;
};

}  // namespace

LatticeNodes latticeNodes(const Patch& patch, const LatticeBorder& border) {
  return LatticeBuilder(patch, border).build();
}

}  // namespace mapping
