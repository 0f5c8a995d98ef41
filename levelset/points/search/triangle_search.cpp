#include "levelset/points/search/triangle_search.h"

namespace levelset::points {

template class OverlapTree<TriangleItem, SiblingBoxes>;

TriangleSearch makeTriangleSearch(const TriMesh& mesh) {
  std::vector<TriangleItem> items;
  items.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    items.push_back({{mesh.positions[a], mesh.positions[b], mesh.positions[c]},
                     static_cast<std::uint32_t>(items.size())});
  return TriangleSearch(std::move(items));
}

}  // namespace levelset::points
