#include "mapping/maps/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/layers/layer_resampling.h"

namespace mapping {
namespace {

using Imath::V3d;
using Node = std::array<int, 3>;

/// Evenly spaced coordinates from 0 to 1.
std::vector<double> evenly(std::size_t count) {
  std::vector<double> result(count, 1);
  for (std::size_t i = 0; i + 1 < count; ++i)
    result[i] = static_cast<double>(i) / static_cast<double>(count - 1);
  return result;
}

/// Mean distance of the outermost particles to their inner neighbours, along rows and along
/// columns.
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

}  // namespace

Lattice::Lattice(const Patch& patch, const LatticeBorder& border) {
  std::size_t columns = 2, rows = 2;
  for (const ParticleLayer& layer : patch.layers) {
    columns = std::max(columns, layer.columns);
    rows = std::max(rows, layer.rows);
  }
  const int around = border.rim > 0 ? 1 : 0;
  coordinates_[0] = evenly(columns);
  coordinates_[1] = evenly(rows);
  // Width of the outer cells along u and v, in cells of the grid.
  std::array<double, 2> wide = {1, 1};
  if (around) {
    const std::array<double, 2> spacing =
        endSpacings(withCounts(patch.layers.front(), columns, rows));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<double>& at = coordinates_[axis];
      wide[axis] = std::max(1.0, border.rim / spacing[axis]);
      const double step = wide[axis] * at[1];
      at.insert(at.begin(), -step);
      at.push_back(1 + step);
    }
  }
  std::vector<double>& w = coordinates_[2];
  const double rim = border.rim / patch.height, lift = std::max(0.0, -border.embedDepth),
               embedDepth = std::max(0.0, border.embedDepth);
  if (rim > 0) w.push_back(-embedDepth - rim);
  if (embedDepth > 0) w.push_back(-embedDepth);
  const auto below = static_cast<int>(w.size());
  for (const ParticleLayer& layer : patch.layers) w.push_back(layer.w);
  const auto lastLayer = static_cast<int>(w.size()) - 1;
  if (lift > 0) w.push_back(1 + lift);
  if (rim > 0) w.push_back(1 + lift + rim);
  for (std::size_t axis = 0; axis < 3; ++axis)
    cells_[axis] = static_cast<int>(coordinates_[axis].size()) - 1;

  positions_.resize(coordinates_[0].size() * coordinates_[1].size() * coordinates_[2].size());
  const auto straight = [&](const Node& to, const Node& near, const Node& far, double share) {
    const V3d a = positions_[nodeIndex(near)], b = positions_[nodeIndex(far)];
    positions_[nodeIndex(to)] = a + (a - b) * share;
  };
  for (int k = below; k <= lastLayer; ++k) {
    const ParticleLayer layer =
        withCounts(patch.layers[static_cast<std::size_t>(k - below)], columns, rows);
    for (int j = 0; j < static_cast<int>(rows); ++j)
      for (int i = 0; i < static_cast<int>(columns); ++i)
        positions_[nodeIndex({i + around, j + around, k})] =
            layer.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    if (!around) continue;
    // The rim particles, if there are any, give the direction.
    const auto end = [&](const Node& to, const Node& near, const Node& far, double share) {
      if (!layer.hasRim()) return straight(to, near, far, share);
      const V3d p = positions_[nodeIndex(near)];
      positions_[nodeIndex(to)] = p + (layer.beyond(to[0] - 1, to[1] - 1) - p) * share;
    };
    for (int j = 1; j <= static_cast<int>(rows); ++j) {
      end({0, j, k}, {1, j, k}, {2, j, k}, wide[0]);
      end({cells_[0], j, k}, {cells_[0] - 1, j, k}, {cells_[0] - 2, j, k}, wide[0]);
    }
    for (int i = 1; i <= static_cast<int>(columns); ++i) {
      end({i, 0, k}, {i, 1, k}, {i, 2, k}, wide[1]);
      end({i, cells_[1], k}, {i, cells_[1] - 1, k}, {i, cells_[1] - 2, k}, wide[1]);
    }
    for (const int i : {0, cells_[0]})
      for (const int j : {0, cells_[1]}) {
        const int a = i == 0 ? 1 : i - 1, b = j == 0 ? 1 : j - 1;
        positions_[nodeIndex({i, j, k})] = positions_[nodeIndex({i, b, k})] +
                                           positions_[nodeIndex({a, j, k})] -
                                           positions_[nodeIndex({a, b, k})];
      }
  }
  const auto onwards = [&](int to, int near, int far) {
    const double share = (w[static_cast<std::size_t>(to)] - w[static_cast<std::size_t>(near)]) /
                         (w[static_cast<std::size_t>(near)] - w[static_cast<std::size_t>(far)]);
    for (int j = 0; j <= cells_[1]; ++j)
      for (int i = 0; i <= cells_[0]; ++i) straight({i, j, to}, {i, j, near}, {i, j, far}, share);
  };
  for (int k = below - 1; k >= 0; --k) onwards(k, below, below + 1);
  for (int k = lastLayer + 1; k <= cells_[2]; ++k) onwards(k, lastLayer, lastLayer - 1);
}

std::size_t Lattice::cellCount() const {
  return static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) *
         static_cast<std::size_t>(cells_[2]);
}

Lattice::Corners Lattice::corners(const Tetrahedron& t) const {
  Node node = t.cell;
  Corners result;
  result[0] = positions_[nodeIndex(node)];
  for (std::size_t step = 0; step < 3; ++step) {
    ++node[static_cast<std::size_t>(kOrders[static_cast<std::size_t>(t.order)][step])];
    result[step + 1] = positions_[nodeIndex(node)];
  }
  return result;
}

Lattice::Corners Lattice::textureCorners(const Tetrahedron& t) const {
  Node node = t.cell;
  Corners result;
  result[0] = textureOf(node);
  for (std::size_t step = 0; step < 3; ++step) {
    ++node[static_cast<std::size_t>(kOrders[static_cast<std::size_t>(t.order)][step])];
    result[step + 1] = textureOf(node);
  }
  return result;
}

Imath::Box3d Lattice::textureBox(const Node& cell) const {
  return {textureOf(cell), textureOf({cell[0] + 1, cell[1] + 1, cell[2] + 1})};
}

Imath::Box3d Lattice::worldBox(const Node& cell) const {
  Imath::Box3d box;
  for (int corner = 0; corner < 8; ++corner)
    box.extendBy(positions_[nodeIndex(
        {cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)})]);
  return box;
}

bool Lattice::isOutermost(const Node& cell) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (cell[axis] == 0 || cell[axis] == cells_[axis] - 1) return true;
  return false;
}

bool Lattice::cross(Tetrahedron& t, int corner) const {
  std::array<int, 3> order = kOrders[static_cast<std::size_t>(t.order)];
  if (corner == 1) {
    std::swap(order[0], order[1]);
  } else if (corner == 2) {
    std::swap(order[1], order[2]);
  } else if (corner == 0) {
    const auto axis = static_cast<std::size_t>(order[0]);
    if (t.cell[axis] + 1 == cells_[axis]) return false;
    ++t.cell[axis];
    std::rotate(order.begin(), order.begin() + 1, order.end());
  } else {
    const auto axis = static_cast<std::size_t>(order[2]);
    if (t.cell[axis] == 0) return false;
    --t.cell[axis];
    std::rotate(order.begin(), order.begin() + 2, order.end());
  }
  t.order = static_cast<int>(std::find(kOrders.begin(), kOrders.end(), order) - kOrders.begin());
  return true;
}

bool Lattice::locate(const V3d& uvw, Tetrahedron& t) const {
  std::array<double, 3> fraction;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& nodes = coordinates_[axis];
    const double x = uvw[static_cast<int>(axis)];
    if (!(x >= nodes.front() && x <= nodes.back())) return false;
    const auto next = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, x);
    t.cell[axis] = static_cast<int>(next - nodes.begin()) - 1;
    fraction[axis] = (x - *(next - 1)) / (*next - *(next - 1));
  }
  std::array<int, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return fraction[static_cast<std::size_t>(a)] > fraction[static_cast<std::size_t>(b)];
  });
  t.order = static_cast<int>(std::find(kOrders.begin(), kOrders.end(), order) - kOrders.begin());
  return true;
}

std::array<double, 4> barycentric(const Lattice::Corners& corners, const V3d& x) {
  const V3d a = corners[1] - corners[0], b = corners[2] - corners[0], c = corners[3] - corners[0],
            p = x - corners[0];
  const V3d bc = b.cross(c), pa = p.cross(a);
  const double scale = 1 / a.dot(bc);
  const double first = p.dot(bc) * scale, second = -pa.dot(c) * scale, third = pa.dot(b) * scale;
  return {1 - first - second - third, first, second, third};
}

}  // namespace mapping
