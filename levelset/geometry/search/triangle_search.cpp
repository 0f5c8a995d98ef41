#include "levelset/geometry/search/triangle_search.h"

namespace levelset {

template class OverlapTree<TriangleItem>;

TriangleSearch makeTriangleSearch(const TriMesh& mesh) {
  std::vector<TriangleItem> items;
  items.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    items.push_back({{mesh.positions[a], mesh.positions[b], mesh.positions[c]},
                     static_cast<std::uint32_t>(items.size())});
  return TriangleSearch(std::move(items));
}

}  // namespace levelset
