#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/perpendicular.h"
#include "levelset/molecules/ball_arcs.h"

// Volumes of the balls of a union within their cells of the power diagram, and connected pieces of
// its boundary.

namespace levelset {
namespace {

using Imath::V2d;
using Imath::V3d;

// Lines whose directions differ by less than this sine count as parallel.
constexpr double kParallel = 1e-12;

/// A half plane of points x with x · normal ≤ offset. `normal` has the length 1.
struct HalfPlane {
  V2d normal;
  double offset = 0;
};

/// The part of a line inside a disc around the origin and inside other half planes, as an interval
/// along the line.
double lengthOnLine(const std::vector<HalfPlane>& planes, std::size_t own, double discRadius) {
  const HalfPlane& line = planes[own];
  const V2d along(-line.normal.y, line.normal.x);
  const double half =
      std::sqrt(std::max(0.0, (discRadius - line.offset) * (discRadius + line.offset)));
  double low = -half, high = half;
  for (std::size_t n = 0; n < planes.size() && low < high; ++n) {
    if (n == own) continue;
    const HalfPlane& other = planes[n];
    // Both lines compute their common point from the same numbers, so that their parts fit.
    const HalfPlane &a = planes[std::min(n, own)], &b = planes[std::max(n, own)];
    const double sine = a.normal.x * b.normal.y - a.normal.y * b.normal.x;
    if (std::abs(sine) < kParallel) {
      const bool isSameSide = a.normal.dot(b.normal) > 0;
      if (!isSameSide ? -other.offset > line.offset
                      : std::tie(other.offset, n) < std::tie(line.offset, own))
        return 0;
      continue;
    }
    const V2d common((a.offset * b.normal.y - b.offset * a.normal.y) / sine,
                     (b.offset * a.normal.x - a.offset * b.normal.x) / sine);
    const double at = common.dot(along);
    if (other.normal.dot(along) > 0)
      high = std::min(high, at);
    else
      low = std::max(low, at);
  }
  return std::max(0.0, high - low);
}

/// The face between the cells of two balls, within the union.
struct CellFace {
  double area = 0;
  double height = 0;  ///< position of its plane, from the centre of the first ball to the second
};

/// Area of the part of the disc of two balls that is at least as far, by power, from all others.
CellFace faceBetween(const std::vector<Ball>& balls, const BallLists& overlaps, std::uint32_t first,
                     std::uint32_t second, std::vector<HalfPlane>& planes) {
  const Ball &a = balls[first], &b = balls[second];
  const V3d between = b.centre - a.centre;
  const double apart = between.length();
  CellFace face;
  face.height = (apart * apart + (a.radius - b.radius) * (a.radius + b.radius)) / (2 * apart);
  const double squared = (a.radius - face.height) * (a.radius + face.height);
  if (!(squared > 0)) return face;
  const double radius = std::sqrt(squared);
  const V3d axis = between / apart, centre = a.centre + axis * face.height;
  const V3d u = anyPerpendicular(axis), v = axis.cross(u);
  planes.clear();
  // A ball that cuts the disc meets both balls.
  for (const std::uint32_t* n = overlaps.begin(first); n != overlaps.end(first); ++n) {
    if (*n == second) continue;
    const Ball& c = balls[*n];
    const V3d from = c.centre - centre;
    const V2d flat(from.dot(u), from.dot(v));
    // The power of x from c is |from|² − r² − 2 x · flat + |x|², and that from a is |x|² − squared.
    const double constant = from.length2() - c.radius * c.radius + squared;
    const double length = flat.length();
    if (constant >= 2 * radius * length) continue;  // the line misses the disc
    if (constant <= -2 * radius * length) return face;
    planes.push_back({flat / length, constant / (2 * length)});
  }
  // Twice the area, by the border: pieces of lines here, and pieces of the circle below.
  double twice = 0;
  std::vector<std::pair<double, double>> covered;
  constexpr double kTurn = 2 * std::numbers::pi;
  for (std::size_t n = 0; n < planes.size(); ++n) {
    twice += planes[n].offset * lengthOnLine(planes, n, radius);
    const double half = std::acos(std::clamp(planes[n].offset / radius, -1.0, 1.0));
    double begin = std::atan2(planes[n].normal.y, planes[n].normal.x) - half;
    if (begin < 0) begin += kTurn;
    covered.emplace_back(begin, std::min(begin + 2 * half, kTurn));
    if (begin + 2 * half > kTurn) covered.emplace_back(0, begin + 2 * half - kTurn);
  }
  std::sort(covered.begin(), covered.end());
  double open = 0, reached = 0;
  for (const auto& [begin, end] : covered) {
    open += std::max(0.0, begin - reached);
    reached = std::max(reached, end);
  }
  open += std::max(0.0, kTurn - reached);
  face.area = std::max(0.0, (twice + squared * open) / 2);
  return face;
}

/// Ends of an arc as seen from one of its balls, with the exposed part on the left.
struct ArcEnds {
  V3d begin, end, middle;
  bool isClosed = false;
};

ArcEnds endsOf(const ExposedArc& arc, std::uint32_t ball) {
  const auto at = [&](double sine) {
    return arc.centre + (arc.u * arc.cosHalf + arc.v * sine) * arc.radius;
  };
  ArcEnds ends{at(-arc.sinHalf), at(arc.sinHalf), arc.centre + arc.u * arc.radius,
               arc.half >= std::numbers::pi};
  if (arc.first == ball) std::swap(ends.begin, ends.end);
  return ends;
}

/// Closed curves of arcs around the exposed faces of the sphere of a ball.
class SphereLoops {
 public:
  SphereLoops(const std::vector<Ball>& balls, std::uint32_t ball,
              const std::vector<ExposedArc>& arcs, const std::vector<std::uint32_t>& own)
      : balls_(balls), ball_(ball), arcs_(arcs) {
    std::vector<ArcEnds> ends;
    ends.reserve(own.size());
    for (const std::uint32_t n : own) ends.push_back(endsOf(arcs[n], ball));
    DisjointSets sets(own.size());
    for (std::uint32_t a = 0; a < own.size(); ++a) {
      if (ends[a].isClosed) continue;
      // The next arc begins where this one ends.
      std::uint32_t next = a;
      double least = std::numeric_limits<double>::infinity();
      for (std::uint32_t b = 0; b < own.size(); ++b) {
        const double gap = (ends[b].begin - ends[a].end).length2();
        if (ends[b].isClosed || gap >= least) continue;
        least = gap;
        next = b;
      }
      sets.join(a, next);
    }
    std::map<std::uint32_t, std::size_t> numbers;
    for (std::uint32_t a = 0; a < own.size(); ++a) {
      const auto [at, isNew] = numbers.try_emplace(sets.find(a), loops_.size());
      if (isNew) loops_.emplace_back();
      Loop& loop = loops_[at->second];
      if (loop.arcs.empty() || arcs[own[a]].half * arcs[own[a]].radius >
                                   arcs[loop.longest].half * arcs[loop.longest].radius) {
        loop.longest = own[a];
        loop.point = ends[a].middle;
      }
      loop.arcs.push_back(own[a]);
    }
  }

  /// Joins the arcs of each face.
  void join(DisjointSets& sets) const {
    for (const Loop& loop : loops_)
      for (const std::uint32_t arc : loop.arcs) sets.join(loop.arcs.front(), arc);
    const std::size_t count = loops_.size();
    if (count < 2) return;
    std::vector<char> isLeft(count * count, 0);  // point of loop b on the exposed side of loop a
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b)
        if (a != b) isLeft[a * count + b] = isOnExposedSide(loops_[a], loops_[b].point);
    // Two loops bound one face if each is on the exposed side of the other, and none separates
    // them.
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = a + 1; b < count; ++b) {
        bool isSame = isLeft[a * count + b] && isLeft[b * count + a];
        for (std::size_t c = 0; c < count && isSame; ++c)
          isSame = c == a || c == b || isLeft[c * count + a] == isLeft[c * count + b];
        if (isSame) sets.join(loops_[a].arcs.front(), loops_[b].arcs.front());
      }
  }

 private:
  struct Loop {
    std::vector<std::uint32_t> arcs;
    std::uint32_t longest = 0;
    V3d point;  ///< middle of the longest arc
  };

  /// The integral of the area of the exposed side of a loop. It is 4π less if the direction of
  /// −pole is on that side.
  [[nodiscard]] double areaIntegral(const Loop& loop, const V3d& pole) const {
    double sum = 0;
    V3d normal(0);
    for (const std::uint32_t arc : loop.arcs)
      addArc(balls_[ball_], ball_, arcs_[arc], pole, sum, normal);
    return sum / balls_[ball_].radius;
  }

  [[nodiscard]] bool isOnExposedSide(const Loop& loop, const V3d& point) const {
    const V3d& centre = balls_[ball_].centre;
    const ExposedArc& arc = arcs_[loop.longest];
    // The centre of the cap beyond an arc is on the other side.
    const V3d hidden = arc.first == ball_ ? -arc.w : arc.w;
    return areaIntegral(loop, (centre - point).normalized()) <
           areaIntegral(loop, hidden) - 2 * std::numbers::pi;
  }

  const std::vector<Ball>& balls_;
  std::uint32_t ball_;
  const std::vector<ExposedArc>& arcs_;
  std::vector<Loop> loops_;
};

}  // namespace

std::vector<double> powerVolumes(const std::vector<Ball>& balls, const BallLists& overlaps,
                                 const std::vector<double>& areas) {
  // The ball of the lower index computes the face of a pair.
  std::vector<std::vector<CellFace>> faces(balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t n) {
    const auto first = static_cast<std::uint32_t>(n);
    thread_local std::vector<HalfPlane> planes;
    for (const std::uint32_t* other = overlaps.begin(n); other != overlaps.end(n); ++other)
      if (*other > first) faces[n].push_back(faceBetween(balls, overlaps, first, *other, planes));
  });
  // A cell consists of cones from the centre of its ball to its part of the sphere and its faces.
  std::vector<double> volumes(balls.size());
  for (std::size_t n = 0; n < balls.size(); ++n) volumes[n] = balls[n].radius * areas[n] / 3;
  for (std::size_t n = 0; n < balls.size(); ++n) {
    std::size_t face = 0;
    for (const std::uint32_t* other = overlaps.begin(n); other != overlaps.end(n); ++other) {
      if (*other < n) continue;
      const auto& [area, height] = faces[n][face++];
      const double apart = (balls[*other].centre - balls[n].centre).length();
      volumes[n] += height * area / 3;
      volumes[*other] += (apart - height) * area / 3;
    }
  }
  return volumes;
}

std::vector<BallUnion::Boundary> boundariesOf(const std::vector<Ball>& balls,
                                              const std::vector<char>& isHidden,
                                              const BallLists& overlaps,
                                              const std::vector<ExposedArc>& arcs) {
  std::vector<std::vector<std::uint32_t>> arcsOf(balls.size());
  for (std::uint32_t n = 0; n < arcs.size(); ++n) {
    arcsOf[arcs[n].first].push_back(n);
    arcsOf[arcs[n].second].push_back(n);
  }
  DisjointSets sets(arcs.size());
  for (std::uint32_t n = 0; n < balls.size(); ++n)
    if (!arcsOf[n].empty()) SphereLoops(balls, n, arcs, arcsOf[n]).join(sets);
  std::map<std::uint32_t, std::size_t> numbers;
  std::vector<BallUnion::Boundary> boundaries;
  for (std::uint32_t n = 0; n < arcs.size(); ++n)
    if (numbers.try_emplace(sets.find(n), boundaries.size()).second) boundaries.emplace_back();
  for (std::uint32_t n = 0; n < balls.size(); ++n) {
    const Ball& ball = balls[n];
    if (arcsOf[n].empty()) {
      if (isHidden[n] || overlaps.begin(n) != overlaps.end(n)) continue;
      const double area = 4 * std::numbers::pi * ball.radius * ball.radius;
      boundaries.push_back({area, area * ball.radius / 3, {n}});
      continue;
    }
    const V3d pole = (ball.centre - balls[*overlaps.begin(n)].centre).normalized();
    std::map<std::size_t, std::pair<double, V3d>> parts;  // integrals by boundary
    for (const std::uint32_t arc : arcsOf[n]) {
      auto& [sum, normal] =
          parts.try_emplace(numbers.at(sets.find(arc)), 0.0, V3d(0)).first->second;
      addArc(ball, n, arcs[arc], pole, sum, normal);
    }
    for (const auto& [number, part] : parts) {
      BallUnion::Boundary& boundary = boundaries[number];
      const double area = part.first * ball.radius;
      boundary.area += area;
      boundary.volume += (ball.radius * area + ball.centre.dot(part.second)) / 3;
      boundary.balls.push_back(n);
    }
  }
  return boundaries;
}

}  // namespace levelset
