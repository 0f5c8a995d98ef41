#include <algorithm>
#include <cmath>
#include <deque>

#include "levelset/mesh_files/mesh_parts.h"

namespace levelset {
namespace {

using Imath::V2d;
using Imath::V3d;

/// Maximum number of corners of a polygon that becomes a fan. All triangles of a fan share one
/// corner, so their bounding boxes overlap there, which slows down searches in a large fan.
constexpr std::size_t kLargestFan = 16;
/// Maximum number of tests for ear clipping, corners × reflex corners (about two seconds). A
/// polygon that needs more becomes a fan if a fan fits, else it is refused.
constexpr double kMaxTests = 5e8;

double cross(const V2d& a, const V2d& b, const V2d& c) {
  return (b - a).cross(c - a);
}

/// Projects the corners along the coordinate axis nearest to the polygon's normal. The result runs
/// counter-clockwise.
std::vector<V2d> flatten(std::span<const std::uint32_t> corners,
                         const std::vector<V3d>& positions) {
  const V3d origin = positions[corners[0]];
  V3d normal(0);  // Newell's method: twice the area vector, also for non-planar polygons
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (positions[corners[i]] - origin).cross(positions[corners[i + 1]] - origin);
  int drop = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(normal[axis]) > std::abs(normal[drop])) drop = axis;
  int u = (drop + 1) % 3, v = (drop + 2) % 3;
  if (normal[drop] < 0) std::swap(u, v);
  std::vector<V2d> points;
  points.reserve(corners.size());
  for (const std::uint32_t corner : corners) {
    const V3d p = positions[corner] - origin;
    points.emplace_back(p[u], p[v]);
  }
  return points;
}

/// Returns true when no triangle of the fan from the first corner is clockwise, so that the fan
/// covers the counter-clockwise polygon without overlap.
bool fanFits(const std::vector<V2d>& points) {
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    if (cross(points[0], points[i], points[i + 1]) < 0) return false;
  return true;
}

/// Ear clipping with a queue of ears. Clipping an ear changes only its two neighbours and moves
/// them to the end of the queue. The ears are thus clipped all around the polygon, not at one
/// corner only.
class EarClipper {
 public:
  explicit EarClipper(const std::vector<V2d>& points)
      : points_(points),
        previous_(points.size()),
        next_(points.size()),
        state_(points.size()),
        turns_(points.size(), 0) {
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i) {
      previous_[i] = (i + n - 1) % n;
      next_[i] = (i + 1) % n;
    }
    for (std::size_t i = 0; i < n; ++i)
      if (turn(i) < 0) reflex_.push_back(i);
  }

  [[nodiscard]] bool isAffordable() const {
    return static_cast<double>(points_.size()) * static_cast<double>(reflex_.size()) <= kMaxTests;
  }

  /// Calls emit(a, b, c) for each triangle.
  template <typename Emit>
  void run(Emit emit) {
    std::size_t left = points_.size(), current = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) update(i);
    while (left > 3) {
      const std::size_t ear = nextEar(current);
      emit(previous_[ear], ear, next_[ear]);
      state_[ear] = State::Gone;
      next_[previous_[ear]] = next_[ear];
      previous_[next_[ear]] = previous_[ear];
      current = next_[ear];
      update(previous_[ear]);
      update(next_[ear]);
      --left;
    }
    emit(previous_[current], current, next_[current]);
  }

 private:
  enum class State : char { Plain, Ear, Gone };

  [[nodiscard]] double turn(std::size_t i) const {
    return cross(points_[previous_[i]], points_[i], points_[next_[i]]);
  }

  void update(std::size_t i) {
    state_[i] = isEar(i) ? State::Ear : State::Plain;
    if (state_[i] == State::Ear) ears_.push_back({i, ++turns_[i]});
  }

  [[nodiscard]] bool isEar(std::size_t i) const {
    const V2d &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
    if (!(cross(a, b, c) > 0)) return false;
    return std::none_of(reflex_.begin(), reflex_.end(), [&](std::size_t r) {
      const V2d& p = points_[r];
      if (state_[r] == State::Gone || p == a || p == b || p == c) return false;
      return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
    });
  }

  /// Takes the next ear. A polygon that crosses itself or has no area may have none; then any
  /// corner is taken.
  std::size_t nextEar(std::size_t current) {
    while (!ears_.empty()) {
      const auto [ear, turn] = ears_.front();
      ears_.pop_front();
      if (state_[ear] == State::Ear && turns_[ear] == turn) return ear;
    }
    return current;
  }

  const std::vector<V2d>& points_;
  std::vector<std::size_t> previous_, next_, reflex_;
  std::vector<State> state_;
  std::vector<std::uint32_t> turns_;  // for each corner, how often it was queued as an ear; older
                                      // queue entries of a corner are void
  std::deque<std::pair<std::size_t, std::uint32_t>> ears_;
};

}  // namespace

bool splitPolygon(std::span<const std::uint32_t> corners, const std::vector<V3d>& positions,
                  std::array<std::uint32_t, 3>* triangles) {
  const auto emit = [&](std::size_t a, std::size_t b, std::size_t c) {
    *triangles++ = {corners[a], corners[b], corners[c]};
  };
  const std::vector<V2d> points = flatten(corners, positions);
  const bool fits = fanFits(points);
  if (!fits || corners.size() > kLargestFan) {
    EarClipper clipper(points);
    if (clipper.isAffordable()) {
      clipper.run(emit);
      return true;
    }
    if (!fits) return false;
  }
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) emit(0, i, i + 1);
  return true;
}

}  // namespace levelset
