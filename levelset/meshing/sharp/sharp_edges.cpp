#include "levelset/meshing/sharp/sharp_edges.h"

#include <algorithm>
#include <tuple>

namespace levelset {
namespace {

std::uint32_t oppositeVertex(const MeshTriangle& t, std::uint32_t a, std::uint32_t b) {
  return *std::find_if(t.begin(), t.end(), [&](std::uint32_t v) { return v != a && v != b; });
}

}  // namespace

std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b);
}

std::vector<bool> markVertices(const std::vector<MeshTriangle>& triangles,
                               const std::vector<std::size_t>& chosen, std::size_t vertexCount) {
  std::vector<bool> isIn(vertexCount);
  for (const std::size_t i : chosen)
    for (const std::uint32_t v : triangles[i]) isIn[v] = true;
  return isIn;
}

void addSides(const std::vector<MeshTriangle>& triangles, const std::vector<std::size_t>& chosen,
              std::size_t vertexCount, std::vector<TriangleSide>& sides) {
  std::unordered_set<std::uint64_t> wanted;
  for (const std::size_t i : chosen)
    for (std::size_t k = 0; k < 3; ++k)
      wanted.insert(edgeKey(triangles[i][k], triangles[i][(k + 1) % 3]));
  if (wanted.empty()) return;
  const std::vector<bool> isIn = markVertices(triangles, chosen, vertexCount);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const MeshTriangle& t = triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
      if (isIn[a] && isIn[b] && wanted.count(edgeKey(a, b))) sides.push_back({a, b, i});
    }
  }
}

std::vector<PairedEdge> pairSides(std::vector<TriangleSide> sides) {
  const auto key = [](const TriangleSide& s) { return std::tie(s.low, s.high, s.triangle); };
  std::sort(sides.begin(), sides.end(),
            [&](const TriangleSide& a, const TriangleSide& b) { return key(a) < key(b); });
  sides.erase(
      std::unique(sides.begin(), sides.end(),
                  [&](const TriangleSide& a, const TriangleSide& b) { return key(a) == key(b); }),
      sides.end());
  std::vector<PairedEdge> edges;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].low != sides[i + 1].low || sides[i].high != sides[i + 1].high) continue;
    edges.push_back({sides[i].low, sides[i].high, {sides[i].triangle, sides[i + 1].triangle}});
    ++i;
  }
  return edges;
}

std::unordered_set<std::uint64_t> edgesBeside(const std::vector<PairedEdge>& edges,
                                              const std::vector<MeshTriangle>& triangles,
                                              std::size_t vertexCount) {
  std::vector<bool> marked(vertexCount);
  for (const PairedEdge& edge : edges)
    for (const std::size_t i : edge.triangle)
      for (const std::uint32_t v : triangles[i]) marked[v] = true;
  std::unordered_set<std::uint64_t> found;
  for (const MeshTriangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (marked[t[k]] && marked[t[(k + 1) % 3]]) found.insert(edgeKey(t[k], t[(k + 1) % 3]));
  return found;
}

EdgeFlip flipOf(const PairedEdge& edge, const std::vector<MeshTriangle>& triangles,
                const std::unordered_set<std::uint64_t>& present) {
  const MeshTriangle &t = triangles[edge.triangle[0]], &u = triangles[edge.triangle[1]];
  // Name the ends so that the first triangle runs from a to b and the second from b to a.
  std::uint32_t a = edge.low, b = edge.high;
  for (std::size_t k = 0; k < 3; ++k)
    if (t[k] == b && t[(k + 1) % 3] == a) std::swap(a, b);
  const std::uint32_t c = oppositeVertex(t, a, b), d = oppositeVertex(u, a, b);
  EdgeFlip flip{{a, d, c}, {d, b, c}, edgeKey(a, b), edgeKey(c, d)};
  flip.isPossible = c != d && !present.count(flip.added);
  return flip;
}

void applyFlip(const EdgeFlip& flip, const PairedEdge& edge, std::vector<MeshTriangle>& triangles,
               std::unordered_set<std::uint64_t>& present) {
  present.erase(flip.removed);
  present.insert(flip.added);
  triangles[edge.triangle[0]] = flip.left;
  triangles[edge.triangle[1]] = flip.right;
}

}  // namespace levelset
