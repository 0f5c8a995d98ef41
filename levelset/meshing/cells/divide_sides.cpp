#include "levelset/meshing/cells/divide_sides.h"

#include <algorithm>
#include <array>
#include <utility>

namespace levelset {
namespace {

constexpr std::uint32_t kNoMiddle = 0xffffffffu;

/// Returns the number of the vertex that halves a side, or kNoMiddle.
std::uint32_t middleOf(const std::vector<SideMiddle>& middles, std::size_t vertices,
                       std::uint32_t a, std::uint32_t b) {
  const std::pair<std::uint32_t, std::uint32_t> side = std::minmax(a, b);
  const auto found = std::lower_bound(middles.begin(), middles.end(), side,
                                      [](const SideMiddle& middle, const auto& of) {
                                        return std::pair(middle.low, middle.high) < of;
                                      });
  const bool isKnown =
      found != middles.end() && found->low == side.first && found->high == side.second;
  return isKnown ? static_cast<std::uint32_t>(vertices) +
                       static_cast<std::uint32_t>(found - middles.begin())
                 : kNoMiddle;
}

}  // namespace

IndexMesh divideSides(const IndexMesh& mesh, const std::vector<SideMiddle>& middles) {
  IndexMesh result{mesh.positions, {}};
  const std::size_t vertices = mesh.positions.size();
  result.triangles.reserve(mesh.triangles.size() + 2 * middles.size());
  std::vector<bool> isBeside(vertices, false);
  for (const SideMiddle& middle : middles) {
    result.positions.push_back(middle.position);
    isBeside[middle.low] = isBeside[middle.high] = true;
  }
  for (const auto& t : mesh.triangles) {
    if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return isBeside[v]; })) {
      result.triangles.push_back(t);
      continue;
    }
    // The corners and the middles, in their order around the triangle.
    std::vector<std::uint32_t> ring;
    std::array<std::uint32_t, 3> middle{};
    for (std::size_t k = 0; k < 3; ++k)
      middle[k] = middleOf(middles, vertices, t[k], t[(k + 1) % 3]);
    const auto count = 3 - std::count(middle.begin(), middle.end(), kNoMiddle);
    if (count == 3) {
      result.triangles.push_back(middle);
      for (std::size_t k = 0; k < 3; ++k)
        result.triangles.push_back({t[k], middle[k], middle[(k + 2) % 3]});
      continue;
    }
    // A fan about the first middle, which no side of the ring passes.
    std::size_t first = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      ring.push_back(t[k]);
      if (middle[k] == kNoMiddle) continue;
      first = ring.size();
      ring.push_back(middle[k]);
    }
    std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(first), ring.end());
    for (std::size_t n = 1; n + 1 < ring.size(); ++n)
      result.triangles.push_back({ring[0], ring[n], ring[n + 1]});
  }
  return result;
}

}  // namespace levelset
