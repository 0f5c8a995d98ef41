#include "levelset/meshing/front/front_edges.h"

namespace levelset {

using Imath::V3d;

std::uint32_t FrontEdges::add(std::uint32_t a, std::uint32_t b, const V3d& from, const V3d& to) {
  const auto edge = static_cast<std::uint32_t>(edges_.size());
  edges_.push_back({.a = a, .b = b, .isActive = true});
  const V3d middle = (from + to) * 0.5;
  cells_.push_back(grid_.cellOf(middle));
  grid_.add(edge, middle);
  ++active_;
  return edge;
}

void FrontEdges::remove(std::uint32_t edge) {
  edges_[edge].isActive = false;
  --active_;
  grid_.remove(edge, cells_[edge]);
}

void FrontEdges::near(const V3d& position, double radius, std::vector<std::uint32_t>& found) const {
  // The middle of an edge lies within half a cell of each of its points.
  grid_.anyNear(position, radius + cell_ / 2, [&](std::uint32_t edge) {
    found.push_back(edge);
    return false;
  });
}

}  // namespace levelset
