#include "render/bezier/tree_node.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace render {
namespace {

using Imath::V3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Rounding error of a component after all halvings, as a share of its largest magnitude.
constexpr double kNodeRounding = 2e-15;
// Below this ratio of the determinant to the lengths of its rows the Jacobian counts as singular.
constexpr double kLeastDeterminant = 1e-11;
// Roots lie outside the hull of the control points by this share of the range of depths at most:
// degree 20, three axes, and a last step of Newton's method of 1e-8 of the edge. The second number
// is the rounding error, as a share of the largest depth.
constexpr double kRootReach = 2e-6, kDepthRounding = 2e-13;
// Above this ratio of the weights of a node there is no such bound.
constexpr double kMostDepthRatio = 1e5;

constexpr std::size_t kMostOrder = levelset::kMostDegree + 1;

/// Bernstein polynomials of one degree and their derivatives at a parameter.
/// @tparam Order  degree + 1, or 0 if it is known at run time only
template <int Order>
struct BernsteinRow {
  std::array<double, Order ? Order : kMostOrder> value, slope;

  BernsteinRow(int degree, double t) {
    const auto p = static_cast<std::size_t>(Order ? Order - 1 : degree);
    value[0] = 1;
    for (std::size_t order = 1; order < p; ++order) raise(order, t);
    double before = 0;
    for (std::size_t i = 0; i < p; ++i) {
      slope[i] = static_cast<double>(p) * (before - value[i]);
      before = value[i];
    }
    slope[p] = static_cast<double>(p) * before;
    raise(p, t);
  }

 private:
  void raise(std::size_t order, double t) {
    double carried = 0;
    for (std::size_t i = 0; i < order; ++i) {
      const double v = value[i];
      value[i] = carried + (1 - t) * v;
      carried = t * v;
    }
    value[order] = carried;
  }
};

/// Halves rows of blocks of `stride` numbers by the de Casteljau algorithm. `right` holds the row
/// that is split.
void halveRows(double* left, double* right, std::size_t outer, std::size_t length,
               std::size_t stride) {
  for (std::size_t o = 0; o < outer; ++o) {
    double* l = left + o * length * stride;
    double* r = right + o * length * stride;
    std::copy(r, r + stride, l);
    for (std::size_t step = 1; step < length; ++step) {
      const std::size_t moved = (length - step) * stride;
      for (std::size_t n = 0; n < moved; ++n) r[n] = 0.5 * (r[n] + r[n + stride]);
      std::copy(r, r + stride, l + step * stride);
    }
  }
}

/// Inverts the matrix of the rows a. @return false if it is singular
bool invert(const double (&a)[3][3], double (&inverse)[3][3]) {
  const V3d r0(a[0][0], a[0][1], a[0][2]), r1(a[1][0], a[1][1], a[1][2]),
      r2(a[2][0], a[2][1], a[2][2]);
  const V3d c0 = r1.cross(r2), c1 = r2.cross(r0), c2 = r0.cross(r1);
  const double determinant = r0.dot(c0);
  const double lengths = std::sqrt(r0.length2() * r1.length2() * r2.length2());
  if (!(std::abs(determinant) > kLeastDeterminant * lengths)) return false;
  for (int i = 0; i < 3; ++i) {
    inverse[i][0] = c0[i] / determinant;
    inverse[i][1] = c1[i] / determinant;
    inverse[i][2] = c2[i] / determinant;
  }
  return true;
}

/// Smallest and largest number.
struct NodeRange {
  double low = kInfinity, high = -kInfinity;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Four components as two vectors of the processor, and the fifth one.
template <int N>
struct Lanes {
  using Two = double __attribute__((vector_size(16)));
  Two first = {}, second = {};
  double fifth = 0;

  /// Adds factor times the components at `from`.
  void add(double factor, const double* from) {
    Two a, b;
    std::memcpy(&a, from, sizeof(a));
    std::memcpy(&b, from + 2, sizeof(b));
    first += factor * a;
    second += factor * b;
    if constexpr (N == 5) fifth += factor * from[4];
  }
  void add(double factor, const Lanes& from) {
    first += factor * from.first;
    second += factor * from.second;
    if constexpr (N == 5) fifth += factor * from.fifth;
  }
  void store(std::array<double, N>& to) const {
    std::memcpy(to.data(), &first, sizeof(first));
    std::memcpy(to.data() + 2, &second, sizeof(second));
    if constexpr (N == 5) to[4] = fifth;
  }
};

/// As TreeNodes::jet(). @tparam Order  degree + 1 along each axis, 0 if it is known at run time
/// only
template <int N, int Order>
NodeJet<N> jetOf(const TreeNode& node, const std::array<double, 3>& u) {
  const BernsteinRow<Order> bu(node.degree[0], u[0]), bv(node.degree[1], u[1]),
      bw(node.degree[2], u[2]);
  const auto orderU = static_cast<std::size_t>(Order ? Order : node.degree[0] + 1),
             orderV = static_cast<std::size_t>(Order ? Order : node.degree[1] + 1),
             orderW = static_cast<std::size_t>(Order ? Order : node.degree[2] + 1);
  const double* c = node.points.data();
  Lanes<N> value, slopeU, slopeV, slopeW;
  for (std::size_t i = 0; i < orderU; ++i) {
    Lanes<N> plane, planeV, planeW;
    for (std::size_t j = 0; j < orderV; ++j) {
      Lanes<N> row, rowW;
      for (std::size_t k = 0; k < orderW; ++k, c += N) {
        row.add(bw.value[k], c);
        rowW.add(bw.slope[k], c);
      }
      plane.add(bv.value[j], row);
      planeV.add(bv.slope[j], row);
      planeW.add(bv.value[j], rowW);
    }
    value.add(bu.value[i], plane);
    slopeU.add(bu.slope[i], plane);
    slopeV.add(bu.value[i], planeV);
    slopeW.add(bu.value[i], planeW);
  }
  NodeJet<N> result;
  value.store(result.value);
  slopeU.store(result.slope[0]);
  slopeV.store(result.slope[1]);
  slopeW.store(result.slope[2]);
  return result;
}

template <int N>
constexpr int weightComponent(const BezierView& view) {
  return view.isPerspective ? kDepth : kWeight;
}

/// Control points of G at the centre of a node's frame, and their weights W. They are in memory
/// that the calls of a thread use one after the other.
template <int N>
struct Combined {
  std::size_t count;
  std::array<double*, 3> rows;
  double* weights;

  Combined(const TreeNode& node, int weight) : count(node.points.size() / N) {
    thread_local std::vector<double> memory;
    memory.resize(4 * count);
    weights = memory.data() + 3 * count;
    const double* c = node.points.data();
    for (std::size_t n = 0; n < count; ++n)
      weights[n] = c[n * N + static_cast<std::size_t>(weight)];
    for (std::size_t r = 0; r < 3; ++r) {
      rows[r] = memory.data() + r * count;
      const double* m = node.inverse[r];
      // Σ m F = m0 X + m1 Y + m2 A − (m0 x + m1 y) W
      const double offset = m[0] * node.centre.x + m[1] * node.centre.y;
      for (std::size_t n = 0; n < count; ++n)
        rows[r][n] = m[0] * c[n * N + kAcross] + m[1] * c[n * N + kDown] +
                     m[2] * c[n * N + kValue] - offset * weights[n];
    }
  }
};

}  // namespace

double NodePlace::edge() const {
  return std::ldexp(1.0, -level);
}

template <int N>
NodeJet<N> TreeNodes<N>::jet(const TreeNode& node, const std::array<double, 3>& u) {
  if (node.degree[0] == node.degree[2] &&
      node.degree[1] == node.degree[2]) {  // loops of a known length are faster, with equal bits
    switch (node.degree[2]) {
      case 2:
        return jetOf<N, 3>(node, u);
      case 3:
        return jetOf<N, 4>(node, u);
      case 4:
        return jetOf<N, 5>(node, u);
      case 5:
        return jetOf<N, 6>(node, u);
      default:
        break;
    }
  }
  return jetOf<N, 0>(node, u);
}

template <int N>
void TreeNodes<N>::addFrame(TreeNode& node, const BezierView& view, const ComponentScale& scale) {
  node.hasFrame = node.isUnique = false;
  if (node.crossesEye) return;
  const int w = weightComponent<N>(view);
  const auto at = [](int component) { return static_cast<std::size_t>(component); };
  const NodeJet<N> jet = TreeNodes<N>::jet(node, {0.5, 0.5, 0.5});
  const double weight = jet.value[at(w)];
  node.weight = weight;
  node.centre = {jet.value[kAcross] / weight, jet.value[kDown] / weight};
  const double bx = node.centre.x, by = node.centre.y;
  double rows[3][3];
  for (int j = 0; j < 3; ++j) {
    rows[0][j] = jet.slope[j][kAcross] - bx * jet.slope[j][at(w)];
    rows[1][j] = jet.slope[j][kDown] - by * jet.slope[j][at(w)];
    rows[2][j] = jet.slope[j][kValue];
  }
  node.hasFrame = invert(rows, node.inverse);
  if (!node.hasFrame) return;

  const Combined<N> g(node, w);
  double leastWeight = kInfinity;
  for (std::size_t n = 0; n < g.count; ++n) leastWeight = std::min(leastWeight, g.weights[n]);
  for (int r = 0; r < 3; ++r) {
    const double* m = node.inverse[r];
    NodeRange range;
    for (std::size_t n = 0; n < g.count; ++n) range.add(g.rows[r][n] / g.weights[n]);
    const double noise =
        kNodeRounding / leastWeight *
        (std::abs(m[0]) * (scale.most[kAcross] + std::abs(bx) * scale.most[at(w)]) +
         std::abs(m[1]) * (scale.most[kDown] + std::abs(by) * scale.most[at(w)]) +
         std::abs(m[2]) * scale.most[kValue]);
    node.low[r] = range.low - noise;
    node.high[r] = range.high + noise;
    node.middle[r] = m[2] * jet.value[kValue];
  }
}

template <int N>
void TreeNodes<N>::prove(TreeNode& node, const BezierView& view) {
  node.isUnique = false;
  if (!node.hasFrame) return;
  const Combined<N> g(node, weightComponent<N>(view));
  // Rows of the derivative for all s between low and high; linear in s, so its ends are bounds.
  const std::size_t stride[3] = {
      static_cast<std::size_t>(node.degree[1] + 1) * static_cast<std::size_t>(node.degree[2] + 1),
      static_cast<std::size_t>(node.degree[2] + 1), 1};
  for (int r = 0; r < 3; ++r) {
    const double low = node.low[r], high = node.high[r];
    for (std::size_t j = 0; j < 3; ++j) {
      const double degree = node.degree[j];
      const std::size_t block = stride[j] * static_cast<std::size_t>(node.degree[j] + 1);
      NodeRange range;
      for (std::size_t o = 0; o < g.count; o += block)
        for (std::size_t n = o; n < o + block - stride[j]; ++n) {
          const double change = g.rows[r][n + stride[j]] - g.rows[r][n],
                       other = g.weights[n + stride[j]] - g.weights[n];
          range.add(change - low * other);
          range.add(change - high * other);
        }
      if (static_cast<int>(j) == r) {
        node.least[r] = degree * range.low;
        node.across[r][j] = 0;
      } else {
        node.across[r][j] = degree * std::max(range.high, -range.low);
      }
    }
  }
  node.isUnique = true;
  constexpr double kMargin = 1e-6;  // for roots beyond a face by a rounding error
  for (int r = 0; r < 3; ++r)
    if (!(node.least[r] > kMargin + node.across[r][0] + node.across[r][1] + node.across[r][2]))
      node.isUnique = false;
}

template <int N>
bool TreeNodes<N>::bound(TreeNode& node, const BezierView& view, const ComponentScale& scale) {
  const std::size_t count = node.points.size() / N;
  node.hasFrame = node.isUnique = false;
  NodeRange value, depth, weighted, weights;
  for (std::size_t n = 0; n < count; ++n) {
    const double* c = node.points.data() + n * N;
    if constexpr (N == 5) weights.add(c[N - 1]);
    value.add(c[kValue]);
    weighted.add(c[kDepth]);
    depth.add(N == 5 ? c[kDepth] / c[N - 1] : c[kDepth]);
  }
  const double flat = kNodeRounding * scale.most[kValue];
  if (value.low > flat || value.high < -flat) return false;
  const double thick = kNodeRounding * scale.most[kDepth];
  node.depthMin = depth.low;
  node.depthMax = depth.high;
  const double ratio = N == 5 ? weights.high / weights.low : 1;
  node.leastDepth =
      ratio < kMostDepthRatio
          ? depth.low - ratio * (kRootReach * (depth.high - depth.low) +
                                 kDepthRounding * std::max(std::abs(depth.low), depth.high))
          : -kInfinity;
  if (depth.high + thick < view.near || depth.low - thick > view.far) return false;
  if (view.isPerspective) {
    if (!(weighted.high > 0)) return false;
    node.crossesEye = !(weighted.low > 1e-9 * weighted.high);
    if (node.crossesEye) return true;
  } else {
    node.crossesEye = false;
  }
  const auto w = static_cast<std::size_t>(weightComponent<N>(view));
  NodeRange x, y;
  double leastWeight = kInfinity;
  for (std::size_t n = 0; n < count; ++n) {
    const double* c = node.points.data() + n * N;
    x.add(c[kAcross] / c[w]);
    y.add(c[kDown] / c[w]);
    leastWeight = std::min(leastWeight, c[w]);
  }
  const double noise = kNodeRounding / leastWeight;
  node.left = x.low - noise * scale.most[kAcross];
  node.right = x.high + noise * scale.most[kAcross];
  node.top = y.low - noise * scale.most[kDown];
  node.bottom = y.high + noise * scale.most[kDown];
  return true;
}

template <int N>
bool TreeNodes<N>::root(const BezierVolume& volume, std::uint32_t number, std::uint32_t attribute,
                        const BezierView& view, TreeNode& node, ComponentScale& scale) {
  const BezierPatch& patch = volume.patches[number];
  const std::vector<double>& values = patch.attributes[attribute];
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  // Exact, so before any transform.
  if (*least > volume.isovalue || *most < volume.isovalue) return false;
  node.degree = patch.degree;
  node.patch = number;
  node.attribute = attribute;
  node.level = 0;
  node.cell = {};
  node.points.resize(patch.points.size() * N);
  scale.most.fill(0);
  for (std::size_t n = 0; n < patch.points.size(); ++n) {
    const double weight = patch.weights.empty() ? 1 : patch.weights[n];
    const V3d p = patch.points[n] - view.eye;
    double* c = node.points.data() + n * N;
    c[kAcross] = weight * p.dot(view.right);
    c[kDown] = weight * p.dot(view.down);
    c[kDepth] = weight * p.dot(view.axis);
    c[kValue] = weight * (values[n] - volume.isovalue);
    if constexpr (N == 5) c[N - 1] = weight;
    for (std::size_t i = 0; i < N; ++i) scale.most[i] = std::max(scale.most[i], std::abs(c[i]));
    // The difference from the eye rounds, too, relative to the coordinates.
    const double length = weight * std::max(patch.points[n].length(), view.eye.length());
    for (const int i : {kAcross, kDown, kDepth}) {
      auto& largest = scale.most[static_cast<std::size_t>(i)];
      largest = std::max(largest, length);
    }
  }
  return bound(node, view, scale);
}

template <int N>
bool TreeNodes<N>::turned(const TreeNode& world, const ComponentScale& worldScale,
                          const BezierView& view, TreeNode& node,
                          ComponentScale& scale) requires(N == 5) {
  node.degree = world.degree;
  node.patch = world.patch;
  node.attribute = world.attribute;
  node.level = world.level;
  node.cell = world.cell;
  node.points.resize(world.points.size());
  for (std::size_t n = 0; n < world.points.size(); n += N) {
    const double* from = world.points.data() + n;
    double* to = node.points.data() + n;
    const double weight = from[kWeight];
    const V3d p(from[0] - view.eye.x * weight, from[1] - view.eye.y * weight,
                from[2] - view.eye.z * weight);
    to[kAcross] = p.dot(view.right);
    to[kDown] = p.dot(view.down);
    to[kDepth] = p.dot(view.axis);
    to[kValue] = from[kValue];
    to[kWeight] = weight;
  }
  const double most = worldScale.most[0] + worldScale.most[1] + worldScale.most[2] +
                      view.eye.length() * worldScale.most[kWeight];
  scale.most = {most, most, most, worldScale.most[kValue], worldScale.most[kWeight]};
  return bound(node, view, scale);
}

template <int N>
std::size_t TreeNodes<N>::split(const TreeNode& node, const BezierView& view,
                                const ComponentScale& scale, TreeNode* children,
                                std::vector<double>& scratch) {
  const std::size_t size = node.points.size();
  const auto order = [&](std::size_t axis) {
    return static_cast<std::size_t>(node.degree[axis] + 1);
  };
  scratch.resize(4 * size);
  double* half[2] = {scratch.data(), scratch.data() + size};
  double* quarter[2] = {scratch.data() + 2 * size, scratch.data() + 3 * size};
  const double flat = kNodeRounding * scale.most[kValue];
  const auto mayHold = [&](const double* points) {
    double low = kInfinity, high = -kInfinity;
    for (std::size_t n = kValue; n < size; n += N) {
      low = std::min(low, points[n]);
      high = std::max(high, points[n]);
    }
    return low <= flat && high >= -flat;
  };
  std::copy(node.points.begin(), node.points.end(), half[1]);
  halveRows(half[0], half[1], 1, order(0), order(1) * order(2) * N);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < 2; ++i) {
    if (!mayHold(half[i])) continue;
    std::copy(half[i], half[i] + size, quarter[1]);
    halveRows(quarter[0], quarter[1], order(0), order(1), order(2) * N);
    for (std::uint32_t j = 0; j < 2; ++j) {
      if (!mayHold(quarter[j])) continue;
      TreeNode& low = children[count];
      TreeNode& high = children[count + 1];
      low.points.resize(size);
      high.points.assign(quarter[j], quarter[j] + size);
      halveRows(low.points.data(), high.points.data(), order(0) * order(1), order(2), N);
      for (std::uint32_t k = 0; k < 2; ++k) {
        TreeNode& child = k == 0 ? low : high;
        child.degree = node.degree;
        child.patch = node.patch;
        child.attribute = node.attribute;
        child.level = node.level + 1;
        child.cell = {2 * node.cell[0] + i, 2 * node.cell[1] + j, 2 * node.cell[2] + k};
      }
      const bool hasLow = bound(low, view, scale), hasHigh = bound(high, view, scale);
      if (!hasLow && hasHigh) std::swap(low, high);
      count += static_cast<std::size_t>(hasLow) + static_cast<std::size_t>(hasHigh);
    }
  }
  return count;
}

template <int N>
bool TreeNodes<N>::mayCross(const TreeNode& node, const BezierView& view,
                            const Imath::V2d& screen) {
  const auto w = static_cast<std::size_t>(weightComponent<N>(view));
  NodeRange x, y;
  for (std::size_t n = 0; n < node.points.size(); n += N) {
    const double* c = node.points.data() + n;
    x.add(c[kAcross] - screen.x * c[w]);
    y.add(c[kDown] - screen.y * c[w]);
  }
  return x.low <= 0 && x.high >= 0 && y.low <= 0 && y.high >= 0;
}

template struct TreeNodes<4>;
template struct TreeNodes<5>;

}  // namespace render
