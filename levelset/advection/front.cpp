#include "levelset/advection/front.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "levelset/advection/characteristic.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::flow {
namespace {

using Imath::V3d;
using Triangle = std::array<std::uint32_t, 3>;

constexpr double kLongestEdge = 1;  // voxels; longer edges are split
// Limits of a step: displacement of a vertex in voxels, strain of an edge, error of a vertex in
// voxels. Strain is the change of an edge vector divided by its length, or by kLongestEdge for
// shorter edges. It is limited because a split edge gets its new vertex on a curve through its end
// points only. Edges shorter than kLongestEdge are not split, so the error limit suffices for them.
constexpr double kFarthestMove = 16, kMostStrain = 0.7, kMostError = 2e-3;
// The error limit does not apply when the largest sampled speed moves a vertex less than this
// distance in a step, voxels. Otherwise no step would be short enough at a jump of the velocity.
constexpr double kShortMove = 0.25;
// Limit of Characteristic::stageDeviation, voxels: the second velocity sample of a step against the
// line through the first and the third.
constexpr double kMostStageDeviation = 1;
// Memory in bytes of a triangle and its share of the vertices, with temporary arrays for splitting
// and moving.
constexpr double kBytesPerTriangle = 100;
// Limit of the number of triangles for each voxel² of the largest area so far, and an allowance for
// small surfaces. A surface with more triangles is crumpled, not stretched, and its
// self-intersections take long to resolve. The largest area counts because a surface that shrinks
// again keeps its triangles. The test Front.HasFewTrianglesWhereItIsStretched shows the margin for
// smooth velocities.
constexpr double kMostTrianglesPerVoxel = 50, kSpareTriangles = 20000;
// An end of an edge lies on a crease when the dot product of its vertex normal and the mean of the
// two face normals beside the edge is less than this cosine.
constexpr double kCreaseCosine = 0.8;

std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b);
}

V3d areaNormal(const TriMesh& mesh, const Triangle& t) {
  const V3d& a = mesh.positions[t[0]];
  return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
}

/// Splits each edge longer than kLongestEdge once, and divides the triangles beside it.
class Splitter {
 public:
  explicit Splitter(TriMesh& mesh) : mesh_(mesh) {
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t i = 0; i < 3; ++i) mark(t[i], t[(i + 1) % 3]);
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  [[nodiscard]] std::size_t longEdges() const { return edges_.size(); }

  void run() {
    addMidpoints();
    divideTriangles();
  }

 private:
  [[nodiscard]] bool isLong(std::uint32_t a, std::uint32_t b) const {
    return (mesh_.positions[a] - mesh_.positions[b]).length2() > kLongestEdge * kLongestEdge;
  }

  /// Stores a long edge once: only one of its two triangles runs from the lower to the higher
  /// vertex index.
  void mark(std::uint32_t a, std::uint32_t b) {
    if (a < b && isLong(a, b)) edges_.push_back(edgeKey(a, b));
  }

  /// Returns the index of a long edge in `edges_`.
  [[nodiscard]] std::uint32_t find(std::uint32_t a, std::uint32_t b) const {
    return index_.at(edgeKey(a, b));
  }

  /// Adds a vertex for each long edge: the midpoint of the cubic curve that the vertex normals
  /// define [Vlachos01]. A vertex on a crease does not bend the curve.
  void addMidpoints() {
    std::vector<V3d> normals(mesh_.positions.size(), V3d(0));
    for (const Triangle& t : mesh_.triangles) {
      const V3d n = areaNormal(mesh_, t);
      for (const std::uint32_t v : t) normals[v] += n;
    }
    for (V3d& n : normals) n.normalize();
    std::vector<V3d> faces(edges_.size(), V3d(0));  // sum of the two unit normals beside an edge
    first_ = static_cast<std::uint32_t>(mesh_.positions.size());
    index_.reserve(edges_.size());
    for (std::size_t i = 0; i < edges_.size(); ++i)
      index_.emplace(edges_[i], static_cast<std::uint32_t>(i));
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t i = 0; i < 3; ++i)
        if (isLong(t[i], t[(i + 1) % 3]))
          faces[find(t[i], t[(i + 1) % 3])] += areaNormal(mesh_, t).normalized();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const auto a = static_cast<std::uint32_t>(edges_[i] >> 32),
                 b = static_cast<std::uint32_t>(edges_[i]);
      const V3d p = mesh_.positions[a], q = mesh_.positions[b];
      const V3d face = faces[i] * 0.5;
      const auto bend = [&](const V3d& normal, const V3d& along) {
        return normal.dot(face) < kCreaseCosine ? V3d(0) : normal * (along.dot(normal) / 8);
      };
      mesh_.positions.push_back((p + q) * 0.5 - bend(normals[a], q - p) - bend(normals[b], p - q));
    }
  }

  [[nodiscard]] std::uint32_t midpoint(std::uint32_t a, std::uint32_t b) const {
    return isLong(a, b) ? first_ + find(a, b) : 0;
  }

  void divideTriangles() {
    const std::size_t count = mesh_.triangles.size();
    for (std::size_t i = 0; i < count; ++i) {
      Triangle t = mesh_.triangles[i];
      std::array<std::uint32_t, 3> m;
      int marked = 0;
      for (std::size_t k = 0; k < 3; ++k) marked += (m[k] = midpoint(t[k], t[(k + 1) % 3])) != 0;
      if (marked == 0) continue;
      // Rotate the corners of the triangle so that its first edge is split, and its last edge is
      // not unless all three are.
      while (m[0] == 0 || (marked == 2 && m[2] != 0)) {
        std::rotate(t.begin(), t.begin() + 1, t.end());
        std::rotate(m.begin(), m.begin() + 1, m.end());
      }
      auto& all = mesh_.triangles;
      if (marked == 1) {
        all[i] = {t[0], m[0], t[2]};
        all.push_back({m[0], t[1], t[2]});
      } else if (marked == 3) {
        all[i] = {m[0], m[1], m[2]};
        all.push_back({t[0], m[0], m[2]});
        all.push_back({m[0], t[1], m[1]});
        all.push_back({m[2], m[1], t[2]});
      } else {
        all[i] = {m[0], t[1], m[1]};
        const auto& p = mesh_.positions;
        if ((p[t[0]] - p[m[1]]).length2() < (p[m[0]] - p[t[2]]).length2()) {
          all.push_back({t[0], m[0], m[1]});
          all.push_back({t[0], m[1], t[2]});
        } else {
          all.push_back({t[0], m[0], t[2]});
          all.push_back({m[0], m[1], t[2]});
        }
      }
    }
  }

  TriMesh& mesh_;
  std::vector<std::uint64_t> edges_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::uint32_t first_ = 0;  ///< vertex index of the first midpoint
};

}  // namespace

Front::Front(TriMesh mesh, std::size_t maxMemory) : mesh_(std::move(mesh)) {
  splitLongEdges(maxMemory);
  largestArea_ = surfaceArea(mesh_);
}

void Front::splitLongEdges(std::size_t maxMemory) {
  // A step stretches edges little, so few passes suffice. Edges that are still too long are split
  // after the next step.
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) {
    Splitter splitter(mesh_);
    const double count = static_cast<double>(mesh_.triangles.size() + 2 * splitter.longEdges());
    requireMemory(kBytesPerTriangle * count, memoryLimit(maxMemory));
    if (splitter.longEdges() == 0) return;
    splitter.run();
  }
}

namespace {

/// Maxima of the members of Characteristic over all vertices.
struct Largest {
  double fastest = 0, move = 0, error = 0, stageDeviation = 0;  ///< voxels
  double nonFiniteDistance = HUGE_VAL;                          ///< minimum over all vertices

  static Largest of(const Largest& a, const Largest& b) {
    return {std::max(a.fastest, b.fastest), std::max(a.move, b.move), std::max(a.error, b.error),
            std::max(a.stageDeviation, b.stageDeviation),
            std::min(a.nonFiniteDistance, b.nonFiniteDistance)};
  }
};

}  // namespace

double Front::firstStep(const TimeInterval& interval) const {
  const double fastest = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh_.positions.size(), 256), 0.0,
      [&](const auto& range, double largest) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const V3d& p = mesh_.positions[i];
          const V3d speed = interval.velocity(p, interval.from);
          requireFinite(interval, speed, p, interval.from);
          largest = std::max(largest, speed.length());
        }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
  return kFarthestMove / fastest;
}

double Front::tryStep(const TimeInterval& interval, double from, double to) {
  moved_.resize(mesh_.positions.size());
  const Largest largest = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh_.positions.size(), 256), Largest{},
      [&](const auto& range, Largest result) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const V3d& p = mesh_.positions[i];
          const Characteristic path(interval.velocity, p, from, to);
          moved_[i] = p + path.move;
          result = Largest::of(result, {path.fastest, path.move.length(), path.error.length(),
                                        path.stageDeviation, path.nonFiniteDistance});
        }
        return result;
      },
      Largest::of);
  isStill_ = largest.fastest == 0;
  if (!std::isfinite(largest.fastest)) {
    // The step may have sampled the velocity away from the path of the surface. The samples of a
    // shorter step may be finite.
    if (largest.nonFiniteDistance > kShortMove) return 0.25;
    for (const V3d& p : mesh_.positions) requireFinitePath(interval, p, from, to);
    throw InvalidInput(
        fmt::format("the velocity overflows at time {:.6g}; use smaller velocities", from));
  }
  double allowed = std::min(kFarthestMove / std::max(largest.move, largest.fastest / 4),
                            kMostStrain / mostStrain());
  if (largest.fastest > kShortMove) {
    if (largest.error > 0)
      allowed = std::min(allowed, std::max(0.1, std::pow(kMostError / largest.error, 0.2)));
    if (largest.stageDeviation > kMostStageDeviation) allowed = std::min(allowed, 0.5);
  }
  return allowed;
}

double Front::mostStrain() const {
  const double squared = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh_.triangles.size(), 1024), 0.0,
      [&](const auto& range, double largest) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh_.triangles[i][k], b = mesh_.triangles[i][(k + 1) % 3];
            if (a > b) continue;  // the triangle on the other side of the edge handles it
            const V3d before = mesh_.positions[b] - mesh_.positions[a];
            const V3d change = moved_[b] - moved_[a] - before;
            largest = std::max(largest, change.length2() / std::max(kLongestEdge * kLongestEdge,
                                                                    before.length2()));
          }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
  return std::sqrt(squared);
}

StepResult Front::step(const TimeInterval& interval, double from, double longest) {
  const double left = std::abs(interval.to - from), sign = interval.to < from ? -1 : 1;
  constexpr double kSlack = 1.05, kMargin = 0.9, kGrowth = 4;
  double dt = longest;
  if (from == interval.from) dt = std::min(dt, firstStep(interval));
  for (;;) {
    const double to = dt >= left ? interval.to : from + sign * dt;
    if (to == from || left > kGrowth * kMostSteps * dt) return {from, dt};
    const double allowed = tryStep(interval, from, to);
    if (allowed * kSlack >= 1) {
      mesh_.positions.swap(moved_);
      const double next = dt * std::clamp(kMargin * allowed, kMargin / kSlack, kGrowth);
      // While the velocity is zero, steps stay short, so that they do not skip the start of a
      // motion.
      const double total = std::abs(interval.to - interval.from);
      return {to, isStill_ ? std::min(next, kFirstShare * total) : next};
    }
    report(interval.progress, (from - interval.from) / (interval.to - interval.from));
    dt *= kMargin * allowed;
  }
}

std::size_t Front::advance(const TimeInterval& interval) {
  return integrate(interval.duration(), [&](double from, double longest) {
    const StepResult made = step(interval, from, longest);
    splitLongEdges(interval.maxMemory);
    largestArea_ = std::max(largestArea_, surfaceArea(mesh_));
    if (static_cast<double>(mesh_.triangles.size()) >
        kSpareTriangles + kMostTrianglesPerVoxel * largestArea_) {
      throw ResourceLimit(
          fmt::format("at time {:.6g} the velocity has folded the surface too finely to follow; "
                      "use a smoother velocity, a shorter time or --scheme semi-lagrangian",
                      made.time));
    }
    return made;
  });
}

}  // namespace levelset::flow
