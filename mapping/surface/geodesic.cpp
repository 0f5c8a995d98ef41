#include "mapping/surface/geodesic.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <unordered_map>

#include "levelset/error.h"

namespace mapping {
namespace {

using Imath::V3d;

// A walk that came out this much longer than its chord may have gone astray: A* is asked as well.
constexpr double kSuspiciousRatio = 1.7;
constexpr std::size_t kMaxSearchNodes = 4'000'000;
constexpr std::size_t kCoarsestSegments = 8;
constexpr int kMaxSweeps = 600;
constexpr double kStraight = 1e-3;  // voxels that the last sweep moved a point

V3d tangential(const V3d& way, const V3d& normal) {
  return way - normal * way.dot(normal);
}

/// Towards b by small steps on the surface; empty when stuck.
std::vector<V3d> walkTowards(const SurfaceField& field, double height, const V3d& a, const V3d& b) {
  const double step = field.voxelSize();
  const double maxSteps = 4 * (b - a).length() / step + 16;
  std::vector<V3d> path = {a};
  while ((b - path.back()).length() > 1.5 * step) {
    const V3d p = path.back(), way = b - p;
    const V3d along = tangential(way, field.normal(p));
    if (along.length() < 1e-3 * way.length() || static_cast<double>(path.size()) > maxSteps)
      return {};
    V3d next = p + along.normalized() * step;
    if (!field.project(next, height)) return {};
    const double moved = (next - p).length();
    if (moved > 2.5 * step || moved < 0.1 * step) return {};
    path.push_back(next);
  }
  path.push_back(b);
  return path;
}

/// A* over the lattice of one voxel about a, on the nodes next to the surface.
class LatticeSearch {
 public:
  LatticeSearch(const SurfaceField& field, double height, const V3d& a, const V3d& b)
      : field_(field), height_(height), origin_(a), goal_(b), step_(field.voxelSize()) {}

  std::vector<V3d> path() {
    open_.push({(goal_ - origin_).length(), pack({0, 0, 0})});
    nodes_[pack({0, 0, 0})] = {0, pack({0, 0, 0}), false};
    while (!open_.empty() && nodes_.size() < kMaxSearchNodes) {
      const std::uint64_t key = open_.top().second;
      open_.pop();
      Node& node = nodes_[key];
      if (node.closed) continue;
      node.closed = true;
      if ((place(unpack(key)) - goal_).length() <= step_) return trace(key);
      expand(key, node.cost);
    }
    return {};
  }

 private:
  using Cell = std::array<int, 3>;
  struct Node {
    double cost;
    std::uint64_t from;
    bool closed;
  };
  static constexpr int kBias = 1 << 20;

  static std::uint64_t pack(const Cell& c) {
    std::uint64_t key = 0;
    for (const int x : c) key = key << 21 | static_cast<std::uint64_t>(x + kBias);
    return key;
  }
  static Cell unpack(std::uint64_t key) {
    Cell c;
    for (int axis = 2; axis >= 0; --axis, key >>= 21)
      c[static_cast<std::size_t>(axis)] = static_cast<int>(key & 0x1fffff) - kBias;
    return c;
  }
  V3d place(const Cell& c) const { return origin_ + V3d(c[0], c[1], c[2]) * step_; }

  void expand(std::uint64_t key, double cost) {
    const Cell c = unpack(key);
    for (int neighbour = 0; neighbour < 27; ++neighbour) {
      const Cell d = {neighbour / 9 - 1, neighbour / 3 % 3 - 1, neighbour % 3 - 1};
      const Cell next = {c[0] + d[0], c[1] + d[1], c[2] + d[2]};
      const V3d p = place(next);
      const double length = std::sqrt(static_cast<double>(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
      if (length == 0 || std::abs(field_.value(p) - height_) > 0.9 * step_) continue;
      const double nextCost = cost + length * step_;
      const auto [it, isNew] = nodes_.try_emplace(pack(next), Node{nextCost, key, false});
      if (!isNew && (it->second.closed || it->second.cost <= nextCost)) continue;
      it->second = {nextCost, key, false};
      open_.push({nextCost + (goal_ - p).length(), pack(next)});
    }
  }

  std::vector<V3d> trace(std::uint64_t key) {
    std::vector<V3d> path = {goal_};
    for (; nodes_[key].from != key; key = nodes_[key].from) {
      V3d p = place(unpack(key));
      if (field_.project(p, height_)) path.push_back(p);
    }
    path.push_back(origin_);
    std::reverse(path.begin(), path.end());
    return path;
  }

  using Entry = std::pair<double, std::uint64_t>;
  const SurfaceField& field_;
  double height_;
  V3d origin_, goal_;
  double step_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
  std::unordered_map<std::uint64_t, Node> nodes_;
};

/// Over-relaxed sweeps until no point moves; the ends stay.
void relaxPath(const SurfaceField& field, double height, std::vector<V3d>& path) {
  if (path.size() < 3) return;
  const double segments = static_cast<double>(path.size() - 1);
  const double factor = 2 / (1 + std::sin(std::acos(-1.0) / segments));  // SOR's best for a chain
  const double longest = 0.5 * pathLength(path) / segments;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double moved = 0;
    for (std::size_t n = 1; n + 1 < path.size(); ++n) {
      // There and back again, so that neither end is favoured.
      const std::size_t i = sweep % 2 == 0 ? n : path.size() - 1 - n;
      V3d move = ((path[i - 1] + path[i + 1]) * 0.5 - path[i]) * factor;
      const V3d normal = field.normal(path[i]);
      move = tangential(move, normal);
      const double length = move.length();
      if (length > longest) move *= longest / length;
      V3d next = path[i] + move;
      if (!field.project(next, height) || (next - path[i]).length() > 2 * longest) continue;
      moved = std::max(moved, (next - path[i]).length());
      path[i] = next;
    }
    if (moved < kStraight * field.voxelSize()) return;
  }
}

std::vector<V3d> withMidpoints(const SurfaceField& field, double height,
                               const std::vector<V3d>& path) {
  std::vector<V3d> result = {path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    V3d middle = (path[i - 1] + path[i]) * 0.5;
    if (field.project(middle, height)) result.push_back(middle);
    result.push_back(path[i]);
  }
  return result;
}

}  // namespace

double pathLength(const std::vector<V3d>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).length();
  return length;
}

std::vector<V3d> sampleByArcLength(const std::vector<V3d>& path, std::size_t count) {
  const double total = pathLength(path);
  std::vector<V3d> result = {path.front()};
  double reached = 0;
  std::size_t segment = 1;
  for (std::size_t n = 1; n + 1 < count; ++n) {
    const double wanted = total * static_cast<double>(n) / static_cast<double>(count - 1);
    double length = (path[segment] - path[segment - 1]).length();
    while (reached + length < wanted && segment + 1 < path.size()) {
      reached += length;
      ++segment;
      length = (path[segment] - path[segment - 1]).length();
    }
    const double part = length > 0 ? std::clamp((wanted - reached) / length, 0.0, 1.0) : 0;
    result.push_back(path[segment - 1] + (path[segment] - path[segment - 1]) * part);
  }
  result.push_back(path.back());
  return result;
}

std::vector<V3d> straighten(const SurfaceField& field, double height, std::vector<V3d> path) {
  const double voxels = pathLength(path) / field.voxelSize();
  // Segments of some four voxels first: chords that stay within any band.
  std::size_t segments = std::max(kCoarsestSegments, static_cast<std::size_t>(voxels / 4));
  path = sampleByArcLength(path, segments + 1);
  for (std::size_t i = 1; i + 1 < path.size(); ++i) (void)field.project(path[i], height);
  relaxPath(field, height, path);
  while (static_cast<double>(path.size()) < voxels) {
    const std::size_t before = path.size();
    path = withMidpoints(field, height, path);
    if (path.size() == before) break;
    relaxPath(field, height, path);
  }
  return path;
}

std::vector<V3d> geodesic(const SurfaceField& field, double height, const V3d& a, const V3d& b) {
  std::vector<V3d> path = walkTowards(field, height, a, b);
  if (path.empty() || pathLength(path) > kSuspiciousRatio * (b - a).length()) {
    const std::vector<V3d> other = LatticeSearch(field, height, a, b).path();
    // A lattice path is up to 13 % longer than the curve that it follows.
    const bool isBetter =
        !other.empty() && (path.empty() || pathLength(other) < 1.13 * pathLength(path));
    if (isBetter) path = other;
  }
  if (path.empty()) return path;
  return straighten(field, height, std::move(path));
}

std::optional<V3d> walkStraight(const SurfaceField& field, double height, const V3d& from,
                                const V3d& direction, double length) {
  V3d p = from, ahead = tangential(direction, field.normal(from)).normalized();
  const double steps = std::max(1.0, std::ceil(length / (0.5 * field.voxelSize())));
  for (int i = 0; i < static_cast<int>(steps); ++i) {
    V3d next = p + ahead * (length / steps);
    const V3d normal = field.project(next, height) ? field.normal(next) : V3d(0);
    ahead = tangential(ahead, normal);
    if (normal == V3d(0) || ahead.length() < 1e-6) return {};
    ahead.normalize();
    p = next;
  }
  return p;
}

}  // namespace mapping
