#include "levelset/segmented/sources/double_triangles.h"

#include <algorithm>
#include <utility>

namespace levelset {

std::vector<std::array<std::uint32_t, 3>> withoutDoubles(
    std::vector<std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::size_t>> corners;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    corners.emplace_back(triangles[t], t);
    std::sort(corners.back().first.begin(), corners.back().first.end());
  }
  std::sort(corners.begin(), corners.end());
  std::vector<bool> isDouble(triangles.size());
  for (std::size_t n = 1; n < corners.size(); ++n)
    if (corners[n].first == corners[n - 1].first) isDouble[corners[n].second] = true;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (!isDouble[t]) triangles[kept++] = triangles[t];
  triangles.resize(kept);
  return triangles;
}

}  // namespace levelset
