#include "levelset/isosurface/filtered_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/volumes/filters/filter_weights.h"

namespace levelset {
namespace {

using openvdb::Mat3d;
using openvdb::Vec3d;

// Samples below and above a cell on which its values may depend.
constexpr int kReachBelow = 2, kReachAbove = 3, kReachCount = kReachBelow + kReachAbove + 1;
// Part of a border face that is searched as one, in cells.
constexpr double kFaceEdge = 0.5;
// Edges of the largest boxes that hold a piece, and of the smallest boxes, in cells.
constexpr double kLargestBox = 0.5, kSmallestBox = 0.0625;
// A box is split when the gradient may change in it by this part of itself.
constexpr double kMostChange = 0.5;
constexpr double kBytesPerFilteredPiece = 68 + 2 * 40.0;

FilterBounds boundsOf(VolumeFilter filter) {
  // The splines on tetrahedra: the weights of the values are known, and linear programs give the
  // least factors of the second derivatives (2, 1.5 and 3.25). The first has a reserve for the
  // jumps of its gradient.
  if (filter == VolumeFilter::SuperQuadratic) return {9.0 / 8, 3, true};
  if (filter == VolumeFilter::CubicC1) return {1, 1.5, true};
  if (filter == VolumeFilter::BccQuadratic) return {5.0 / 4, 3.25, true};
  double value = 0, curvature = 0;
  constexpr int kSteps = 256;
  for (int n = 0; n <= kSteps; ++n) {
    const FilterWeights axis =
        filterWeights(filter, 4 + static_cast<double>(n) / kSteps, 10, GridExtension::Quadratic);
    double sum = 0;
    for (const double w : axis.weight[0]) sum += std::abs(w);
    value = std::max(value, sum);
    // Weights of the second differences: twofold partial sums of the weights of the samples.
    double once = 0, twice = 0;
    sum = 0;
    for (const double w : axis.weight[2]) {
      once += w;
      twice += once;
      sum += std::abs(twice);
    }
    curvature = std::max(curvature, sum);
  }
  // The sums change by less than this between two steps.
  value += 0.001;
  curvature += 0.05;
  return {value * value * value, curvature * value * value};
}

/// Part of a triangle in which the linear interpolant of three values is positive.
double positiveShare(double a, double b, double c) {
  const int positive = (a > 0) + (b > 0) + (c > 0);
  if (positive == 0) return 0;
  if (positive == 3) return 1;
  if (positive == 2) return 1 - positiveShare(-a, -b, -c);
  if (b > 0) std::swap(a, b);
  if (c > 0) std::swap(a, c);
  return a * a / ((a - b) * (a - c));
}

/// Point of the parallelogram first + s u + t v, 0 ≤ s, t ≤ 1, that is closest to a position.
std::array<double, 2> closestOnParallelogram(const Vec3d& first, const Vec3d& u, const Vec3d& v,
                                             const Vec3d& position) {
  const Vec3d d = position - first;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), du = d.dot(u), dv = d.dot(v);
  const double determinant = uu * vv - uv * uv;
  const double s = (du * vv - dv * uv) / determinant, t = (dv * uu - du * uv) / determinant;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return {s, t};
  std::array<double, 2> best{};
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](double a, double b) {
    const double squared = (d - a * u - b * v).lengthSqr();
    if (squared >= least) return;
    least = squared;
    best = {a, b};
  };
  for (const double side : {0.0, 1.0}) {
    look(side, std::clamp((dv - side * uv) / vv, 0.0, 1.0));
    look(std::clamp((du - side * uv) / uu, 0.0, 1.0), side);
  }
  return best;
}

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

struct FilteredSurface::SlabOfPieces {
  std::vector<Piece> pieces;
  std::uint64_t cells = 0;
};

/// Search for a closest point of the zero set of one function, inside the box of the volume. All
/// iterates lie on the surface, and each is nearer than the one before. Coordinates at which the
/// surface leaves the box are fixed, and released where that brings the point nearer.
class FilteredSurface::Descent {
 public:
  Descent(const FilteredSurface& surface, int function, const Vec3d& target)
      : s_(surface),
        function_(function),
        target_(target),
        hasCreases_(factsOf(surface.volume_.filter()).continuity < 1) {}

  /// @param known  closest point of an earlier search, in which this one may end early; or null
  /// @return empty if the search does not reach the surface or ends at `known`
  std::optional<Foot> run(const Vec3d& start, const Foot* known);

 private:
  // Steps of Newton's method: tangential, to the surface, and halvings of a step.
  static constexpr int kMostSteps = 30, kMostReturns = 8, kMostHalvings = 8, kMostReleases = 4;
  static constexpr double kMostStep = 0.75;    // cells
  static constexpr double kConverged = 1e-6;   // voxels; the distance is off by its square
  static constexpr double kOnSurface = 1e-10;  // voxels
  static constexpr double kSamePoint = 0.05;   // voxels
  static constexpr double kAtBorder = 1e-11;   // cells; below it, a step ends by rounding

  struct State {
    Vec3d x;
    std::array<bool, 3> fixed{};
    double f = 0;
    Vec3d g;
    Mat3d h;
  };

  void evaluate(State& at) const;
  [[nodiscard]] bool returnToSurface(State& at) const;
  void move(State& at, const Vec3d& step) const;
  [[nodiscard]] Vec3d weighted(const State& at) const {  // metric times the way from the target
    return s_.metric_ * (at.x - target_);
  }
  [[nodiscard]] double squared(const State& at) const {
    const Vec3d d = at.x - target_;
    return d.dot(s_.metric_ * d);
  }
  /// Solves [A g; gᵀ 0] [d; μ] = [−r; −f] on the free coordinates.
  [[nodiscard]] bool solve(const State& at, const Mat3d& a, const Vec3d& r, double f, Vec3d& d,
                           double& multiplier) const;
  [[nodiscard]] bool tangentStep(const State& at, Vec3d& step, double& multiplier) const;
  /// Goes to the first nearer point of the surface among those of the step, halved repeatedly.
  /// @param beyond  becomes the gradient of the last point that was tried
  [[nodiscard]] bool advance(State& at, Vec3d step, double& best, Vec3d& beyond) const;
  [[nodiscard]] bool creaseStep(const State& at, const Vec3d& beyond, Vec3d& step) const;
  [[nodiscard]] bool release(State& at, double multiplier) const;
  /// Fixes coordinates on the border of which the step leads outside. @return true if there are any
  [[nodiscard]] bool fixOutward(State& at, const Vec3d& step) const;

  const FilteredSurface& s_;
  int function_;
  Vec3d target_;
  bool hasCreases_;  ///< the gradient jumps
};

void FilteredSurface::Descent::evaluate(State& at) const {
  const VolumeDerivatives d = s_.volume_.derivatives({at.x[0], at.x[1], at.x[2]});
  const double factor = s_.sign_[static_cast<std::size_t>(function_)] / s_.unit_;
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

FilteredSurface::FilteredSurface(const Volume& volume, VolumeFilter filter, const ValueRange& range,
                                 double voxelSize, double halfWidth, std::size_t maxMemory,
                                 const Progress& progress)
    : volume_(volume, filter),
      frame_(volume.grid(), voxelSize, halfWidth),
      metric_(frame_.axes * frame_.axes.transpose()),
      voxelSize_(voxelSize),
      unit_(volume.highest() - volume.lowest()),
      bounds_(boundsOf(filter)) {
  for (const auto& [limit, sign] : {std::pair(range.low, 1.0), std::pair(range.high, -1.0)}) {
    if (!limit) continue;
    limit_[static_cast<std::size_t>(functions_)] = *limit;
    sign_[static_cast<std::size_t>(functions_++)] = sign;
  }
  for (int axis = 0; axis < 3; ++axis) last_[axis] = volume.size()[axis] - 1;
  collectPieces(maxMemory, subProgress(progress, 0, 0.9));
  collectFaces();
  report_.pieces = pieces_.size();
  if (itemCount() > std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit("the surface has more than 4 billion pieces; crop the volume");
  tree_ = BoxTree(
      pieces_.size(),
      [&](std::uint32_t item, Vec3d& low, Vec3d& high) {
        Vec3d from, to;
        bound(item, from, to);
        low = openvdb::math::minComponent(low, from);
        high = openvdb::math::maxComponent(high, to);
      },
      [&](std::uint32_t item, int axis) {
        Vec3d from, to;
        bound(item, from, to);
        return from[axis] + to[axis];
      });
  levelset::report(progress, 1);
}

double FilteredSurface::depthAt(const Vec3d& index) const {
  const double value = valueAt(index);
  double depth = functionAt(0, value);
  for (int n = 1; n < functions_; ++n) depth = std::min(depth, functionAt(n, value));
  return depth;
}

void FilteredSurface::collectPieces(std::size_t maxMemory, const Progress& progress) {
  const int slabs = volume_.volume().size().z - 1;
  constexpr int kSlice = 16;
  std::vector<SlabOfPieces> slice(kSlice);
  for (int from = 0; from < slabs; from += kSlice) {
    const int count = std::min(kSlice, slabs - from);
    tbb::parallel_for(0, count, [&](int n) {
      slice[static_cast<std::size_t>(n)] = {};
      collectSlab(from + n, slice[static_cast<std::size_t>(n)]);
    });
    for (int n = 0; n < count; ++n) {
      const SlabOfPieces& slab = slice[static_cast<std::size_t>(n)];
      pieces_.insert(pieces_.end(), slab.pieces.begin(), slab.pieces.end());
      report_.cells += slab.cells;
    }
    requireMemory(static_cast<double>(pieces_.size()) * kBytesPerFilteredPiece, maxMemory);
    levelset::report(progress, static_cast<double>(from + count) / slabs);
  }
}

void FilteredSurface::collectSlab(int k, SlabOfPieces& out) const {
  const Imath::V3i size = volume_.volume().size();
  for (int j = 0; j + 1 < size.y; ++j)
    for (int i = 0; i + 1 < size.x; ++i)
      if (double curvature = 0; mayHoldSurface({i, j, k}, curvature))
        collectCell({i, j, k}, curvature, out);
}

bool FilteredSurface::mayHoldSurface(const Imath::V3i& cell, double& curvature) const {
  const Volume& volume = volume_.volume();
  const Imath::V3i size = volume.size();
  constexpr std::size_t kCount = kReachCount;
  std::array<double, kCount * kCount * kCount> sample{};  // x fastest
  const Imath::V3i first = cell - Imath::V3i(kReachBelow);
  bool isInner = true;
  for (int axis = 0; axis < 3; ++axis)
    isInner = isInner && first[axis] >= 0 && cell[axis] + kReachAbove < size[axis];
  if (isInner) {
    std::size_t at = 0;
    for (int k = 0; k < kReachCount; ++k)
      for (int j = 0; j < kReachCount; ++j, at += kCount)
        volume.storedRun(volume.index(first.x, first.y + j, first.z + k), {&sample[at], kCount});
    for (double& value : sample) value = volume.scale()(value);
  } else {
    const ExtendedGrid extended([&](int i, int j, int k) { return volume.at(i, j, k); },
                                {size.x, size.y, size.z}, GridExtension::Quadratic);
    std::size_t at = 0;
    for (int k = 0; k < kReachCount; ++k)
      for (int j = 0; j < kReachCount; ++j)
        for (int i = 0; i < kReachCount; ++i)
          sample[at++] = extended(first.x + i, first.y + j, first.z + k);
  }
  const auto [low, high] = std::minmax_element(sample.begin(), sample.end());
  const double middle = (*low + *high) / 2, half = bounds_.value * (*high - *low) / 2;
  bool may = false;
  for (int n = 0; n < functions_; ++n)
    may = may || std::abs(limit_[static_cast<std::size_t>(n)] - middle) <= half;
  if (!may) return false;

  double largest = 0;
  constexpr std::array<std::size_t, 3> kStride = {1, kCount, kCount * kCount};
  for (std::size_t at = 0; at < sample.size(); ++at)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = kStride[axis], place = at / step % kCount;
      if (place + 2 < kCount)
        largest =
            std::max(largest, std::abs(sample[at] - 2 * sample[at + step] + sample[at + 2 * step]));
      const std::size_t other = kStride[(axis + 1) % 3];
      if (bounds_.usesMixed && place + 1 < kCount && at / other % kCount + 1 < kCount)
        largest = std::max(largest, std::abs(sample[at] - sample[at + step] - sample[at + other] +
                                             sample[at + step + other]));
    }
  curvature = bounds_.curvature * largest / unit_;
  return true;
}

void FilteredSurface::collectCell(const Imath::V3i& cell, double curvature,
                                  SlabOfPieces& out) const {
  Box box{.first = Vec3d(cell.x, cell.y, cell.z)};
  for (std::size_t c = 0; c < 8; ++c) box.value[c] = valueAt(box.corner(c));
  const std::size_t before = out.pieces.size();
  for (int n = 0; n < functions_; ++n) collectBox(box, n, curvature, out);
  out.cells += out.pieces.size() > before;
}

void FilteredSurface::collectBox(const Box& box, int function, double curvature,
                                 SlabOfPieces& out) const {
  std::array<double, 8> f{};
  unsigned inside = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < 8; ++c) {
    f[c] = functionAt(function, box.value[c]);
    inside |= f[c] > 0 ? 1u << c : 0;
    least = std::min(least, std::abs(f[c]));
  }
  bool split = false;
  if (inside == 0 || inside == 255) {
    // The function differs from the trilinear interpolant of the corners by this at most.
    const double most = 3 * curvature * box.edge * box.edge / 8;
    if (least > most || box.edge <= kSmallestBox) return;
    split = true;
  } else if (box.edge > kLargestBox) {
    split = true;
  } else {
    // An edge of the box whose ends lie on different sides.
    for (std::size_t edge = 0; edge < 24; ++edge) {
      const std::size_t from = edge & 7, to = from ^ (std::size_t{1} << (edge >> 3));
      if (!(f[from] > 0) || f[to] > 0) continue;
      double slope = 0;
      const Piece piece = pieceIn(box, function, box.corner(from), box.corner(to), slope);
      split = box.edge > kSmallestBox && box.edge * curvature > kMostChange * slope;
      if (!split) out.pieces.push_back(piece);
      break;
    }
  }
  if (!split) return;
  std::array<double, 27> values{};
  for (std::size_t n = 0; n < 27; ++n) {
    const std::size_t x = n / 9, y = n / 3 % 3, z = n % 3;
    values[n] = x % 2 == 0 && y % 2 == 0 && z % 2 == 0
                    ? box.value[2 * x + y + z / 2]
                    : valueAt(box.first + box.edge / 2 *
                                              Vec3d(static_cast<double>(x), static_cast<double>(y),
                                                    static_cast<double>(z)));
  }
  for (std::size_t octant = 0; octant < 8; ++octant) {
    const std::size_t x = octant >> 2, y = octant >> 1 & 1, z = octant & 1;
    Box part{.first = box.first + box.edge / 2 * Box::offset(octant), .edge = box.edge / 2};
    for (std::size_t c = 0; c < 8; ++c)
      part.value[c] = values[(x + (c >> 2)) * 9 + (y + (c >> 1 & 1)) * 3 + z + (c & 1)];
    collectBox(part, function, curvature, out);
  }
}

FilteredSurface::Piece FilteredSurface::pieceIn(const Box& box, int function, const Vec3d& inside,
                                                const Vec3d& outside, double& slopeHere) const {
  // Bisection keeps a crossing between the two ends.
  Vec3d in = inside, out = outside;
  constexpr int kBisections = 12;
  for (int n = 0; n < kBisections; ++n) {
    const Vec3d middle = 0.5 * (in + out);
    (functionAt(function, valueAt(middle)) > 0 ? in : out) = middle;
  }
  const Vec3d start = 0.5 * (in + out);
  const VolumeDerivatives d = volume_.derivatives({start[0], start[1], start[2]});
  Piece piece;
  piece.function = function;
  piece.edge = static_cast<float>(box.edge);
  slopeHere = d.gradient.length() / unit_;
  // Gradient in the frame of the search, and the size of the second derivatives there.
  const Vec3d gradient = frame_.toIndex * Vec3d(d.gradient.x, d.gradient.y, d.gradient.z);
  Mat3d hessian;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) hessian(r, c) = d.hessian[r][c];
  hessian = frame_.toIndex * hessian * frame_.toIndex.transpose();
  double size = 0;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) size += hessian(r, c) * hessian(r, c);
  const double slope = gradient.length();
  double furthest = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3d corner = box.corner(c) - start;
    furthest = std::max(furthest, std::sqrt(corner.dot(metric_ * corner)));
  }
  // Twice the second-order term. It is an estimate, not a bound: third derivatives are left out.
  const double bend = slope > 0 ? std::sqrt(size) / slope * furthest * furthest : furthest;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    piece.first[n] = static_cast<float>(box.first[axis]);
    piece.start[n] = static_cast<float>(start[axis]);
    piece.normal[n] = slope > 0 ? static_cast<float>(gradient[axis] / slope) : 0;
  }
  piece.radius = static_cast<float>(furthest);
  piece.bend = static_cast<float>(std::min(bend, furthest));
  return piece;
}

void FilteredSurface::collectFaces() {
  const Imath::V3i size = volume_.volume().size();
  const auto row = [&](int axis) {
    return Vec3d(frame_.axes(axis, 0), frame_.axes(axis, 1), frame_.axes(axis, 2));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int countU = 2 * (size[u] - 1), countV = 2 * (size[v] - 1);
    const double area = row(u).cross(row(v)).length() * kFaceEdge * kFaceEdge;
    for (const double side : {0.0, last_[axis]}) {
      const auto place = [&](int a, int b) {
        Vec3d index;
        index[axis] = side;
        index[u] = kFaceEdge * a;
        index[v] = kFaceEdge * b;
        return index;
      };
      std::vector<double> depth(static_cast<std::size_t>((countU + 1) * (countV + 1)));
      tbb::parallel_for(0, countU + 1, [&](int a) {
        for (int b = 0; b <= countV; ++b)
          depth[static_cast<std::size_t>(a * (countV + 1) + b)] = depthAt(place(a, b));
      });
      for (int a = 0; a < countU; ++a)
        for (int b = 0; b < countV; ++b) {
          const auto at = [&](int p, int q) {
            return depth[static_cast<std::size_t>((a + p) * (countV + 1) + b + q)];
          };
          if (std::max({at(0, 0), at(0, 1), at(1, 0), at(1, 1)}) <= 0) continue;
          report_.closedArea += area / 2 *
                                (positiveShare(at(0, 0), at(0, 1), at(1, 0)) +
                                 positiveShare(at(1, 1), at(0, 1), at(1, 0)));
          Face face{};
          Vec3d low(std::numeric_limits<double>::max()), high = -low;
          for (int c = 0; c < 4; ++c) {
            const Vec3d p = frame_.place(place(a + (c >> 1), b + (c & 1)));
            low = openvdb::math::minComponent(low, p);
            high = openvdb::math::maxComponent(high, p);
          }
          for (int n = 0; n < 3; ++n) {
            face.low[static_cast<std::size_t>(n)] = static_cast<float>(low[n]);
            face.high[static_cast<std::size_t>(n)] = static_cast<float>(high[n]);
          }
          faces_.push_back(face);
        }
    }
  }
  report_.closedArea *= voxelSize_ * voxelSize_;
}

void FilteredSurface::bound(std::size_t item, Vec3d& low, Vec3d& high) const {
  if (item >= pieces_.size()) {
    const Face& face = faces_[item - pieces_.size()];
    low = Vec3d(face.low[0], face.low[1], face.low[2]);
    high = Vec3d(face.high[0], face.high[1], face.high[2]);
    return;
  }
  const Piece& piece = pieces_[item];
  low = Vec3d(std::numeric_limits<double>::max());
  high = -low;
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3d p = frame_.place(Vec3d(piece.first[0], piece.first[1], piece.first[2]) +
                                 static_cast<double>(piece.edge) * Box::offset(c));
    low = openvdb::math::minComponent(low, p);
    high = openvdb::math::maxComponent(high, p);
  }
}

double FilteredSurface::squaredBound(const Piece& piece, const Vec3d& position) const {
  Vec3d low, high;
  bound(static_cast<std::size_t>(&piece - pieces_.data()), low, high);
  double outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max({low[axis] - position[axis], position[axis] - high[axis], 0.0});
    outside += d * d;
  }
  // The piece lies in a ball, and between two planes parallel to the tangent plane.
  const Vec3d way = position - frame_.place(Vec3d(piece.start[0], piece.start[1], piece.start[2]));
  const Vec3d normal(piece.normal[0], piece.normal[1], piece.normal[2]);
  const double across = way.dot(normal);
  const double beside = std::sqrt(std::max(0.0, way.lengthSqr() - across * across));
  const double bend = static_cast<double>(piece.bend), radius = static_cast<double>(piece.radius);
  const double above = std::max(0.0, std::abs(across) - bend);
  const double aside = std::max(0.0, beside - radius);
  return std::max(outside, above * above + aside * aside);
}

double FilteredSurface::squaredToFaces(const Vec3d& position, double best) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto edge = [&](int n) {
      return last_[n] * Vec3d(frame_.axes(n, 0), frame_.axes(n, 1), frame_.axes(n, 2));
    };
    for (const double side : {0.0, last_[axis]}) {
      Vec3d index(0.0);
      index[axis] = side;
      const Vec3d first = frame_.place(index);
      const auto [s, t] = closestOnParallelogram(first, edge(u), edge(v), position);
      const double squared = (position - first - s * edge(u) - t * edge(v)).lengthSqr();
      if (squared >= best) continue;
      index[u] = s * last_[u];
      index[v] = t * last_[v];
      if (depthAt(index) > 0) best = squared;
    }
  }
  return best;
}

double FilteredSurface::distance(const Vec3d& position, double most, Hint& hint) const {
  // A piece that bends little has one closest point only.
  constexpr float kLittleBend = 0.2f;
  const Vec3d target = frame_.index(position);
  double best = squaredToFaces(position, most * most);
  std::optional<Foot> foot;
  int function = -1;
  const auto take = [&](const std::optional<Foot>& found, int of) {
    if (!found) return;
    // Also a distance that is not the least leads later searches, which need not go there again.
    if (!foot || found->squared < foot->squared) {
      foot = found;
      function = of;
    }
    best = std::min(best, found->squared);
  };
  if (hint.function >= 0)
    take(Descent(*this, hint.function, target).run(hint.index, nullptr), hint.function);
  tree_.search(position, best, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t n = begin; n < end; ++n) {
      const Piece& piece = pieces_[tree_.order()[n]];
      if (squaredBound(piece, position) >= best) continue;
      const bool bendsLittle = piece.bend < kLittleBend * piece.radius;
      const Foot* known =
          foot && foot->isMinimum && bendsLittle && function == piece.function ? &*foot : nullptr;
      if (known) {
        bool isHere = true;
        for (int axis = 0; axis < 3; ++axis) {
          const double low = static_cast<double>(piece.first[static_cast<std::size_t>(axis)]);
          isHere = isHere && known->index[axis] >= low &&
                   known->index[axis] <= low + static_cast<double>(piece.edge);
        }
        if (isHere) continue;
      }
      take(Descent(*this, piece.function, target)
               .run(Vec3d(piece.start[0], piece.start[1], piece.start[2]), known),
           piece.function);
    }
  });
  if (foot) hint = {function, foot->index};
  return std::sqrt(best);
}

bool FilteredSurface::isInside(const Vec3d& position) const {
  const Vec3d index = frame_.index(position);
  for (int axis = 0; axis < 3; ++axis)
    if (!(index[axis] >= 0 && index[axis] <= last_[axis])) return false;
  return depthAt(index) > 0;
}

}  // namespace levelset
