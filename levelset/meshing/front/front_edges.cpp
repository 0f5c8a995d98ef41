#include "levelset/meshing/front/front_edges.h"

namespace levelset {

using Imath::V3d;

std::uint32_t FrontEdges::add(std::uint32_t a, std::uint32_t b, const V3d& from, const V3d& to) {
  const auto edge = static_cast<std::uint32_t>(edges_.size());
  edges_.push_back({.a = a, .b = b, .isActive = true});
  places_.push_back({(from + to) * 0.5, (to - from).length()});
  tree_.add(edge, places_.back().middle, places_.back().length);
  ++active_;
  return edge;
}

void FrontEdges::remove(std::uint32_t edge) {
  edges_[edge].isActive = false;
  --active_;
  tree_.remove(edge, places_[edge].middle, places_[edge].length);
}

void FrontEdges::near(const V3d& position, double radius, std::vector<std::uint32_t>& found) const {
  // The middle of an edge lies within half its length of each of its points.
  tree_.anyNear(position, radius, 0.5, [&](std::uint32_t edge) {
    const Place& place = places_[edge];
    const double reach = radius + place.length / 2;
    if ((place.middle - position).length2() <= reach * reach) found.push_back(edge);
    return false;
  });
}

}  // namespace levelset
