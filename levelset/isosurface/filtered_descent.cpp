#include "levelset/isosurface/filtered_descent.h"

#include <algorithm>
#include <cmath>

namespace levelset {
namespace {

using openvdb::Mat3d;
using openvdb::Vec3d;

/// Solves the equations of a symmetric matrix of up to 4 × 4 by elimination with pivots.
/// @return false for a singular matrix
bool solveSmall(int n, std::array<std::array<double, 5>, 4>& m, std::array<double, 4>& x) {
  const auto count = static_cast<std::size_t>(n);
  for (std::size_t c = 0; c < count; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < count; ++r)
      if (std::abs(m[r][c]) > std::abs(m[pivot][c])) pivot = r;
    if (!(std::abs(m[pivot][c]) > 1e-300)) return false;
    std::swap(m[c], m[pivot]);
    for (std::size_t r = 0; r < count; ++r) {
      if (r == c) continue;
      const double f = m[r][c] / m[c][c];
      for (std::size_t k = c; k < count; ++k) m[r][k] -= f * m[c][k];
      m[r][4] -= f * m[c][4];
    }
  }
  for (std::size_t c = 0; c < count; ++c) x[c] = m[c][4] / m[c][c];
  return true;
}

}  // namespace

void FilteredSurface::Descent::evaluate(State& at) const {
  const VolumeDerivatives d = s_.volume_.derivatives({at.x[0], at.x[1], at.x[2]});
  const double factor = s_.limits_.sign[static_cast<std::size_t>(function_)] / s_.unit_;
  at.f = s_.functionAt(function_, d.value);
  for (int r = 0; r < 3; ++r) {
    at.g[r] = factor * d.gradient[r];
    for (int c = 0; c < 3; ++c) at.h(r, c) = factor * d.hessian[r][c];
  }
}

void FilteredSurface::Descent::move(State& at, const Vec3d& step) const {
  // The part of the step up to the border of the box; there, the coordinate becomes fixed.
  double part = 1;
  int blocked = -1;
  for (int axis = 0; axis < 3; ++axis) {
    if (at.fixed[static_cast<std::size_t>(axis)]) continue;
    const double to = at.x[axis] + step[axis];
    const double limit = to < 0 ? 0 : s_.last_[axis];
    if (to >= 0 && to <= s_.last_[axis]) continue;
    const double share = (limit - at.x[axis]) / step[axis];
    if (share >= part && blocked >= 0) continue;
    part = std::min(part, share);
    blocked = axis;
  }
  for (int axis = 0; axis < 3; ++axis)
    if (!at.fixed[static_cast<std::size_t>(axis)])
      at.x[axis] = std::clamp(at.x[axis] + part * step[axis], 0.0, s_.last_[axis]);
  if (blocked < 0) return;
  at.x[blocked] = step[blocked] < 0 ? 0 : s_.last_[blocked];
  at.fixed[static_cast<std::size_t>(blocked)] = true;
}

bool FilteredSurface::Descent::solve(const State& at, const Mat3d& a, const Vec3d& r, double f,
                                     Vec3d& d, double& multiplier) const {
  std::array<int, 3> axes{};
  int n = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (!at.fixed[static_cast<std::size_t>(axis)]) axes[static_cast<std::size_t>(n++)] = axis;
  d = Vec3d(0.0);
  if (n == 0) return false;
  std::array<std::array<double, 5>, 4> m{};
  for (int i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (int j = 0; j < n; ++j)
      m[row][static_cast<std::size_t>(j)] = a(axes[row], axes[static_cast<std::size_t>(j)]);
    m[row][static_cast<std::size_t>(n)] = m[static_cast<std::size_t>(n)][row] = at.g[axes[row]];
    m[row][4] = -r[axes[row]];
  }
  m[static_cast<std::size_t>(n)][4] = -f;
  std::array<double, 4> x{};
  if (!solveSmall(n + 1, m, x)) return false;
  for (int i = 0; i < n; ++i) d[axes[static_cast<std::size_t>(i)]] = x[static_cast<std::size_t>(i)];
  multiplier = x[static_cast<std::size_t>(n)];
  return std::isfinite(d.lengthSqr());
}

bool FilteredSurface::Descent::returnToSurface(State& at) const {
  for (int n = 0; n < kMostReturns; ++n) {
    evaluate(at);
    Vec3d step;
    double multiplier = 0;
    // The shortest step to the linear part's zero.
    if (!solve(at, s_.metric_, Vec3d(0.0), at.f, step, multiplier)) return false;
    const double length = std::sqrt(step.dot(s_.metric_ * step));
    if (length < kOnSurface) return true;
    const double largest = std::max({std::abs(step[0]), std::abs(step[1]), std::abs(step[2])});
    if (largest > kMostStep) step *= kMostStep / largest;
    move(at, step);
  }
  return false;
}

bool FilteredSurface::Descent::tangentStep(const State& at, Vec3d& step, double& multiplier) const {
  const Vec3d r = weighted(at);
  // The way to the closest point of the tangent plane, and the multiplier of the constraint.
  if (!solve(at, s_.metric_, r, 0, step, multiplier)) return false;
  Vec3d newton;
  double next = 0;
  const Mat3d lagrangian = s_.metric_ + multiplier * at.h;
  if (solve(at, lagrangian, r, 0, newton, next) && newton.dot(lagrangian * newton) > 0 &&
      newton.dot(r) < 0)
    step = newton;
  const double largest = std::max({std::abs(step[0]), std::abs(step[1]), std::abs(step[2])});
  if (largest > kMostStep) step *= kMostStep / largest;
  return true;
}

bool FilteredSurface::Descent::release(State& at, double multiplier) const {
  const Vec3d slope = weighted(at) + multiplier * at.g;
  int worst = -1;
  double most = 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    if (!at.fixed[static_cast<std::size_t>(axis)]) continue;
    const double inward = at.x[axis] <= 0 ? -slope[axis] : slope[axis];
    if (inward <= most) continue;
    most = inward;
    worst = axis;
  }
  if (worst < 0) return false;
  at.fixed[static_cast<std::size_t>(worst)] = false;
  return true;
}

bool FilteredSurface::Descent::fixOutward(State& at, const Vec3d& step) const {
  bool isAny = false;
  for (int axis = 0; axis < 3; ++axis) {
    bool& fixed = at.fixed[static_cast<std::size_t>(axis)];
    const bool isUpper = step[axis] > 0;
    const double limit = isUpper ? s_.last_[axis] : 0;
    if (fixed || step[axis] == 0 || std::abs(at.x[axis] - limit) > kAtBorder) continue;
    at.x[axis] = limit;
    fixed = isAny = true;
  }
  return isAny;
}

bool FilteredSurface::Descent::advance(State& at, Vec3d step, double& best, Vec3d& beyond) const {
  for (int half = 0; half < kMostHalvings; ++half, step *= 0.5) {
    State next = at;
    move(next, step);
    if (!returnToSurface(next)) continue;
    beyond = next.g;
    const double found = squared(next);
    if (!(found < best)) continue;
    at = next;
    best = found;
    return true;
  }
  return false;
}

bool FilteredSurface::Descent::creaseStep(const State& at, const Vec3d& beyond, Vec3d& step) const {
  if (at.fixed[0] || at.fixed[1] || at.fixed[2]) return false;
  const Vec3d along = at.g.cross(beyond);
  const double squaredLength = along.dot(s_.metric_ * along);
  constexpr double kLeastJump = 1e-6;  // part of the gradient
  if (!(along.length() > kLeastJump * at.g.length() * beyond.length())) return false;
  step = -(along.dot(weighted(at)) / squaredLength) * along;
  return step.dot(s_.metric_ * step) >= kConverged * kConverged;
}

std::optional<FilteredSurface::Foot> FilteredSurface::Descent::run(const Vec3d& start,
                                                                   const Foot* known) {
  State at;
  at.x = start;
  if (!returnToSurface(at)) return {};
  double best = squared(at);
  int releases = 0;
  bool isMinimum = false;
  for (int n = 0; n < kMostSteps; ++n) {
    if (known) {
      const Vec3d way = at.x - known->index;
      if (way.dot(s_.metric_ * way) < kSamePoint * kSamePoint) return {};
    }
    Vec3d step;
    double multiplier = 0;
    if (!tangentStep(at, step, multiplier)) break;
    // A step that begins on the border and leads outside has no length.
    if (fixOutward(at, step)) continue;
    bool isConverged = step.dot(s_.metric_ * step) < kConverged * kConverged;
    isMinimum = isConverged && !(at.fixed[0] || at.fixed[1] || at.fixed[2]);
    if (!isConverged) {
      Vec3d beyond(0.0);
      bool isNearer = advance(at, step, best, beyond);
      // The gradient jumps between the last two points, so that the closest point lies on the
      // crease between them. This step goes along the crease.
      if (!isNearer && hasCreases_ && creaseStep(at, beyond, step))
        isNearer = advance(at, step, best, beyond);
      isConverged = !isNearer;
    }
    if (isConverged && (releases++ >= kMostReleases || !release(at, multiplier))) break;
  }
  return Foot{at.x, best, isMinimum};
}

}  // namespace levelset
