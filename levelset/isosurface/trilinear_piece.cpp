#include "levelset/isosurface/trilinear_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset::trilinear {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int kMostSteps = 24;
// Number of times that a bent piece is halved at most while it is searched.
constexpr int kRefinements = 10;
// The same for a piece that bends little.
constexpr int kPlainRefinements = 1;
// Off-diagonal elements below this share of the trace are rounding errors of a diagonal metric.
constexpr double kDiagonal = 1e-13;
// Largest number of steps that raise a lower bound of a distance, and the share by which the bound
// must exceed a distance, because of rounding.
constexpr int kBoundRounds = 5;
constexpr double kBoundMargin = 1e-9;

bool isDiagonal(const Mat3d& metric) {
  const double off = std::abs(metric(0, 1)) + std::abs(metric(0, 2)) + std::abs(metric(1, 2));
  return off <= kDiagonal * (metric(0, 0) + metric(1, 1) + metric(2, 2));
}

/// Search for the closest point of the zero set in the unit cube: Newton's method on the condition
/// grad |p − target|² + λ grad f = 0, f = 0. A coordinate that reaches a face of the cube is fixed
/// there, and released when the multiplier of the face shows that the distance falls inwards.
class Search {
 public:
  Search(const Cubic& f, const Mat3d& metric, const Mat3d& inverse, const Vec3d& target)
      : f_(f), metric_(metric), inverse_(inverse), target_(target) {}

  /// Returns true if the last search proved that no point of the surface in the cube is nearer: the
  /// distance falls in no direction, and the Lagrangian grows from the point to all others of the
  /// surface.
  [[nodiscard]] bool isGlobal() const { return isOptimal_ && (isConvex() || growsOnSurface()); }

  /// Returns the squared distance of the point that the search from `start` ends at; infinite if it
  /// ends off the surface.
  double from(const Vec3d& start) {
    p_ = start;
    fixed_ = {};
    hasMultiplier_ = isOptimal_ = false;
    int releases = 0;
    for (int step = 0; step < kMostSteps; ++step) {
      const int free = freeCount();
      if (free == 0) break;
      const double moved = free == 1 ? alongEdge() : newtonStep();
      if (moved < 0) break;  // no step is possible
      if (moved > 1e-9) continue;
      if (!release()) {
        isOptimal_ = true;
        break;
      }
      if (++releases > 4) break;
    }
    return result();
  }

 private:
  /// Returns true if the Hessian of the Lagrangian is positive definite in the cube, by diagonal
  /// dominance.
  [[nodiscard]] bool isConvex() const {
    const Vec3d most(std::max(std::abs(f_.c[4]), std::abs(f_.c[4] + f_.c[7])),
                     std::max(std::abs(f_.c[5]), std::abs(f_.c[5] + f_.c[7])),
                     std::max(std::abs(f_.c[6]), std::abs(f_.c[6] + f_.c[7])));
    std::array<double, 3> others{};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = a + 1; b < 3; ++b) {
        const auto x = static_cast<int>(a), y = static_cast<int>(b);
        const double share = (std::abs(metric_(x, y)) + std::abs(multiplier_) * most[x + y - 1]) /
                             std::sqrt(metric_(x, x) * metric_(y, y));
        others[a] += share;
        others[b] += share;
      }
    return *std::max_element(others.begin(), others.end()) < 1;
  }

  /// Returns true if the quadratic and the cubic term of the Lagrangian are positive on all vectors
  /// u from the point to other points of the surface in the cube. They are nearly tangent: f = 0
  /// there bounds their part along the normal by a multiple of u². All lengths are measured by the
  /// metric, which must be diagonal.
  [[nodiscard]] bool growsOnSurface() const {
    if (!isDiagonal(metric_)) return false;
    const Vec3d scale(std::sqrt(metric_(0, 0)), std::sqrt(metric_(1, 1)), std::sqrt(metric_(2, 2)));
    const Vec3d mixed = f_.mixed(p_);
    const double xy = mixed[0] / (scale[0] * scale[1]), xz = mixed[1] / (scale[0] * scale[2]),
                 yz = mixed[2] / (scale[1] * scale[2]);
    // The product of the three components of u is at most |u|³ / sqrt(27).
    const double cubic = std::abs(f_.c[7]) / (scale[0] * scale[1] * scale[2] * std::sqrt(27.0));
    Vec3d normal = f_.gradient(p_) / scale;
    const double slope = normal.length();
    if (!(slope > 0)) return false;
    normal /= slope;
    double squared = 0;  // of the distance to the farthest corner of the cube
    for (int axis = 0; axis < 3; ++axis) {
      const double across = scale[axis] * std::max(p_[axis], 1 - p_[axis]);
      squared += across * across;
    }
    const double reach = std::sqrt(squared);
    // The largest sum of a row bounds the second derivatives in all directions.
    const double second = std::max(
        {std::abs(xy) + std::abs(xz), std::abs(xy) + std::abs(yz), std::abs(xz) + std::abs(yz)});
    const double off = (second / 2 + cubic * reach) / slope * reach;  // share of u along the normal
    if (!(off < 1)) return false;
    const double m = multiplier_;
    const auto times = [&](const Vec3d& v) {  // the Hessian of the Lagrangian
      return Vec3d(v[0] + m * (xy * v[1] + xz * v[2]), v[1] + m * (xy * v[0] + yz * v[2]),
                   v[2] + m * (xz * v[0] + yz * v[1]));
    };
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (std::abs(normal[axis]) < std::abs(normal[least])) least = axis;
    Vec3d a(0.0);
    a[least] = 1;
    a = normal.cross(a);
    a /= a.length();
    const Vec3d b = normal.cross(a), ha = times(a), hb = times(b), hn = times(normal);
    const double aa = a.dot(ha), ab = a.dot(hb), bb = b.dot(hb);
    const double lowest = (aa + bb - std::sqrt((aa - bb) * (aa - bb) + 4 * ab * ab)) / 2;
    const double an = a.dot(hn), bn = b.dot(hn);
    const double coupling = std::sqrt(an * an + bn * bn), along = std::max(0.0, -normal.dot(hn));
    return lowest > 0 && lowest * (1 - off * off) - 2 * coupling * off - along * off * off -
                                 2 * std::abs(m) * cubic * reach >
                             0;
  }

  [[nodiscard]] int freeCount() const {
    return static_cast<int>(std::count(fixed_.begin(), fixed_.end(), false));
  }

  /// Squared distance if the point is on the surface, after a last projection along the gradient.
  double result() {
    for (int round = 0; round < 3; ++round) {
      const double value = f_.value(p_);
      Vec3d slope = f_.gradient(p_);
      for (int axis = 0; axis < 3; ++axis)
        if (fixed_[static_cast<std::size_t>(axis)]) slope[axis] = 0;
      const double squared = slope.lengthSqr();
      if (!(squared > 0)) break;
      const Vec3d moved = p_ - slope * (value / squared);
      for (int axis = 0; axis < 3; ++axis) p_[axis] = std::clamp(moved[axis], 0.0, 1.0);
    }
    const Vec3d slope = f_.gradient(p_);
    if (!(std::abs(f_.value(p_)) <= 1e-9 * (slope.length() + std::abs(f_.c[0]) * 1e-3)))
      return kInfinite;
    const Vec3d d = p_ - target_;
    return std::max(0.0, d.dot(metric_ * d));
  }

  /// Moves to the zero on the only free axis. @return length of the move; −1: there is no zero
  double alongEdge() {
    int axis = 0;
    while (fixed_[static_cast<std::size_t>(axis)]) ++axis;
    const double slope = f_.gradient(p_)[axis];
    const double at = p_[axis] - f_.value(p_) / slope;
    if (!(at >= -1e-12 && at <= 1 + 1e-12)) return -1;
    const double moved = std::abs(at - p_[axis]);
    p_[axis] = std::clamp(at, 0.0, 1.0);
    multiplier_ = -(metric_ * (p_ - target_))[axis] / slope;
    return moved;
  }

  /// One step on the free axes. @return its length; −1: the equations have no solution
  double newtonStep() {
    const Vec3d slope = f_.gradient(p_), pull = metric_ * (p_ - target_);
    const double value = f_.value(p_);
    // Index of the free axes.
    std::array<int, 3> axes{};
    int n = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (!fixed_[static_cast<std::size_t>(axis)]) axes[static_cast<std::size_t>(n++)] = axis;
    // First estimate of the multiplier, by least squares in the metric.
    if (!hasMultiplier_) {
      const Vec3d raised = inverse_ * slope;
      const double scale = slope.dot(raised);
      if (!(scale > 0)) return -1;
      multiplier_ = -raised.dot(pull) / scale;
      hasMultiplier_ = true;
    }
    const Vec3d mixed = f_.mixed(p_);
    const auto second = [&](int a, int b) {
      if (a == b) return 0.0;
      return mixed[a + b - 1];  // 0+1: xy, 0+2: xz, 1+2: yz
    };
    // Less of the curvature is used until the function has a minimum on the tangent plane.
    for (double share = 1;; share = share > 0.2 ? share / 2 : 0) {
      std::array<std::array<double, 3>, 3> h{};
      for (int a = 0; a < n; ++a)
        for (int b = 0; b < n; ++b) {
          const int x = axes[static_cast<std::size_t>(a)], y = axes[static_cast<std::size_t>(b)];
          h[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] =
              metric_(x, y) + share * multiplier_ * second(x, y);
        }
      std::array<double, 3> g{}, pulled{};
      for (int a = 0; a < n; ++a) {
        g[static_cast<std::size_t>(a)] = slope[axes[static_cast<std::size_t>(a)]];
        pulled[static_cast<std::size_t>(a)] = pull[axes[static_cast<std::size_t>(a)]];
      }
      std::array<double, 3> step{};
      double multiplier = 0;
      const bool isMinimum = n == 3 ? solve3(h, g, pulled, value, step, multiplier)
                                    : solve2(h, g, pulled, value, step, multiplier);
      if (!isMinimum) {
        if (share == 0) return -1;
        continue;
      }
      return advance(axes, n, step, multiplier);
    }
  }

  /// Solves for the step on a plane curve: one tangent direction.
  static bool solve2(const std::array<std::array<double, 3>, 3>& h, const std::array<double, 3>& g,
                     const std::array<double, 3>& pull, double value, std::array<double, 3>& step,
                     double& multiplier) {
    const double squared = g[0] * g[0] + g[1] * g[1];
    if (!(squared > 0)) return false;
    // A step to the tangent line, and one along it.
    const std::array<double, 2> normal = {-value * g[0] / squared, -value * g[1] / squared};
    const std::array<double, 2> tangent = {-g[1], g[0]};
    const std::array<double, 2> ht = {h[0][0] * tangent[0] + h[0][1] * tangent[1],
                                      h[1][0] * tangent[0] + h[1][1] * tangent[1]};
    const double bend = ht[0] * tangent[0] + ht[1] * tangent[1];
    if (!(bend > 1e-12 * squared * (std::abs(h[0][0]) + std::abs(h[1][1])))) return false;
    const double along =
        -(tangent[0] * pull[0] + tangent[1] * pull[1] + ht[0] * normal[0] + ht[1] * normal[1]) /
        bend;
    step = {normal[0] + along * tangent[0], normal[1] + along * tangent[1], 0};
    const double r0 = pull[0] + h[0][0] * step[0] + h[0][1] * step[1],
                 r1 = pull[1] + h[1][0] * step[0] + h[1][1] * step[1];
    multiplier = -(r0 * g[0] + r1 * g[1]) / squared;
    return true;
  }

  /// Solves for the step on a surface: two tangent directions.
  static bool solve3(const std::array<std::array<double, 3>, 3>& h, const std::array<double, 3>& g,
                     const std::array<double, 3>& pull, double value, std::array<double, 3>& step,
                     double& multiplier) {
    const Vec3d normal(g[0], g[1], g[2]);
    const double squared = normal.lengthSqr();
    if (!(squared > 0)) return false;
    const Mat3d m(h[0][0], h[0][1], h[0][2], h[1][0], h[1][1], h[1][2], h[2][0], h[2][1], h[2][2]);
    const Vec3d p(pull[0], pull[1], pull[2]), down = normal * (-value / squared);
    // Two directions in the tangent plane.
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (std::abs(normal[axis]) < std::abs(normal[least])) least = axis;
    Vec3d other(0, 0, 0);
    other[least] = 1;
    const Vec3d a = normal.cross(other) / std::sqrt(squared);
    const Vec3d b = normal.cross(a) / std::sqrt(squared);
    const Vec3d ma = m * a, mb = m * b;
    const double aa = a.dot(ma), ab = a.dot(mb), bb = b.dot(mb);
    const double determinant = aa * bb - ab * ab;
    if (!(aa > 0) || !(determinant > 1e-12 * aa * std::abs(bb))) return false;
    const Vec3d residual = p + m * down;
    const double ra = -a.dot(residual), rb = -b.dot(residual);
    const Vec3d moved =
        down + a * ((ra * bb - rb * ab) / determinant) + b * ((rb * aa - ra * ab) / determinant);
    step = {moved[0], moved[1], moved[2]};
    multiplier = -normal.dot(p + m * moved) / squared;
    return true;
  }

  /// Moves by a step, to the first face of the cube that it meets at most.
  double advance(const std::array<int, 3>& axes, int n, const std::array<double, 3>& step,
                 double multiplier) {
    double share = 1, length = 0;
    int blocking = -1;
    for (int a = 0; a < n; ++a) {
      const auto at = static_cast<std::size_t>(a);
      const double to = p_[axes[at]] + step[at];
      length = std::max(length, std::abs(step[at]));
      if (to >= 0 && to <= 1) continue;
      const double limit = to < 0 ? 0 : 1;
      const double part = (limit - p_[axes[at]]) / step[at];
      if (part < share) {
        share = part;
        blocking = a;
      }
    }
    if (!std::isfinite(length)) return -1;
    for (int a = 0; a < n; ++a) {
      const auto at = static_cast<std::size_t>(a);
      p_[axes[at]] = std::clamp(p_[axes[at]] + share * step[at], 0.0, 1.0);
    }
    multiplier_ = multiplier_ + share * (multiplier - multiplier_);
    if (blocking < 0) return length;
    const int axis = axes[static_cast<std::size_t>(blocking)];
    p_[axis] = p_[axis] < 0.5 ? 0 : 1;
    fixed_[static_cast<std::size_t>(axis)] = true;
    return std::max(length, 1e-6);
  }

  /// Releases the face whose multiplier shows that the distance falls inwards. @return false: none
  bool release() {
    const Vec3d slope = f_.gradient(p_), pull = metric_ * (p_ - target_);
    int axis = -1;
    double steepest = 1e-9 * (pull.length() + 1e-12);
    for (int a = 0; a < 3; ++a) {
      if (!fixed_[static_cast<std::size_t>(a)]) continue;
      const double rate = pull[a] + multiplier_ * slope[a];
      const double inwards = p_[a] < 0.5 ? -rate : rate;
      if (inwards > steepest) {
        steepest = inwards;
        axis = a;
      }
    }
    if (axis < 0) return false;
    fixed_[static_cast<std::size_t>(axis)] = false;
    return true;
  }

  const Cubic& f_;
  const Mat3d &metric_, &inverse_;
  Vec3d target_, p_;
  std::array<bool, 3> fixed_{};
  double multiplier_ = 0;
  bool hasMultiplier_ = false, isOptimal_ = false;
};

/// Bilinear function on the unit square.
double bilinear(const std::array<float, 4>& corner, double u, double v) {
  const double low = static_cast<double>(corner[0]) * (1 - v) + static_cast<double>(corner[1]) * v;
  const double high = static_cast<double>(corner[2]) * (1 - v) + static_cast<double>(corner[3]) * v;
  return low * (1 - u) + high * u;
}

/// Interval of t in [0, 1] in which a linear function with the values `at0` and `at1` is positive.
void limitToPositive(double at0, double at1, double& from, double& to) {
  if (at0 <= 0 && at1 <= 0) {
    to = from - 1;
  } else if (at0 <= 0) {
    from = std::max(from, at0 / (at0 - at1));
  } else if (at1 <= 0) {
    to = std::min(to, at0 / (at0 - at1));
  }
}

/// A cube in which the surface is searched.
struct Part {
  Cubic f;
  Mat3d metric, inverse;
  Vec3d target;
  double radius = 0;  ///< half of the longest diagonal
};

/// Points at which the surface crosses the edges of the cube.
struct Crossings {
  std::array<Vec3d, 12> points;
  std::size_t count = 0;

  explicit Crossings(const Cubic& f) {
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 4; ++side) {
        Vec3d p(0.0);
        p[(axis + 1) % 3] = side & 1;
        p[(axis + 2) % 3] = side >> 1;
        const double t = -f.value(p) / f.gradient(p)[axis];
        if (!(t >= 0 && t <= 1)) continue;
        p[axis] = t;
        points[count++] = p;
      }
  }
};

/// Searches from the points at which the surface crosses edges of the cube. They are points of the
/// surface in any case.
void searchFromEdges(const Part& part, Search& search, double& best) {
  const Crossings crossings(part.f);
  for (std::size_t n = 0; n < crossings.count; ++n) {
    const Vec3d d = crossings.points[n] - part.target;
    const double found = search.from(crossings.points[n]);
    best = std::min({best, d.dot(part.metric * d), found});
    if (std::isfinite(found) && search.isGlobal()) return;
  }
}

/// Searches the surface in a cube, and lowers the squared distance `best`. Unless a search proves
/// that its point is the closest one, octants are searched, too: at most `levels` times, and at
/// most `plain` times where the surface bends little. Skips octants that are too far away.
void refine(const Part& part, int levels, int plain, double& best) {
  Vec3d start;
  if (part.f.isFurther(part.metric, part.inverse, part.target, best, start)) return;
  Search search(part.f, part.metric, part.inverse, part.target);
  const double first = search.from(start);
  best = std::min(best, first);
  if (std::isfinite(first) && search.isGlobal()) return;
  const bool isBent = part.f.isBent() || part.f.isBentOnFace();
  if (levels == 0 || (!isBent && plain == 0)) return searchFromEdges(part, search, best);
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3d low(octant >> 2, octant >> 1 & 1, octant & 1);
    const Vec3d away = (low + Vec3d(0.5)) / 2 - part.target;
    const double nearest = std::sqrt(away.dot(part.metric * away)) - part.radius / 2;
    if (nearest > 0 && nearest * nearest >= best) continue;
    std::array<double, 8> corner{};
    int positive = 0;
    for (int n = 0; n < 8; ++n) {
      const double value = part.f.value((low + Vec3d(n >> 2, n >> 1 & 1, n & 1)) / 2);
      corner[static_cast<std::size_t>(n)] = value;
      positive += value > 0;
    }
    if (positive == 0 || positive == 8) continue;
    refine({Cubic(corner), part.metric * 0.25, part.inverse * 4.0, part.target * 2.0 - low,
            part.radius / 2},
           levels - 1, isBent ? plain : plain - 1, best);
  }
}

}  // namespace

Cubic::Cubic(const std::array<float, 8>& corner)
    : Cubic(std::array<double, 8>{static_cast<double>(corner[0]), static_cast<double>(corner[1]),
                                  static_cast<double>(corner[2]), static_cast<double>(corner[3]),
                                  static_cast<double>(corner[4]), static_cast<double>(corner[5]),
                                  static_cast<double>(corner[6]), static_cast<double>(corner[7])}) {
}

Cubic::Cubic(const std::array<double, 8>& v) {
  c[0] = v[0];
  c[1] = v[4] - v[0];
  c[2] = v[2] - v[0];
  c[3] = v[1] - v[0];
  c[4] = v[6] - v[4] - v[2] + v[0];
  c[5] = v[5] - v[4] - v[1] + v[0];
  c[6] = v[3] - v[2] - v[1] + v[0];
  c[7] = v[7] - v[6] - v[5] - v[3] + v[4] + v[2] + v[1] - v[0];
}

bool Cubic::isBent() const {
  return bend() > kMostBend * gradient(Vec3d(0.5)).length();
}

bool Cubic::isBentOnFace() const {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {0.0, 1.0}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Vec3d center(0.5);
      center[axis] = side;
      const Vec3d slope = gradient(center);
      const double mixedTerm = std::abs(mixed(center)[u + v - 1]) / 4;
      // The function on the face differs from its value at the centre by at most this.
      if (std::abs(value(center)) > (std::abs(slope[u]) + std::abs(slope[v])) / 2 + mixedTerm)
        continue;
      if (mixedTerm > kMostBend * std::hypot(slope[u], slope[v])) return true;
    }
  return false;
}

bool Cubic::isFurther(const Mat3d& metric, const Mat3d& inverse, const Vec3d& target,
                      double squared, Vec3d& start) const {
  const Vec3d center(0.5), slope = gradient(center);
  const double bent = bend();
  const double atTarget = value(center) + slope.dot(target - center);
  const double between = std::abs(atTarget) - bent;
  if (between > 0 && between * between > squared * slope.dot(inverse * slope)) return true;
  for (int axis = 0; axis < 3; ++axis) start[axis] = std::clamp(target[axis], 0.0, 1.0);
  if (!isDiagonal(metric)) return false;
  // The distance to the part of the slab in the cube has a lower bound for each multiplier of the
  // slab's plane: the minimum of the Lagrangian over the cube. With a diagonal metric the minimum
  // is known. Newton's method finds the largest bound, which is piecewise quadratic.
  const double sign = atTarget + slope.dot(start - target) > 0 ? 1 : -1;
  double multiplier = 0;
  for (int round = 0; round < kBoundRounds; ++round) {
    double linear = atTarget, distance = 0, rate = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double wanted = target[axis] - sign * multiplier * slope[axis] / metric(axis, axis);
      start[axis] = std::clamp(wanted, 0.0, 1.0);
      const double moved = start[axis] - target[axis];
      linear += slope[axis] * moved;
      distance += metric(axis, axis) * moved * moved;
      if (wanted == start[axis]) rate += slope[axis] * slope[axis] / metric(axis, axis);
    }
    const double excess = sign * linear - bent;
    if (distance + 2 * multiplier * excess > squared * (1 + kBoundMargin)) return true;
    if (!(rate > 0)) return false;
    if (excess > 0) {
      multiplier += excess / rate;
      continue;
    }
    // From the face of the slab to the plane in its middle.
    multiplier += sign * linear / rate;
    for (int axis = 0; axis < 3; ++axis)
      start[axis] =
          std::clamp(target[axis] - sign * multiplier * slope[axis] / metric(axis, axis), 0.0, 1.0);
    return false;
  }
  return false;
}

double Cubic::bend() const {
  const Vec3d second = mixed(Vec3d(0.5));
  return 0.25 * (std::abs(second[0]) + std::abs(second[1]) + std::abs(second[2])) +
         0.125 * std::abs(c[7]);
}

double squaredDistance(const Cubic& f, const Mat3d& metric, const Mat3d& inverse,
                       const Vec3d& target, double most) {
  double longest = 0;
  for (const Vec3d& diagonal : {Vec3d(1, 1, 1), Vec3d(-1, 1, 1), Vec3d(1, -1, 1), Vec3d(1, 1, -1)})
    longest = std::max(longest, diagonal.dot(metric * diagonal));
  double best = most;
  refine({f, metric, inverse, target, std::sqrt(longest) / 2}, kRefinements, kPlainRefinements,
         best);
  return best;
}

double squaredDistance(const BorderFace& face, const Vec3d& from) {
  const auto covers = [&](double u, double v) {
    for (int n = 0; n < face.functions; ++n)
      if (!(bilinear(face.corner[static_cast<std::size_t>(n)], u, v) > 0)) return false;
    return true;
  };
  const double uu = face.u.dot(face.u), uv = face.u.dot(face.v), vv = face.v.dot(face.v);
  const Vec3d offset = from - face.first;
  const double pu = offset.dot(face.u), pv = offset.dot(face.v);
  const double determinant = uu * vv - uv * uv;
  const double u = (pu * vv - pv * uv) / determinant, v = (pv * uu - pu * uv) / determinant;
  const auto squaredTo = [&](double s, double t) {
    return (offset - face.u * s - face.v * t).lengthSqr();
  };
  if (u >= 0 && u <= 1 && v >= 0 && v <= 1 && covers(u, v)) return squaredTo(u, v);
  // The closest point lies on the rim of the covered part: a zero curve of a function, which
  // belongs to a piece, or the covered part of an edge.
  double best = kInfinite;
  for (int edge = 0; edge < 4; ++edge) {
    const bool alongU = edge < 2;
    const double other = edge & 1;
    double low = 0, high = 1;
    for (int n = 0; n < face.functions; ++n) {
      const auto& corner = face.corner[static_cast<std::size_t>(n)];
      limitToPositive(alongU ? bilinear(corner, 0, other) : bilinear(corner, other, 0),
                      alongU ? bilinear(corner, 1, other) : bilinear(corner, other, 1), low, high);
    }
    if (low > high) continue;
    const double t =
        std::clamp(alongU ? (pu - other * uv) / uu : (pv - other * uv) / vv, low, high);
    best = std::min(best, alongU ? squaredTo(t, other) : squaredTo(other, t));
  }
  return best;
}

double coveredArea(const BorderFace& face) {
  constexpr int kSlices = 16;
  double covered = 0;
  for (int slice = 0; slice < kSlices; ++slice) {
    const double u = (slice + 0.5) / kSlices;
    double low = 0, high = 1;
    for (int n = 0; n < face.functions; ++n) {
      const auto& corner = face.corner[static_cast<std::size_t>(n)];
      limitToPositive(bilinear(corner, u, 0), bilinear(corner, u, 1), low, high);
    }
    covered += std::max(0.0, high - low) / kSlices;
  }
  return covered * face.u.cross(face.v).length();
}

}  // namespace levelset::trilinear
