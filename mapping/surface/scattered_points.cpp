#include "mapping/surface/scattered_points.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <random>
#include <span>
#include <unordered_map>
#include <utility>

#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::UsageError;

// Number of candidates per requested point; [Yuksel15] uses at least five.
constexpr double kCandidatesPerPoint = 20;
constexpr double kMostPoints = 1e6;
// Largest cosine between the normals of points that count as on opposite sides of a thin part.
constexpr double kOtherSide = -0.5;
// Largest thickness of a thin part, as a share of the least distance that points should have.
constexpr double kThin = 0.25;

/// Random numbers that are equal on all platforms, unlike the standard library's distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Uniform in [0, 1).
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

/// Grid of points for neighbour searches. Its cells are as wide as the largest distance that is
/// searched.
class PointGrid {
 public:
  explicit PointGrid(double width) : width_(width) {}
  void add(const V3d& p, std::size_t index) { cells_[cellOf(p)].push_back(index); }
  /// Visits at least all points within one cell width of p.
  template <typename Visit>
  void visitNear(const V3d& p, const Visit& visit) const {
    const CellKey c = cellOf(p);
    for (long x = c[0] - 1; x <= c[0] + 1; ++x)
      for (long y = c[1] - 1; y <= c[1] + 1; ++y)
        for (long z = c[2] - 1; z <= c[2] + 1; ++z) {
          const auto found = cells_.find({x, y, z});
          if (found == cells_.end()) continue;
          for (const std::size_t index : found->second) visit(index);
        }
  }

 private:
  using CellKey = std::array<long, 3>;
  [[nodiscard]] CellKey cellOf(const V3d& p) const {
    return {std::lround(p.x / width_), std::lround(p.y / width_), std::lround(p.z / width_)};
  }
  double width_;
  struct Hash {
    std::size_t operator()(const CellKey& c) const {
      std::uint64_t h = 0;
      for (const long x : c) h = (h ^ static_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15;
      return h ^ (h >> 29);
    }
  };
  std::unordered_map<CellKey, std::vector<std::size_t>, Hash> cells_;
};

void checkDensity(const ScatterDensity& density) {
  if (!(density.distance >= 0) || !std::isfinite(density.distance)) {
    throw UsageError(
        fmt::format("the distance between points is {}; give a positive length", density.distance));
  }
  if ((density.count > 0) == (density.distance > 0)) {
    throw UsageError("give either the number of points or their distance");
  }
}

double scaleAt(const ScatterDensity& density, const V3d& place) {
  const double scale = density.scale ? density.scale(place) : 1;
  if (!(scale > 0) || !std::isfinite(scale)) {
    throw UsageError(fmt::format("the scale at ({:.6g}, {:.6g}, {:.6g}) is {}; it must be positive",
                                 place.x, place.y, place.z, scale));
  }
  return scale;
}

/// Probability of accepting a point.
double acceptance(const ScatterDensity& density, const SurfacePoint& point) {
  const double weight = density.weight ? density.weight(point.position) : 1;
  if (!density.share) return weight;
  const double share = density.share(point.position, point.normal);
  if (std::isnan(share)) {
    const V3d& p = point.position;
    throw UsageError(fmt::format(
        "the density at ({:.6g}, {:.6g}, {:.6g}) is not a number; it must be one on the surface",
        p.x, p.y, p.z));
  }
  return weight * std::clamp(share, 0.0, 1.0);
}

/// The zero set as triangles, sampled by area in units of the local scale. So regions with a small
/// scale get as many points per scaled area as others.
class AreaSampler {
 public:
  AreaSampler(const levelset::NarrowBand& base, const ScatterDensity& density)
      : mesh_(levelset::bandToMesh(base, {.openSurface = base.isOpenSurface()})),
        field_(base),
        isOpen_(base.isOpenSurface()) {
    if (isOpen_) dropWalls();
    sums_.reserve(mesh_.triangles.size());
    for (const auto& [a, b, c] : mesh_.triangles) {
      const V3d& p = mesh_.positions[a];
      const double scale = scaleAt(density, (p + mesh_.positions[b] + mesh_.positions[c]) / 3.0);
      area_ +=
          0.5 * (mesh_.positions[b] - p).cross(mesh_.positions[c] - p).length() / (scale * scale);
      sums_.push_back(area_);
    }
  }
  /// Area of the zero set, each part divided by the square of its local scale.
  [[nodiscard]] double area() const { return area_; }

  SurfacePoint operator()(Random& random) const {
    const auto chosen = std::upper_bound(sums_.begin(), sums_.end(), random() * area_);
    const auto n = std::min(static_cast<std::size_t>(chosen - sums_.begin()), sums_.size() - 1);
    const auto& [a, b, c] = mesh_.triangles[n];
    const double root = std::sqrt(random()), share = random();
    SurfacePoint point;
    point.position = mesh_.positions[a] * (1 - root) + mesh_.positions[b] * (root * (1 - share)) +
                     mesh_.positions[c] * (root * share);
    V3d foot = point.position;
    if (!field_.project(foot, 0)) {
      // At the border of an open surface the sampled point may not project; the triangle's centroid
      // does.
      foot = (mesh_.positions[a] + mesh_.positions[b] + mesh_.positions[c]) / 3.0;
      if (!isOpen_ || !field_.project(foot, 0)) foot = point.position;
    }
    point.position = foot;
    point.normal = field_.normal(point.position);
    return point;
  }

 private:
  /// Removes the triangles that close the band of an open surface at the border of the surface.
  void dropWalls() {
    std::erase_if(mesh_.triangles, [&](const auto& t) {
      V3d p = (mesh_.positions[t[0]] + mesh_.positions[t[1]] + mesh_.positions[t[2]]) / 3.0;
      const V3d before = p;
      return !field_.project(p, 0) || (p - before).length() > 0.5 * field_.voxelSize();
    });
  }

  levelset::TriMesh mesh_;
  SurfaceField field_;
  bool isOpen_;
  std::vector<double> sums_;
  double area_ = 0;
};

struct Candidates {
  std::vector<SurfacePoint> points;
  double area = 0;  ///< part of AreaSampler::area() that weight and share accept
};

/// Samples candidates by area and accepts each with its probability.
Candidates makeCandidates(const AreaSampler& sampler, const ScatterDensity& density,
                          std::size_t count, Random& random) {
  // Sampling ends after this many rejections in a row.
  constexpr std::size_t kMostMisses = 200000, kReported = 4096;
  Candidates result;
  std::size_t tried = 0, misses = 0;
  for (; misses < kMostMisses && result.points.size() < count; ++tried) {
    if (tried % kReported == 0) levelset::report(density.progress, 0.5);
    SurfacePoint point = sampler(random);
    const double luck = random();
    ++misses;
    if (!(luck < acceptance(density, point))) continue;
    misses = 0;
    point.scale = scaleAt(density, point.position);
    result.points.push_back(point);
  }
  if (result.points.empty()) {
    throw InvalidInput(density.share
                           ? "mask and density leave no position on the surface; enlarge them"
                           : "the mask leaves no position on the surface; enlarge it");
  }
  result.area =
      sampler.area() * static_cast<double>(result.points.size()) / static_cast<double>(tried);
  return result;
}

/// Distance of two points along the surface, divided by their mean scale.
/// @param reach  distance, divided by the mean scale of a and b, world units; a part thinner than a
///         quarter of it counts as thin
double scaledDistance(const SurfacePoint& a, const SurfacePoint& b, double reach) {
  const double scale = 0.5 * (a.scale + b.scale);
  return surfaceDistance(a, b, kThin * reach * scale) / scale;
}

double largestScale(std::span<const SurfacePoint> points) {
  double largest = 0;
  for (const SurfacePoint& p : points) largest = std::max(largest, p.scale);
  return largest;
}

/// Accepts candidates in their order, unless an accepted candidate is nearer than `distance`.
std::vector<SurfacePoint> throwDarts(std::span<const SurfacePoint> candidates, double distance) {
  std::vector<SurfacePoint> taken;
  PointGrid grid(distance * largestScale(candidates));
  for (const SurfacePoint& candidate : candidates) {
    bool isFree = true;
    grid.visitNear(candidate.position, [&](std::size_t index) {
      isFree = isFree && !(scaledDistance(candidate, taken[index], distance) < distance);
    });
    if (!isFree) continue;
    grid.add(candidate.position, taken.size());
    taken.push_back(candidate);
  }
  return taken;
}

/// Removes the most crowded candidates one by one. Returns the remaining candidates, then the
/// removed ones in reverse order, so that any first n of them are evenly distributed.
std::vector<SurfacePoint> orderBySpread(std::span<const SurfacePoint> candidates, double reach,
                                        std::size_t kept) {
  PointGrid grid(reach * largestScale(candidates));
  for (std::size_t i = 0; i < candidates.size(); ++i) grid.add(candidates[i].position, i);
  struct Neighbour {
    std::size_t index;
    double crowding;
  };
  // Pairs of candidates nearer than `limit` (a share of `reach`) have the same weight, because one
  // of the two is removed anyway [Yuksel15].
  const double share = static_cast<double>(kept) / static_cast<double>(candidates.size());
  const double limit = 0.65 * (1 - std::pow(share, 1.5));
  std::vector<std::vector<Neighbour>> neighbours(candidates.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, candidates.size(), 64), [&](const auto& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          grid.visitNear(candidates[i].position, [&](std::size_t j) {
            if (j == i) return;
            const double d = scaledDistance(candidates[i], candidates[j], 0.5 * reach) / reach;
            if (d < 1) neighbours[i].push_back({j, std::pow(1 - std::max(d, limit), 8)});
          });
      });
  std::vector<double> crowding(candidates.size(), 0);
  std::priority_queue<std::pair<double, std::size_t>> queue;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    for (const Neighbour& n : neighbours[i]) crowding[i] += n.crowding;
    queue.emplace(crowding[i], i);
  }
  std::vector<char> isGone(candidates.size(), 0);
  std::vector<std::size_t> order;
  while (order.size() + kept < candidates.size()) {
    const auto [value, index] = queue.top();
    queue.pop();
    if (isGone[index] || value != crowding[index]) continue;
    isGone[index] = 1;
    order.push_back(index);
    for (const Neighbour& n : neighbours[index]) {
      if (isGone[n.index]) continue;
      crowding[n.index] -= n.crowding;
      queue.emplace(crowding[n.index], n.index);
    }
  }
  std::vector<SurfacePoint> result;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (!isGone[i]) result.push_back(candidates[i]);
  for (auto it = order.rbegin(); it != order.rend(); ++it) result.push_back(candidates[*it]);
  return result;
}

}  // namespace

double surfaceDistance(const SurfacePoint& a, const SurfacePoint& b, double thin) {
  const V3d offset = b.position - a.position;
  const double straight = offset.length();
  if (straight == 0) return 0;
  if (straight < thin && a.normal.dot(b.normal) < kOtherSide)
    return std::numeric_limits<double>::infinity();
  const auto clamped = [](double x) { return std::clamp(x, -1.0, 1.0); };
  const double first = clamped(a.normal.dot(offset) / straight),
               last = clamped(b.normal.dot(offset) / straight);
  const double turn = first - last;
  constexpr double kStraight = 1e-4;
  const double bend = std::abs(turn) < kStraight ? 1 / std::sqrt(std::max(1 - first * first, 0.25))
                                                 : (std::asin(first) - std::asin(last)) / turn;
  return bend * straight;
}

double leastDistance(std::span<const SurfacePoint> points, double reach, double kept) {
  PointGrid grid(reach * largestScale(points));
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    grid.visitNear(points[i].position, [&](std::size_t j) {
      least = std::min(least, scaledDistance(points[i], points[j], kept));
    });
    grid.add(points[i].position, i);
  }
  return least;
}

ScatteredPoints scatterPoints(const levelset::NarrowBand& base, const ScatterDensity& density) {
  checkDensity(density);
  if (base.isEmpty()) {
    throw InvalidInput("the base has no surface; give a solid with at least one voxel");
  }
  levelset::report(density.progress, 0);
  const AreaSampler sampler(base, density);
  if (!(sampler.area() > 0)) {
    throw InvalidInput("the base has no surface; give a solid with at least one voxel");
  }
  levelset::report(density.progress, 0.5);
  Random random(density.seed);
  double wanted = static_cast<double>(density.count);
  if (density.count == 0) {
    // Points with this least distance cannot be packed more densely than in a hexagonal grid.
    constexpr std::size_t kSurvey = 1000;
    const double disc = 0.5 * std::sqrt(3.0) * density.distance * density.distance;
    wanted = std::max(1.0, makeCandidates(sampler, density, kSurvey, random).area / disc);
  }
  if (!(wanted <= kMostPoints)) {
    throw levelset::ResourceLimit(
        fmt::format("{:.3g} points exceed the limit of {:.0g}; {}", wanted, kMostPoints,
                    density.count > 0 ? "give a smaller count" : "give a larger distance"));
  }
  constexpr double kNeighbours = 70,  // assumed number of neighbours of a candidate
      kBytesPerNeighbour = 16;
  levelset::requireMemory(
      wanted * kCandidatesPerPoint * (sizeof(SurfacePoint) + kNeighbours * kBytesPerNeighbour),
      density.maxMemory);
  const Candidates candidates = makeCandidates(
      sampler, density, static_cast<std::size_t>(wanted * kCandidatesPerPoint) + 50, random);
  levelset::report(density.progress, 0.7);
  ScatteredPoints result;
  double reach = 2 * density.distance;
  if (density.count == 0) {
    result.points = throwDarts(candidates.points, density.distance);
    result.wanted = result.points.size();
  } else {
    result.wanted = std::min(density.count, candidates.points.size());
    reach = 2 * std::sqrt(candidates.area / (2 * std::sqrt(3.0) * wanted));
    result.points = orderBySpread(candidates.points, reach, result.wanted);
  }
  result.distance =
      leastDistance(std::span(result.points).first(result.wanted), reach, 0.5 * reach);
  levelset::report(density.progress, 1);
  return result;
}

}  // namespace mapping
