#include "mapping/maps/lattice.h"

#include <algorithm>
#include <array>
#include <vector>

namespace mapping {
namespace {

using Imath::V3d;
using Node = std::array<int, 3>;

}  // namespace

std::size_t Lattice::cellCount() const {
  return static_cast<std::size_t>(nodes_.cells[0]) * static_cast<std::size_t>(nodes_.cells[1]) *
         static_cast<std::size_t>(nodes_.cells[2]);
}

Lattice::Corners Lattice::corners(const Tetrahedron& t) const {
  Node node = t.cell;
  Corners result;
  result[0] = nodes_.position(node);
  for (std::size_t step = 0; step < 3; ++step) {
    ++node[static_cast<std::size_t>(kOrders[static_cast<std::size_t>(t.order)][step])];
    result[step + 1] = nodes_.position(node);
  }
  return result;
}

Lattice::Corners Lattice::textureCorners(const Tetrahedron& t) const {
  Node node = t.cell;
  Corners result;
  result[0] = nodes_.textureOf(node);
  for (std::size_t step = 0; step < 3; ++step) {
    ++node[static_cast<std::size_t>(kOrders[static_cast<std::size_t>(t.order)][step])];
    result[step + 1] = nodes_.textureOf(node);
  }
  return result;
}

Imath::Box3d Lattice::textureBox(const Node& cell) const {
  return {nodes_.textureOf(cell), nodes_.textureOf({cell[0] + 1, cell[1] + 1, cell[2] + 1})};
}

Imath::Box3d Lattice::worldBox(const Node& cell) const {
  Imath::Box3d box;
  for (int corner = 0; corner < 8; ++corner)
    box.extendBy(nodes_.position(
        {cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)}));
  return box;
}

bool Lattice::isOutermost(const Node& cell) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (cell[axis] == 0 || cell[axis] == nodes_.cells[axis] - 1) return true;
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
    if (t.cell[axis] + 1 == nodes_.cells[axis]) return false;
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
    const std::vector<double>& nodes = nodes_.coordinates[axis];
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
