#include "mapping/surface/geodesic_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <queue>
#include <unordered_map>

namespace mapping {
namespace {

using Imath::V3d;
using Path = std::vector<V3d>;

constexpr std::size_t kMaxSearchNodes = 4'000'000;
// Grid points within this distance of the surface belong to the graph. On a plane of any slope,
// they are connected through their 26 neighbours.
constexpr double kBesideVoxels = 0.75;
// A step that turns the normal by more than a right angle passes through a thin sheet, not around
// it.
constexpr double kLeastNormalCosine = 0;
// Length ratio of grid paths to true paths; 1.128 for the worst direction.
constexpr double kGridExcess = 1.15;
constexpr std::size_t kMostPaths = 40;

using Key = std::uint64_t;
using GridCell = std::array<int, 3>;
constexpr int kBias = 1 << 20;

Key packCell(const GridCell& c) {
  Key key = 0;
  for (const int x : c) key = key << 21 | static_cast<Key>(x + kBias);
  return key;
}

GridCell unpackCell(Key key) {
  GridCell c;
  for (int axis = 2; axis >= 0; --axis, key >>= 21)
    c[static_cast<std::size_t>(axis)] = static_cast<int>(key & 0x1fffff) - kBias;
  return c;
}

/// Graph of the grid points beside φ = height, built on demand. Nodes hold the state of the
/// searches from both ends (0: a, 1: b). GridCell (0, 0, 0) is the point a.
class PathGraph {
 public:
  struct Node {
    // Length of the shortest path found from a, and from b; world units.
    std::array<double, 2> cost = {HUGE_VAL, HUGE_VAL};
    std::array<Key, 2> from = {};
    std::array<bool, 2> isClosed = {};
    bool isBeside = false;
    V3d normal{0};
  };

  PathGraph(const SurfaceField& field, double height, const V3d& a, const V3d& b)
      : field_(field), height_(height), ends_{a, b}, step_(field.voxelSize()) {}

  [[nodiscard]] V3d position(Key key) const {
    const GridCell c = unpackCell(key);
    return ends_[0] + V3d(c[0], c[1], c[2]) * step_;
  }
  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  [[nodiscard]] const std::unordered_map<Key, Node>& nodes() const { return nodes_; }
  Node& node(Key key) { return nodes_.at(key); }

  /// Runs Dijkstra's algorithm from an end, or A* if `estimate` is not zero.
  /// @param mayLie  true if the search may visit a position, given its path length from `end`
  /// @param isGoal  true for a node at which the search ends
  /// @return key of the goal, or nothing
  template <typename MayLie, typename Estimate, typename IsGoal>
  std::optional<Key> search(std::size_t end, const MayLie& mayLie, const Estimate& estimate,
                            const IsGoal& isGoal) {
    open_ = {};
    start(end, estimate);
    while (!open_.empty() && nodes_.size() < kMaxSearchNodes) {
      const Key key = open_.top().second;
      open_.pop();
      Node& current = nodes_.at(key);
      if (current.isClosed[end]) continue;
      current.isClosed[end] = true;
      if (isGoal(key, current)) return key;
      expand(end, key, mayLie, estimate);
    }
    return {};
  }

  [[nodiscard]] bool isBesideEnd(std::size_t end, const V3d& p, const V3d& normal) const {
    return (p - ends_[end]).length() <= 1.01 * step_ &&
           normal.dot(field_.normal(ends_[end])) > kLeastNormalCosine;
  }

  /// Returns the path from a node back to the start of the search from `end`, projected onto the
  /// surface.
  [[nodiscard]] Path trace(std::size_t end, Key key) {
    Path path;
    for (;; key = nodes_.at(key).from[end]) {
      V3d p = position(key);
      if (field_.project(p, height_)) path.push_back(p);
      if (nodes_.at(key).from[end] == key) break;
    }
    path.push_back(ends_[end]);
    return path;
  }

 private:
  using Entry = std::pair<double, Key>;

  Node& visit(Key key) {
    const auto [it, isNew] = nodes_.try_emplace(key);
    if (isNew) {
      const V3d p = position(key);
      it->second.isBeside = std::abs(field_.value(p) - height_) <= kBesideVoxels * step_;
      if (it->second.isBeside) it->second.normal = field_.normal(p);
    }
    return it->second;
  }

  /// Puts the nodes around an end into the queue; the straight distance of each from the end is its
  /// path length.
  template <typename Estimate>
  void start(std::size_t end, const Estimate& estimate) {
    const V3d offset = (ends_[end] - ends_[0]) / step_;
    const GridCell middle = {static_cast<int>(std::lround(offset.x)),
                             static_cast<int>(std::lround(offset.y)),
                             static_cast<int>(std::lround(offset.z))};
    for (int n = 0; n < 27; ++n) {
      const Key key =
          packCell({middle[0] + n / 9 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n % 3 - 1});
      Node& near = visit(key);
      const V3d p = position(key);
      if (!near.isBeside || !isBesideEnd(end, p, near.normal)) continue;
      near.cost[end] = (p - ends_[end]).length();
      near.from[end] = key;
      open_.push({near.cost[end] + estimate(p), key});
    }
  }

  template <typename MayLie, typename Estimate>
  void expand(std::size_t end, Key key, const MayLie& mayLie, const Estimate& estimate) {
    const GridCell c = unpackCell(key);
    const Node current = nodes_.at(key);  // a copy, because visit() may move the nodes in memory
    for (int n = 0; n < 27; ++n) {
      const GridCell d = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
      if (n == 13) continue;
      const Key nextKey = packCell({c[0] + d[0], c[1] + d[1], c[2] + d[2]});
      Node& next = visit(nextKey);
      if (!next.isBeside || next.isClosed[end]) continue;
      if (next.normal.dot(current.normal) <= kLeastNormalCosine) continue;
      const double cost =
          current.cost[end] +
          step_ * std::sqrt(static_cast<double>(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
      const V3d p = position(nextKey);
      if (cost >= next.cost[end] || !mayLie(p, cost)) continue;
      next.cost[end] = cost;
      next.from[end] = key;
      open_.push({cost + estimate(p), nextKey});
    }
  }

  const SurfaceField& field_;
  double height_;
  std::array<V3d, 2> ends_;
  double step_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
  std::unordered_map<Key, Node> nodes_;
};

struct Meeting {
  double cost;
  Key key;
};

/// Nodes with about equal path lengths from both ends, sorted by the sum of both lengths.
std::vector<Meeting> meetings(const PathGraph& graph) {
  std::vector<Meeting> result;
  for (const auto& [key, node] : graph.nodes()) {
    if (!node.isBeside || std::abs(node.cost[0] - node.cost[1]) > 1.8 * graph.step()) continue;
    const double cost = node.cost[0] + node.cost[1];
    if (std::isfinite(cost)) result.push_back({cost, key});
  }
  std::sort(result.begin(), result.end(), [](const Meeting& x, const Meeting& y) {
    return x.cost != y.cost ? x.cost < y.cost : x.key < y.key;
  });
  return result;
}

}  // namespace

Path GeodesicSearch::shortest() const {
  PathGraph graph(field_, height_, a_, b_);
  const auto goal = graph.search(
      0, [](const V3d&, double) { return true; }, [&](const V3d& p) { return (p - b_).length(); },
      [&](Key key, const PathGraph::Node& node) {
        return graph.isBesideEnd(1, graph.position(key), node.normal);
      });
  if (!goal) return {};
  Path path = graph.trace(0, *goal);
  std::reverse(path.begin(), path.end());
  path.push_back(b_);
  return path;
}

std::vector<Path> GeodesicSearch::alternatives(double longest) const {
  PathGraph graph(field_, height_, a_, b_);
  const double most = kGridExcess * longest, slack = 4 * graph.step();
  for (const std::size_t end : {0u, 1u}) {
    const V3d& from = end == 0 ? a_ : b_;
    const V3d& to = end == 0 ? b_ : a_;
    (void)graph.search(
        end,
        [&](const V3d& p, double cost) {
          return cost <= 0.5 * most + slack &&
                 (p - from).length() + (p - to).length() <= longest + slack;
        },
        [](const V3d&) { return 0.0; }, [](Key, const PathGraph::Node&) { return false; });
  }
  // Meeting points of the two searches that are close to each other belong to the same path.
  const double apart = std::max(3 * graph.step(), 0.025 * longest);
  std::vector<Path> paths;
  // Positions and surface normals of the meeting points of the paths found.
  std::vector<std::pair<V3d, V3d>> taken;
  const std::vector<Meeting> all = meetings(graph);
  for (const Meeting& meeting : all) {
    if (paths.size() == kMostPaths || meeting.cost > kGridExcess * all.front().cost) break;
    const V3d p = graph.position(meeting.key), normal = graph.node(meeting.key).normal;
    const bool isNew = std::none_of(taken.begin(), taken.end(), [&](const auto& other) {
      // The two faces of a thin sheet give two paths, even where they are close.
      return (p - other.first).length() < apart && normal.dot(other.second) > 0;
    });
    if (!isNew) continue;
    taken.emplace_back(p, normal);
    Path path = graph.trace(0, meeting.key);
    std::reverse(path.begin(), path.end());
    const Path rest = graph.trace(1, meeting.key);
    path.insert(path.end(), rest.begin() + 1, rest.end());
    paths.push_back(std::move(path));
  }
  return paths;
}

}  // namespace mapping
