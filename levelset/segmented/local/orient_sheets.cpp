#include "levelset/segmented/local/orient_sheets.h"

#include <utility>

#include "levelset/geometry/mesh_sides.h"

namespace levelset {

void orientSheets(std::vector<std::array<std::uint32_t, 3>>& triangles,
                  const std::vector<char>& isSheet) {
  struct Neighbour {
    std::uint32_t triangle;
    bool isTurned;  ///< faces the other way
  };
  std::vector<std::array<Neighbour, 3>> neighbours(triangles.size());
  std::vector<std::uint8_t> counts(triangles.size());
  forEachEdge(sortedSides(triangles), [&](auto first, auto end) {
    if (end - first != 2) return;
    const MeshSide &a = first[0], &b = first[1];
    if (!isSheet[a.triangle] || !isSheet[b.triangle]) return;
    const bool isTurned = a.rises == b.rises;
    neighbours[a.triangle][counts[a.triangle]++] = {b.triangle, isTurned};
    neighbours[b.triangle][counts[b.triangle]++] = {a.triangle, isTurned};
  });
  std::vector<char> isReached(triangles.size()), turns(triangles.size());
  std::vector<std::uint32_t> queue;
  for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (!isSheet[seed] || isReached[seed]) continue;
    isReached[seed] = true;
    queue.assign(1, seed);
    for (std::size_t n = 0; n < queue.size(); ++n)
      for (std::uint8_t k = 0; k < counts[queue[n]]; ++k) {
        const Neighbour& next = neighbours[queue[n]][k];
        if (isReached[next.triangle]) continue;
        isReached[next.triangle] = true;
        turns[next.triangle] = static_cast<char>(next.isTurned != (turns[queue[n]] != 0));
        queue.push_back(next.triangle);
      }
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (turns[t]) std::swap(triangles[t][1], triangles[t][2]);
}

}  // namespace levelset
