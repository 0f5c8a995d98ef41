#include "levelset/meshing/front/fill_loop.h"

#include <algorithm>
#include <cmath>

namespace levelset {
namespace {

using Imath::V3d;

constexpr std::size_t kLongestLoop = 200;
// Factor of the area of a triangle whose normal leans away from that of a vertex.
constexpr double kLeaning = 100;
// Weight of the squared sides of a triangle, beside its area. Avoids needles.
constexpr double kSides = 0.01;

}  // namespace

std::vector<std::array<std::uint32_t, 3>> fillLoop(
    const std::vector<std::uint32_t>& loop, const std::vector<V3d>& positions,
    const std::vector<V3d>& normals,
    const std::function<bool(std::uint32_t, std::uint32_t)>& isUsed, double longest) {
  const std::size_t n = loop.size();
  if (n < 3 || n > kLongestLoop) return {};
  const auto weight = [&](std::size_t i, std::size_t j, std::size_t k) {
    const V3d &a = positions[loop[i]], &b = positions[loop[j]], &c = positions[loop[k]];
    const V3d twice = (b - a).cross(c - a);
    const double area = twice.length();
    double least = 1, sum = 0;
    if (area > 0)
      for (const std::size_t v : {i, j, k}) {
        const double cosine = twice.dot(normals[loop[v]]) / area;
        least = std::min(least, cosine);
        sum += cosine;
      }
    if (sum < 0) return static_cast<double>(INFINITY);  // folded
    return area * (1 + kLeaning * std::max(0.0, 0.2 - least)) +
           kSides * ((b - a).length2() + (c - b).length2() + (a - c).length2());
  };
  // A diagonal must be a new edge of the mesh.
  const auto isDiagonal = [&](std::size_t i, std::size_t k) {
    return loop[i] != loop[k] && !isUsed(loop[i], loop[k]) && !isUsed(loop[k], loop[i]) &&
           (positions[loop[k]] - positions[loop[i]]).length2() <= longest * longest;
  };
  // cost[i][k]: least cost of the polygon from vertex i to vertex k.
  std::vector<double> cost(n * n, INFINITY);
  std::vector<std::size_t> middle(n * n, 0);
  for (std::size_t i = 0; i + 1 < n; ++i) cost[i * n + i + 1] = 0;
  for (std::size_t gap = 2; gap < n; ++gap)
    for (std::size_t i = 0; i + gap < n; ++i) {
      const std::size_t k = i + gap;
      if (gap + 1 < n && !isDiagonal(i, k)) continue;
      for (std::size_t j = i + 1; j < k; ++j) {
        const double sum = cost[i * n + j] + cost[j * n + k];
        if (!(sum < cost[i * n + k])) continue;
        if (loop[i] == loop[j] || loop[j] == loop[k]) continue;
        if (const double with = sum + weight(i, j, k); with < cost[i * n + k]) {
          cost[i * n + k] = with;
          middle[i * n + k] = j;
        }
      }
    }
  if (!std::isfinite(cost[n - 1])) return {};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::size_t, 2>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k < i + 2) continue;
    const std::size_t j = middle[i * n + k];
    triangles.push_back({loop[i], loop[j], loop[k]});
    open.push_back({i, j});
    open.push_back({j, k});
  }
  // The same vertices may occur twice in a loop, and so may a diagonal.
  std::vector<std::array<std::uint32_t, 2>> sides;
  for (const auto& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) sides.push_back({t[i], t[(i + 1) % 3]});
  std::sort(sides.begin(), sides.end());
  if (std::adjacent_find(sides.begin(), sides.end()) != sides.end()) return {};
  return triangles;
}

}  // namespace levelset
