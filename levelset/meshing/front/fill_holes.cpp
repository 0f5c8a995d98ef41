#include "levelset/meshing/front/fill_holes.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "levelset/meshing/front/fill_loop.h"

namespace levelset {
namespace {

using Loop = std::vector<std::uint32_t>;

constexpr std::uint32_t kNoSpoke = 0xffffffffu;
constexpr int kRings = 3;
// Longest diagonals of a hole, edge lengths. The holes that a front leaves are narrow.
constexpr double kLongestDiagonal = 3;

class HoleFiller {
 public:
  HoleFiller(const FrontSurface& surface, FrontMesh& mesh)
      : surface_(surface), mesh_(mesh), first_(mesh.triangles.size()) {
    sides_.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) use(t);
  }

  /// Returns false if there is no triangulation.
  bool fill(const Loop& loop, const std::set<std::uint32_t>& removed = {});
  /// Fills a loop after the triangles around it are removed.
  bool widenAndFill(const Loop& loop);
  /// Drops the triangles that were removed.
  void finish();

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | b;
  }
  void use(std::uint32_t triangle) {
    const auto& t = mesh_.triangles[triangle];
    for (std::size_t i = 0; i < 3; ++i) sides_[key(t[i], t[(i + 1) % 3])] = triangle;
  }
  /// Returns the triangle with a directed side.
  [[nodiscard]] std::optional<std::uint32_t> triangleAt(std::uint32_t a, std::uint32_t b) const {
    const auto found = sides_.find(key(a, b));
    if (found == sides_.end()) return {};
    return found->second;
  }
  void addFan(std::uint32_t vertex, std::uint32_t neighbour, std::set<std::uint32_t>& fan) const;
  [[nodiscard]] Loop boundaryOf(const std::set<std::uint32_t>& triangles, const Loop& hole) const;

  const FrontSurface& surface_;
  FrontMesh& mesh_;
  std::size_t first_;  ///< number of triangles that fill no hole
  std::unordered_map<std::uint64_t, std::uint32_t> sides_;
  std::set<std::uint32_t> removed_;
};

bool HoleFiller::fill(const Loop& loop, const std::set<std::uint32_t>& removed) {
  double longest = 0;
  for (const std::uint32_t v : loop)
    longest = std::max(longest, surface_.edgeLength(mesh_.positions[v]));
  const auto triangles = fillLoop(
      loop, mesh_.positions, mesh_.normals,
      [&](std::uint32_t a, std::uint32_t b) {
        const auto t = triangleAt(a, b);
        return t && !removed.contains(*t);
      },
      kLongestDiagonal * longest);
  if (triangles.empty()) return false;
  for (const std::uint32_t t : removed) {
    const auto& old = mesh_.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) sides_.erase(key(old[i], old[(i + 1) % 3]));
  }
  removed_.insert(removed.begin(), removed.end());
  for (const auto& t : triangles) {
    mesh_.triangles.push_back(t);
    use(static_cast<std::uint32_t>(mesh_.triangles.size() - 1));
  }
  return true;
}

/// Adds the triangles around a vertex, from its edge to a neighbour on, both ways.
void HoleFiller::addFan(std::uint32_t vertex, std::uint32_t neighbour,
                        std::set<std::uint32_t>& fan) const {
  for (const bool isLeft : {true, false}) {
    std::uint32_t v = neighbour;
    while (true) {
      const auto t = isLeft ? triangleAt(vertex, v) : triangleAt(v, vertex);
      if (!t) break;
      fan.insert(*t);
      for (const std::uint32_t w : mesh_.triangles[*t])
        if (w != vertex && w != v) {
          v = w;
          break;
        }
      if (v == neighbour) return;
    }
  }
}

/// Returns the loop around a hole and the triangles beside it; empty if it is not one simple loop.
Loop HoleFiller::boundaryOf(const std::set<std::uint32_t>& triangles, const Loop& hole) const {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;  // the hole lies to their left
  for (std::size_t i = 0; i < hole.size(); ++i)
    edges.insert({hole[i], hole[(i + 1) % hole.size()]});
  for (const std::uint32_t t : triangles)
    for (std::size_t i = 0; i < 3; ++i)
      edges.insert({mesh_.triangles[t][i], mesh_.triangles[t][(i + 1) % 3]});
  std::unordered_map<std::uint32_t, std::uint32_t> next;
  std::uint32_t start = 0;
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    if (!next.insert({a, b}).second) return {};
    start = a;
  }
  Loop loop;
  for (std::uint32_t v = start; loop.size() < next.size(); v = next[v]) {
    if (!next.contains(v)) return {};
    loop.push_back(v);
    if (next[v] == start) break;
  }
  return loop.size() == next.size() ? loop : Loop();
}

bool HoleFiller::widenAndFill(const Loop& hole) {
  std::set<std::uint32_t> around;
  for (int ring = 0; ring < kRings; ++ring) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> spokes;
    for (std::size_t i = 0; i < hole.size(); ++i)
      spokes.insert({hole[i], hole[(i + 1) % hole.size()]});
    for (const std::uint32_t t : around)
      for (std::size_t i = 0; i < 3; ++i)
        spokes.insert({mesh_.triangles[t][i], mesh_.triangles[t][(i + 1) % 3]});
    std::uint32_t last = kNoSpoke;
    for (const auto& [vertex, neighbour] : spokes) {
      if (vertex != last) addFan(vertex, neighbour, around);
      last = vertex;
    }
    const Loop loop = boundaryOf(around, hole);
    if (!loop.empty() && fill(loop, around)) return true;
  }
  return false;
}

void HoleFiller::finish() {
  std::vector<std::array<std::uint32_t, 3>> kept;
  kept.reserve(mesh_.triangles.size() - removed_.size());
  mesh_.filled = 0;
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (removed_.contains(t)) continue;
    kept.push_back(mesh_.triangles[t]);
    if (t >= first_) ++mesh_.filled;
  }
  mesh_.triangles = std::move(kept);
}

}  // namespace

void fillHoles(const FrontSurface& surface, const std::vector<Loop>& loops, FrontMesh& mesh) {
  mesh.isClosed = true;
  if (loops.empty()) return;
  HoleFiller filler(surface, mesh);
  std::vector<const Loop*> hard;
  for (const Loop& loop : loops)
    if (!filler.fill(loop)) hard.push_back(&loop);
  for (const Loop* loop : hard) {
    if (filler.widenAndFill(*loop)) continue;
    mesh.isClosed = false;
  }
  filler.finish();
}

}  // namespace levelset
