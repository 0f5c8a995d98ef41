#include "levelset/flow/front.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "levelset/error.h"

namespace levelset::flow {
namespace {

using Imath::V3d;
using Triangle = std::array<std::uint32_t, 3>;

constexpr double kLongestEdge = 1;  // voxels
// A step moves no vertex further than this many voxels, and stretches no edge by more than this:
// the classical method then errs by some 1e-5 of the way.
constexpr double kFarthestMove = 6, kMostStrain = 0.2;
// Differences over shorter edges tell more of rounding than of strain.
constexpr double kShortestEdge = 0.25;
constexpr double kMostSteps = 20000;
constexpr std::size_t kSampledTriangles = 4096;
// Positions, triangles and what splitting and moving keep beside them.
constexpr double kBytesPerTriangle = 100;
// A surface with more triangles than this for each voxel of the largest area that it has had is
// crumpled, not stretched. On the way back from a stretch they are as many as they were there.
constexpr double kMostTrianglesPerVoxel = 100, kSpareTriangles = 100000;
// A face that leans further than this from a vertex normal belongs to another side of a crease.
constexpr double kCreaseCosine = 0.8;

std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b);
}

V3d areaNormal(const TriMesh& mesh, const Triangle& t) {
  const V3d& a = mesh.positions[t[0]];
  return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
}

/// Splits the edges that are too long, once.
class Splitter {
 public:
  explicit Splitter(TriMesh& mesh) : mesh_(mesh) {}

  /// @return whether there was any
  bool run() {
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t i = 0; i < 3; ++i) mark(t[i], t[(i + 1) % 3]);
    if (edges_.empty()) return false;
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    addMidpoints();
    divideTriangles();
    return true;
  }

 private:
  [[nodiscard]] bool isLong(std::uint32_t a, std::uint32_t b) const {
    return (mesh_.positions[a] - mesh_.positions[b]).length2() > kLongestEdge * kLongestEdge;
  }

  void mark(std::uint32_t a, std::uint32_t b) {
    if (isLong(a, b)) edges_.push_back(edgeKey(a, b));
  }

  /// Number of a long edge.
  [[nodiscard]] std::uint32_t find(std::uint32_t a, std::uint32_t b) const {
    return index_.at(edgeKey(a, b));
  }

  /// Midpoint of the cubic curve with the vertices' normals, straight on the side of a crease.
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
      // Turned so that the first edge is split, and the last one not unless all are.
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
  std::uint32_t first_ = 0;  ///< number of the first midpoint
};

template <typename Work>
void forEachVertex(std::size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
  });
}

}  // namespace

void requireFinite(const V3d& velocity, const V3d& place, double time, const char* action) {
  if (std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z)) return;
  throw InvalidInput(
      fmt::format("{}: the velocity is {},{},{} at {:.6g},{:.6g},{:.6g} and time {:.6g}; "
                  "give one that is finite wherever the surface goes",
                  action, velocity.x, velocity.y, velocity.z, place.x, place.y, place.z, time));
}

namespace {

/// @param guess  what the step before it makes likely
double chooseStep(const std::function<double(double)>& longest, double from, double to,
                  double guess) {
  const double left = std::abs(to - from), sign = to < from ? -1 : 1;
  double step = std::min({left, guess, longest(from)});
  constexpr int kTries = 40;
  for (int i = 0; i < kTries; ++i) {
    const double allowed = std::min(longest(from + sign * step / 2), longest(from + sign * step));
    if (step <= 1.05 * allowed) break;
    step = std::max(allowed, step / 4);
  }
  // The last two steps share what is left.
  return step < left && left < 2 * step ? left / 2 : step;
}

}  // namespace

std::size_t walk(const Journey& journey, const std::function<double(double)>& longest,
                 const std::function<void(double, double)>& step) {
  const double to = journey.to;
  double time = journey.from, dt = std::abs(to - time);
  std::size_t done = 0;
  while (time != to) {
    report(journey.progress, (time - journey.from) / (to - journey.from), journey.action);
    constexpr double kGrowth = 1.5;
    dt = chooseStep(longest, time, to, kGrowth * dt);
    const double needed = static_cast<double>(done) + std::abs(to - time) / dt;
    const double next = dt >= std::abs(to - time) ? to : time + (to < time ? -dt : dt);
    if (!(needed <= kMostSteps) || next == time) {
      throw ResourceLimit(
          fmt::format("{}: at time {:.6g} the velocity allows steps of {:.3g} only, which makes "
                      "about {:.3g}, and {} are the most; ask for a shorter time or a gentler "
                      "velocity",
                      journey.action, time, dt, needed, kMostSteps));
    }
    step(time, next);
    time = next;
    ++done;
  }
  report(journey.progress, 1, journey.action);
  return done;
}

Front::Front(TriMesh mesh) : mesh_(std::move(mesh)) {
  splitLongEdges();
}

void Front::splitLongEdges() {
  constexpr int kPasses = 4;  // a step stretches little; what is left waits for the next
  for (int pass = 0; pass < kPasses && Splitter(mesh_).run(); ++pass) {
  }
}

double Front::longestStep(const Velocity& velocity, double time, const char* action) const {
  // A fixed choice of triangles; what they miss is as smooth as what they see.
  const std::size_t count = mesh_.triangles.size(), stride = 1 + count / kSampledTriangles;
  const double most = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, count / stride, 256), 0.0,
      [&](const auto& range, double largest) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          std::array<V3d, 3> places, speeds;
          for (std::size_t k = 0; k < 3; ++k) {
            places[k] = mesh_.positions[mesh_.triangles[i * stride][k]];
            speeds[k] = velocity(places[k], time);
            requireFinite(speeds[k], places[k], time, action);
            largest = std::max(largest, speeds[k].length() / kFarthestMove);
          }
          for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            const double length = std::max(kShortestEdge, (places[k] - places[next]).length());
            largest =
                std::max(largest, (speeds[k] - speeds[next]).length() / (length * kMostStrain));
          }
        }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
  return 1 / most;
}

void Front::move(const Velocity& velocity, double from, double to, const char* action) {
  const double dt = to - from, middle = from + dt / 2;
  forEachVertex(mesh_.positions.size(), [&](std::size_t i) {
    V3d& p = mesh_.positions[i];
    const V3d k1 = velocity(p, from);
    const V3d k2 = velocity(p + k1 * (dt / 2), middle);
    const V3d k3 = velocity(p + k2 * (dt / 2), middle);
    const V3d k4 = velocity(p + k3 * dt, to);
    const V3d mean = (k1 + (k2 + k3) * 2.0 + k4) / 6.0;
    requireFinite(mean, p, from, action);
    p += mean * dt;
  });
}

std::size_t Front::advance(const Journey& journey) {
  const auto longest = [&](double time) {
    return longestStep(journey.velocity, time, journey.action);
  };
  return walk(journey, longest, [&](double from, double to) {
    move(journey.velocity, from, to, journey.action);
    splitLongEdges();
    requireMemory(kBytesPerTriangle * static_cast<double>(mesh_.triangles.size()),
                  journey.maxMemory, journey.action);
    largestArea_ = std::max(largestArea_, surfaceArea(mesh_));
    if (static_cast<double>(mesh_.triangles.size()) >
        kSpareTriangles + kMostTrianglesPerVoxel * largestArea_) {
      throw ResourceLimit(fmt::format(
          "{}: at time {:.6g} the velocity has folded the surface too finely to follow; "
          "use a smoother velocity, a shorter time or --scheme semi-lagrangian",
          journey.action, to));
    }
  });
}

}  // namespace levelset::flow
