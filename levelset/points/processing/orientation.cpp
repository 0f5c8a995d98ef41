#include "levelset/points/processing/orientation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "levelset/geometry/perpendicular.h"
#include "levelset/mesh_sign/winding.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using Imath::V3f;

/// How the normals at the ends of an edge agree.
struct EdgeAgreement {
  /// Cosine between the normals, after the second one is mirrored at the plane through the middle
  /// of the edge. On a circular arc it is 1 for normals of the same side, also at a sharp edge and
  /// between two sheets that face each other [Konig09].
  float cosine;
  /// From 0 to 1. An edge along a normal says little: noise makes such edges inside one sheet, and
  /// the mirror image turns their normals.
  float trust;
};

EdgeAgreement agreement(const PointCloud& cloud, std::uint32_t i, std::uint32_t j) {
  V3d along = cloud.positions[j] - cloud.positions[i];
  const double length = along.length();
  if (length > 0) along /= length;
  const V3d from(cloud.normals[i]), to(cloud.normals[j]);
  const double steep = std::max(std::abs(along.dot(from)), std::abs(along.dot(to)));
  return {static_cast<float>(from.dot(to - 2 * along.dot(to) * along)),
          static_cast<float>(1 - std::pow(steep, 4))};
}

bool hasNormal(const PointCloud& cloud, std::uint32_t i) {
  return cloud.normals[i] != V3f(0);
}

/// Disjoint sets of points. Each set has one orientation; `isTurned` says if the normal of a member
/// must be turned to agree with that of the set's root.
class TurnedSets {
 public:
  explicit TurnedSets(std::size_t count) : parent_(count), isTurned_(count, 0) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  /// Joins the sets of two points whose normals agree, or disagree (`isOpposite`).
  void join(std::uint32_t i, std::uint32_t j, bool isOpposite) {
    const std::uint32_t a = find(i), b = find(j);
    if (a == b) return;
    const bool turns = isOpposite != (isTurned_[i] != isTurned_[j]);
    const std::uint32_t low = std::min(a, b), high = std::max(a, b);
    parent_[high] = low;
    isTurned_[high] = turns ? 1 : 0;
  }
  /// Returns the root of a set. Afterwards it is the parent of `i`.
  std::uint32_t find(std::uint32_t i) {
    std::uint32_t root = i;
    bool turns = false;
    while (parent_[root] != root) {
      turns = turns != (isTurned_[root] != 0);
      root = parent_[root];
    }
    while (parent_[i] != root && i != root) {
      const std::uint32_t next = parent_[i];
      const bool rest = turns != (isTurned_[i] != 0);
      parent_[i] = root;
      isTurned_[i] = turns ? 1 : 0;
      turns = rest;
      i = next;
    }
    return root;
  }
  [[nodiscard]] std::uint32_t parent(std::uint32_t i) const { return parent_[i]; }
  [[nodiscard]] bool isTurned(std::uint32_t i) const { return isTurned_[i] != 0; }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<char> isTurned_;
};

constexpr std::uint64_t kNoEdge = std::numeric_limits<std::uint64_t>::max();

void lowerTo(std::uint64_t& value, std::uint64_t key) {
  std::atomic_ref<std::uint64_t> shared(value);
  std::uint64_t present = shared.load(std::memory_order_relaxed);
  while (key < present && !shared.compare_exchange_weak(present, key, std::memory_order_relaxed)) {
  }
}

/// Weight of an edge, 0 for parallel normals across it, as bits that sort like the number.
std::uint32_t weightBits(const EdgeAgreement& edge) {
  return std::bit_cast<std::uint32_t>(std::max(0.0f, 1 - edge.trust * std::abs(edge.cosine)));
}

/// Turns the normals along a minimum spanning tree of each connected part, by the method of
/// Boruvka. Edges are ordered by weight, point and slot, so the tree is unique.
/// @return the lowest point of the part of each point
std::vector<std::uint32_t> alignNormals(PointCloud& cloud, const NeighbourGraph& graph,
                                        const Progress& progress) {
  const std::size_t n = cloud.size();
  TurnedSets sets(n);
  std::vector<std::uint64_t> best(n);
  const auto forEachPoint = [n](const auto& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 4096), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) work(static_cast<std::uint32_t>(i));
    });
  };
  // Calls look(other point, agreement) for the edges from a point to other sets.
  const auto forEachEdge = [&](std::uint32_t i, const auto& look) {
    if (!hasNormal(cloud, i)) return;
    const std::uint32_t* edges = graph.edges(i);
    for (std::size_t slot = 0; slot < NeighbourGraph::kEdges; ++slot) {
      const std::uint32_t j = edges[slot];
      if (j == NeighbourGraph::kNone || !hasNormal(cloud, j)) continue;
      if (sets.parent(i) == sets.parent(j)) continue;
      look(j, agreement(cloud, i, j));
    }
  };
  for (int round = 0;; ++round) {
    report(progress, 1 - 1.0 / (1 + round));
    std::fill(best.begin(), best.end(), kNoEdge);
    forEachPoint([&](std::uint32_t i) {
      forEachEdge(i, [&](std::uint32_t j, const EdgeAgreement& edge) {
        const std::uint64_t key = std::uint64_t{weightBits(edge)} << 32 | i;
        lowerTo(best[sets.parent(i)], key);
        lowerTo(best[sets.parent(j)], key);
      });
    });
    // Finds the chosen edges before any set changes.
    struct Join {
      std::uint32_t i, j;
      bool isOpposite;
    };
    std::vector<Join> joins;
    for (std::uint32_t root = 0; root < n; ++root) {
      if (best[root] == kNoEdge) continue;
      const auto i = static_cast<std::uint32_t>(best[root] & 0xffffffffu);
      const auto bits = static_cast<std::uint32_t>(best[root] >> 32);
      bool isFound = false;
      forEachEdge(i, [&](std::uint32_t j, const EdgeAgreement& edge) {
        if (isFound || weightBits(edge) != bits) return;
        if (sets.parent(i) != root && sets.parent(j) != root) return;
        isFound = true;
        joins.push_back({i, j, edge.cosine < 0});
      });
    }
    if (joins.empty()) break;
    for (const Join& join : joins) sets.join(join.i, join.j, join.isOpposite);
    for (std::uint32_t i = 0; i < n; ++i) static_cast<void>(sets.find(i));
  }
  std::vector<std::uint32_t> roots(n);
  forEachPoint([&](std::uint32_t i) {
    roots[i] = sets.parent(i);
    if (sets.isTurned(i)) cloud.normals[i] = -cloud.normals[i];
  });
  return roots;
}

/// Points of one connected part, in ascending order.
struct Part {
  const std::uint32_t* begin;
  const std::uint32_t* end;
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(end - begin); }
};

constexpr std::size_t kMostDisks = 200000;  ///< of a part; more points are represented by some
constexpr std::size_t kMostTests = 200;     ///< points of a part at which its winding is tested

/// Adds a triangle for a disc at every `stride`-th point. It has the area of all of them.
void addDisks(const PointCloud& cloud, const NeighbourGraph& graph, const Part& part,
              std::size_t stride, std::vector<convert::WeightedTriangle>& disks) {
  for (std::size_t k = 0; k < part.size(); k += stride) {
    const std::uint32_t i = part.begin[k];
    const V3d centre = cloud.positions[i], normal(cloud.normals[i]);
    const double area = graph.area(i) * static_cast<double>(std::min(stride, part.size() - k));
    if (!(area > 0)) continue;
    const auto [u, v] = tangents(normal);
    // Circumradius of an equilateral triangle of this area.
    const double radius = std::sqrt(4 * area / (3 * std::sqrt(3.0)));
    convert::WeightedTriangle disk;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double angle = 2 * M_PI / 3 * static_cast<double>(corner);
      disk.corners[corner] = centre + radius * (std::cos(angle) * u + std::sin(angle) * v);
    }
    disks.push_back(disk);
  }
}

constexpr double kNearStep = 0.25;
/// Larger than the noise of most points: two standard deviations of half a spacing are one spacing.
constexpr double kStepBeyondNoise = 1.5;

/// Winding numbers on the surface at some points of a part: the mean of those on both sides, 0.5
/// for a closed surface that faces outwards.
/// @param distance  of both places from the point, in local spacings
std::vector<double> windingsOn(const PointCloud& cloud, const NeighbourGraph& graph,
                               const Part& part, const convert::WindingField& field,
                               double distance = kNearStep) {
  constexpr double kTolerance = 0.02;
  const std::size_t tests = std::min(part.size(), kMostTests);
  std::vector<double> windings(tests);
  tbb::parallel_for(std::size_t{0}, tests, [&](std::size_t k) {
    const std::uint32_t i = part.begin[k * part.size() / tests];
    // The triangles near the point contribute equal amounts of opposite sign on its two sides.
    const V3d step = distance * std::sqrt(graph.area(i)) * V3d(cloud.normals[i]);
    windings[k] = (field.within(kTolerance, cloud.positions[i] + step) +
                   field.within(kTolerance, cloud.positions[i] - step)) /
                  2;
  });
  return windings;
}

double meanOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

void turn(PointCloud& cloud, const Part& part) {
  for (const std::uint32_t* i = part.begin; i != part.end; ++i)
    cloud.normals[*i] = -cloud.normals[*i];
}

/// Turns a part for which no side is the outside: the largest component of its mean normal becomes
/// positive.
void turnUp(PointCloud& cloud, const Part& part) {
  V3d sum(0);
  for (const std::uint32_t* i = part.begin; i != part.end; ++i) sum += V3d(cloud.normals[*i]);
  const int axis = std::abs(sum.z) >= std::abs(sum.y) && std::abs(sum.z) >= std::abs(sum.x) ? 2
                   : std::abs(sum.y) >= std::abs(sum.x)                                     ? 1
                                                                                            : 0;
  if (sum[axis] < 0) turn(cloud, part);
}

std::size_t strideOf(std::size_t points) {
  return (points + kMostDisks - 1) / kMostDisks;
}

}  // namespace

void NeighbourGraph::set(std::uint32_t point, const std::vector<Neighbour>& found) {
  std::uint32_t* edges = edges_.data() + std::size_t{point} * kEdges;
  std::size_t count = 0;
  double squared = 0;
  for (const Neighbour& other : found) {
    if (other.index == point) continue;
    if (count == kEdges) break;
    edges[count++] = other.index;
    squared = other.squared;
  }
  if (count > 0) areas_[point] = M_PI * squared / static_cast<double>(count);
}

Orientation orientNormals(PointCloud& cloud, const NeighbourGraph& graph,
                          const Progress& progress) {
  const std::vector<std::uint32_t> roots =
      alignNormals(cloud, graph, subProgress(progress, 0, 0.7));
  std::vector<std::uint32_t> members;
  for (std::uint32_t i = 0; i < cloud.size(); ++i)
    if (hasNormal(cloud, i)) members.push_back(i);
  tbb::parallel_sort(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
    return roots[a] != roots[b] ? roots[a] < roots[b] : a < b;
  });
  std::vector<Part> parts;
  for (const std::uint32_t& member : members)
    if (parts.empty() || roots[*parts.back().begin] != roots[member])
      parts.push_back({&member, &member + 1});
    else
      ++parts.back().end;
  Orientation result;
  result.components = parts.size();
  // A part whose mean winding is nearer to 0 than this has no outside.
  constexpr double kLeastWinding = 0.05;
  std::vector<double> own(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<convert::WeightedTriangle> disks;
    addDisks(cloud, graph, parts[p], strideOf(parts[p].size()), disks);
    const convert::WindingField field(disks);
    own[p] = meanOf(windingsOn(cloud, graph, parts[p], field));
    if (std::abs(own[p]) < kLeastWinding) {
      ++result.guessed;
      turnUp(cloud, parts[p]);
      own[p] = 0;
    } else if (own[p] < 0) {
      turn(cloud, parts[p]);
      own[p] = -own[p];
    }
    if ((p & 0xFF) == 0)
      report(progress, 0.7 + 0.1 * static_cast<double>(p) / static_cast<double>(parts.size()));
  }
  const auto fieldOfAll = [&] {
    std::vector<convert::WeightedTriangle> disks;
    const std::size_t stride = strideOf(members.size());
    for (const Part& part : parts) addDisks(cloud, graph, part, stride, disks);
    return convert::WindingField(disks);
  };
  if (parts.size() > 1) {
    const convert::WindingField field = fieldOfAll();
    std::vector<char> isCavity(parts.size(), 0);
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const double outside = meanOf(windingsOn(cloud, graph, parts[p], field)) - own[p];
      isCavity[p] = own[p] > 0 && std::lround(outside) % 2 != 0;
    }
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (isCavity[p]) turn(cloud, parts[p]);
  }
  report(progress, 0.9);
  // A winding number that differs from 0.5 by more than this contradicts the normal.
  constexpr double kMostDifference = 0.25;
  const convert::WindingField field = fieldOfAll();
  std::size_t tested = 0, doubtful = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (own[p] == 0) continue;  // the outside is a guess
    // In noise, both near places may lie on one side of the surface. In a thin sheet, the far ones
    // may lie outside.
    const auto contradicts = [](double winding) {
      return std::abs(winding - 0.5) > kMostDifference;
    };
    const std::vector<double> near = windingsOn(cloud, graph, parts[p], field);
    tested += near.size();
    if (std::none_of(near.begin(), near.end(), contradicts)) continue;
    const std::vector<double> far = windingsOn(cloud, graph, parts[p], field, kStepBeyondNoise);
    for (std::size_t k = 0; k < near.size(); ++k)
      doubtful += contradicts(near[k]) && contradicts(far[k]) ? 1 : 0;
  }
  if (tested > 0) result.doubtful = static_cast<double>(doubtful) / static_cast<double>(tested);
  report(progress, 1);
  return result;
}

}  // namespace levelset::points
