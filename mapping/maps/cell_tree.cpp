#include "mapping/maps/cell_tree.h"

#include <algorithm>

namespace mapping {

CellTree::CellTree(const Lattice& lattice) {
  nodes_.reserve(2 * lattice.cellCount());
  build(lattice, {0, 0, 0}, lattice.cells());
}

Imath::Box3d CellTree::build(const Lattice& lattice, const Cell& from, const Cell& to) {
  const std::size_t index = nodes_.size();
  nodes_.push_back({{}, from, to});
  std::size_t longest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis)
    if (to[axis] - from[axis] > to[longest] - from[longest]) longest = axis;
  Imath::Box3d box;
  if (to[longest] - from[longest] == 1) {
    box = lattice.worldBox(from);
  } else {
    Cell middleTo = to, middleFrom = from;
    middleTo[longest] = middleFrom[longest] = (from[longest] + to[longest]) / 2;
    box = build(lattice, from, middleTo);
    nodes_[index].second = nodes_.size();
    box.extendBy(build(lattice, middleFrom, to));
  }
  nodes_[index].box = box;
  return box;
}

bool CellTree::visit(const Imath::Box3d& box, const std::function<bool(const Cell&)>& visit) const {
  return this->visit(0, box, visit);
}

bool CellTree::visit(std::size_t node, const Imath::Box3d& box,
                     const std::function<bool(const Cell&)>& visit) const {
  const Node& at = nodes_[node];
  if (!at.box.intersects(box)) return false;
  if (at.second == 0) return visit(at.from);
  return this->visit(node + 1, box, visit) || this->visit(at.second, box, visit);
}

}  // namespace mapping
