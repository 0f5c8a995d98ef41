#include "levelset/molecules/ball_arcs.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "levelset/error.h"
#include "levelset/geometry/gauss_rule.h"
#include "levelset/geometry/perpendicular.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using Imath::V3d;

// Shorter arcs are left out, radians. They change distances by less than rounding errors.
constexpr double kLeastArc = 1e-10;
constexpr std::size_t kNodes = 16;  // nodes of the quadrature along a piece of an arc
// A point this far inside another ball, as a share of its radius, counts as on the sphere.
constexpr double kOnSphere = 1e-11;

/// Balls of similar radius, by the cells of a grid. Cells are as large as the largest diameter, so
/// that two balls that meet lie in neighbouring cells.
class BallGrid {
 public:
  BallGrid(const std::vector<Ball>& balls, int level)
      : balls_(balls), cell_(std::ldexp(4.0, level)) {}

  void add(std::uint32_t ball) { cells_[key(cellOf(balls_[ball].centre))].push_back(ball); }

  /// Calls back with the balls that meet a ball of at most the same level, and some more.
  template <class Callback>
  void near(const V3d& centre, const Callback& callback) const {
    const auto at = cellOf(centre);
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const auto found = cells_.find(key({at[0] + i, at[1] + j, at[2] + k}));
          if (found == cells_.end()) continue;
          for (const std::uint32_t ball : found->second) callback(ball);
        }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  [[nodiscard]] Cell cellOf(const V3d& p) const {
    Cell cell;
    for (int c = 0; c < 3; ++c)
      cell[static_cast<std::size_t>(c)] =
          static_cast<std::int64_t>(std::clamp(std::floor(p[c] / cell_), -9e15, 9e15));
    return cell;
  }
  // Cells may share a key. All pairs are tested, and those found twice are removed.
  static std::uint64_t key(const Cell& cell) {
    std::uint64_t mixed = 0;
    for (const std::int64_t c : cell) {
      mixed = (mixed + static_cast<std::uint64_t>(c)) * 0x9e3779b97f4a7c15ULL;
      mixed ^= mixed >> 29;
    }
    return mixed;
  }

  const std::vector<Ball>& balls_;
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Position of the plane in which two spheres meet, from the centre of the first towards the
/// second.
double planeOf(const Ball& a, const Ball& b, double apart) {
  return (apart * apart + (a.radius - b.radius) * (a.radius + b.radius)) / (2 * apart);
}

/// Square of the radius of the circle in which two spheres meet. Rounding may leave none for balls
/// that nearly touch.
double circleSquared(const Ball& a, double plane) {
  return (a.radius - plane) * (a.radius + plane);
}

/// Marks balls at the place of a larger one, or of an equal one before them. There may be many.
void hideCoincident(const std::vector<Ball>& balls, std::vector<char>& isHidden) {
  std::vector<std::uint32_t> order(balls.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t n) {
    const Ball& ball = balls[n];
    return std::tuple(ball.centre.x, ball.centre.y, ball.centre.z, -ball.radius, n);
  };
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
  for (std::size_t n = 1; n < order.size(); ++n)
    isHidden[order[n]] = balls[order[n]].centre == balls[order[n - 1]].centre;
}

BallLists listsOf(std::vector<std::vector<std::uint32_t>>& lists) {
  BallLists result;
  result.first.assign(1, 0);
  for (auto& list : lists) {
    result.items.insert(result.items.end(), list.begin(), list.end());
    result.first.push_back(result.items.size());
    list = {};
  }
  return result;
}

/// Arcs of the circle in which two balls meet that no third ball covers.
void addArcs(const std::vector<Ball>& balls, const BallLists& overlaps, std::uint32_t first,
             std::uint32_t second, std::vector<ExposedArc>& arcs,
             std::vector<std::pair<double, double>>& covered) {
  const Ball &a = balls[first], &b = balls[second];
  const V3d between = b.centre - a.centre;
  const double apart = between.length(), plane = planeOf(a, b, apart);
  const double squared = circleSquared(a, plane);
  ExposedArc arc;
  arc.first = first;
  arc.second = second;
  arc.radius = std::sqrt(squared);
  arc.w = between / apart;
  arc.centre = a.centre + arc.w * plane;
  const V3d u = anyPerpendicular(arc.w), v = arc.w.cross(u);
  covered.clear();
  // A ball that covers a part of the circle meets both balls.
  for (const std::uint32_t* n = overlaps.begin(first); n != overlaps.end(first); ++n) {
    if (*n == second) continue;
    const Ball& c = balls[*n];
    const V3d from = c.centre - arc.centre;
    const double along = from.dot(u), aside = from.dot(v);
    // The ball holds the point at the angle t if constant < amplitude · cos(t − middle).
    const double constant = from.length2() + squared - c.radius * c.radius;
    const double amplitude = 2 * arc.radius * std::sqrt(along * along + aside * aside);
    if (constant >= amplitude) continue;
    if (constant <= -amplitude) return;
    const double middle = std::atan2(aside, along), half = std::acos(constant / amplitude);
    double begin = middle - half;
    if (begin < 0) begin += 2 * std::numbers::pi;
    const double end = begin + 2 * half;
    covered.emplace_back(begin, std::min(end, 2 * std::numbers::pi));
    if (end > 2 * std::numbers::pi) covered.emplace_back(0, end - 2 * std::numbers::pi);
  }
  const auto add = [&](double begin, double end) {
    if (end - begin < kLeastArc) return;
    const double middle = (begin + end) / 2, cosine = std::cos(middle), sine = std::sin(middle);
    arc.u = u * cosine + v * sine;
    arc.v = v * cosine - u * sine;
    arc.half = std::min((end - begin) / 2, std::numbers::pi);
    arc.cosHalf = std::cos(arc.half);
    arc.sinHalf = std::sin(arc.half);
    arcs.push_back(arc);
  };
  if (covered.empty()) return add(0, 2 * std::numbers::pi);
  std::sort(covered.begin(), covered.end());
  // From the end of a covered part to the begin of the next one, around the circle.
  double reached = covered.front().second;
  for (const auto& [begin, end] : covered) {
    if (begin > reached) add(reached, begin);
    reached = std::max(reached, end);
  }
  add(reached, covered.front().first + 2 * std::numbers::pi);
}

}  // namespace

BallLists overlapsOf(const std::vector<Ball>& balls, std::vector<char>& isHidden,
                     std::size_t maxBytes, const Progress& progress) {
  isHidden.assign(balls.size(), 0);
  hideCoincident(balls, isHidden);
  // Grids by the power of two of the radius. A ball looks in its own grid and those of larger
  // balls.
  std::unordered_map<int, BallGrid> grids;
  for (std::uint32_t n = 0; n < balls.size(); ++n) {
    if (isHidden[n]) continue;
    const int level = std::ilogb(balls[n].radius);
    grids.try_emplace(level, balls, level).first->second.add(n);
  }
  std::vector<std::vector<std::uint32_t>> lists(balls.size());
  std::vector<char> isInside(balls.size(), 0);
  std::atomic<std::size_t> count = 0;
  ProgressGate gate(progress, balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t n) {
    if (isHidden[n]) return;
    const Ball& ball = balls[n];
    const int own = std::ilogb(ball.radius);
    for (const auto& [level, grid] : grids) {
      if (level < own) continue;
      grid.near(ball.centre, [&](std::uint32_t other) {
        if (other == n) return;
        const Ball& b = balls[other];
        const double apart = (b.centre - ball.centre).length();
        if (apart >= ball.radius + b.radius) return;
        if (apart + ball.radius <= b.radius && (b.radius > ball.radius || other < n))
          isInside[n] = 1;
        lists[n].push_back(other);
      });
    }
    count += lists[n].size();
    const double bytes = 16.0 * static_cast<double>(count);
    if (bytes > static_cast<double>(maxBytes))
      throw ResourceLimit(
          fmt::format("the pairs of balls that meet need over {:.3g} GB; many of the {} balls lie "
                      "in one place, so remove some",
                      1e-9 * bytes, balls.size()));
    gate.advance(1);
  });
  for (std::size_t n = 0; n < balls.size(); ++n) isHidden[n] = isHidden[n] || isInside[n];
  // Smaller balls have found larger ones, but not the other way round.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> reverse;
  for (std::uint32_t n = 0; n < lists.size(); ++n)
    for (const std::uint32_t other : lists[n])
      if (std::ilogb(balls[other].radius) > std::ilogb(balls[n].radius))
        reverse.emplace_back(other, n);
  for (const auto& [large, small] : reverse) lists[large].push_back(small);
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t n) {
    auto& list = lists[n];
    if (isHidden[n]) list.clear();
    std::erase_if(list, [&](std::uint32_t other) { return isHidden[other] != 0; });
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    // The cosine of the covered cap, smallest first.
    std::vector<std::pair<double, std::uint32_t>> order;
    for (const std::uint32_t other : list) {
      // Both balls get the same answer, since the lower index comes first.
      const std::size_t first = std::min<std::size_t>(n, other);
      const std::size_t second = std::max<std::size_t>(n, other);
      const double apart = (balls[second].centre - balls[first].centre).length();
      const double common = planeOf(balls[first], balls[second], apart);
      if (!(circleSquared(balls[first], common) > 0)) continue;
      order.emplace_back(first == n ? common : apart - common, other);
    }
    std::sort(order.begin(), order.end());
    list.clear();
    for (const auto& [plane, other] : order) list.push_back(other);
  });
  return listsOf(lists);
}

std::vector<ExposedArc> exposedArcs(const std::vector<Ball>& balls, const BallLists& overlaps,
                                    std::size_t maxBytes, const Progress& progress) {
  std::vector<std::vector<ExposedArc>> lists(balls.size());
  std::atomic<std::size_t> count = 0;
  ProgressGate gate(progress, balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t n) {
    const auto first = static_cast<std::uint32_t>(n);
    thread_local std::vector<std::pair<double, double>> covered;
    for (const std::uint32_t* other = overlaps.begin(n); other != overlaps.end(n); ++other)
      if (*other > first) addArcs(balls, overlaps, first, *other, lists[n], covered);
    count += lists[n].size();
    requireMemory(2.0 * sizeof(ExposedArc) * static_cast<double>(count), maxBytes);
    gate.advance(1);
  });
  std::vector<ExposedArc> arcs;
  arcs.reserve(count);
  for (auto& list : lists) {
    arcs.insert(arcs.end(), list.begin(), list.end());
    list = {};
  }
  return arcs;
}

bool isCovered(const std::vector<Ball>& balls, const BallLists& overlaps, std::uint32_t ball,
               const V3d& point) {
  for (const std::uint32_t* n = overlaps.begin(ball); n != overlaps.end(ball); ++n) {
    const double radius = balls[*n].radius * (1 - kOnSphere);
    if ((point - balls[*n].centre).length2() < radius * radius) return true;
  }
  return false;
}

void addArc(const Ball& own, std::uint32_t ball, const ExposedArc& arc, const V3d& pole,
            double& sum, V3d& normal) {
  // Area of a region of the unit sphere: the integral of (x dy − y dx) / (1 + z) along its border,
  // if −z is outside the region.
  const V3d across = anyPerpendicular(pole), other = pole.cross(across);
  static const GaussRule<kNodes> rule;
  // The exposed part is on the left of the border: beyond the circle, as seen from this ball.
  const double sense = arc.first == ball ? -1 : 1;
  const auto pieces = static_cast<int>(std::ceil(arc.half / 0.5));
  const double width = arc.half / pieces;
  for (int n = 0; n < pieces; ++n) {
    const double middle = (2 * n + 1) * width - arc.half;
    for (std::size_t k = 0; k < kNodes; ++k) {
      const double t = middle + width * (2 * rule.at[k] - 1);
      const double scale = 2 * sense * width * rule.weight[k];
      const V3d radial = arc.u * std::cos(t) + arc.v * std::sin(t);
      const V3d at = arc.centre - own.centre + radial * arc.radius;
      const V3d step = arc.w.cross(radial) * (arc.radius * scale);
      const double x = at.dot(across), y = at.dot(other), z = at.dot(pole);
      // Beside a tiny cap, radius + z cancels.
      const double below = z < 0 ? (x * x + y * y) / (own.radius - z) : own.radius + z;
      sum += (x * step.dot(other) - y * step.dot(across)) / below;
      normal += at.cross(step) * 0.5;
    }
  }
}

ExposedPart exposedPart(const std::vector<Ball>& balls, const BallLists& overlaps,
                        std::uint32_t ball, const std::vector<const ExposedArc*>& arcs) {
  const Ball& own = balls[ball];
  ExposedPart part;
  if (arcs.empty()) {
    if (overlaps.begin(ball) == overlaps.end(ball))
      part.area = 4 * std::numbers::pi * own.radius * own.radius;
    return part;
  }
  // The centre of the largest cap is not exposed.
  const V3d pole = (own.centre - balls[*overlaps.begin(ball)].centre).normalized();
  double sum = 0;
  V3d normal(0);
  for (const ExposedArc* arc : arcs) addArc(own, ball, *arc, pole, sum, normal);
  part.area = std::clamp(sum * own.radius, 0.0, 4 * std::numbers::pi * own.radius * own.radius);
  part.normal = normal;
  return part;
}

}  // namespace levelset
