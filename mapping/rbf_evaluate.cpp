// The sums of RbfMap over its particles. Compiled with -O3 -fno-math-errno, so that the plain loops
// below become SSE2 code; neither flag changes a bit of the results.

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/rbf_map.h"

namespace mapping {
namespace {

using Imath::M33d;
using Imath::V3d;

constexpr std::size_t kChunk = 64;  // particles or points that one vectorised loop takes
constexpr int kNodes = 4;           // of the far field's polynomial, along one axis
constexpr int kEdge = 8;            // of a block

/// Chebyshev nodes in grid steps over [0, 7], and the value of each node's Lagrange polynomial at
/// the eight grid points.
struct FarTable {
  std::array<double, kNodes> nodes;
  std::array<std::array<double, kNodes>, kEdge> lagrange;
  FarTable() {
    constexpr double kMiddle = 0.5 * (kEdge - 1);
    for (int m = 0; m < kNodes; ++m) {
      const double angle = (2 * m + 1) * std::acos(-1.0) / (2 * kNodes);
      nodes[static_cast<std::size_t>(m)] = kMiddle - kMiddle * std::cos(angle);
    }
    for (std::size_t i = 0; i < kEdge; ++i)
      for (std::size_t m = 0; m < kNodes; ++m) {
        double product = 1;
        for (std::size_t j = 0; j < kNodes; ++j)
          if (j != m) product *= (static_cast<double>(i) - nodes[j]) / (nodes[m] - nodes[j]);
        lagrange[i][m] = product;
      }
  }
};
const FarTable kFar;

V3d row(const M33d& m, int i) {
  return {m[i][0], m[i][1], m[i][2]};
}

/// Half the longest diagonal of the parallelepiped ± rows.
double halfDiagonal(const M33d& rows) {
  const V3d a = row(rows, 0), b = row(rows, 1), c = row(rows, 2);
  return std::max(
      {(a + b + c).length(), (a + b - c).length(), (a - b + c).length(), (a - b - c).length()});
}

/// A fixed number of points and the sums Σ ω_i |x − p_i| there.
template <std::size_t N>
struct Batch {
  std::array<double, N> x, y, z, u{}, v{}, w{};

  void add(double px, double py, double pz, double wu, double wv, double ww) {
    for (std::size_t i = 0; i < N; ++i) {
      const double dx = x[i] - px, dy = y[i] - py, dz = z[i] - pz;
      const double r = std::sqrt(dx * dx + dy * dy + dz * dz);
      u[i] += wu * r;
      v[i] += wv * r;
      w[i] += ww * r;
    }
  }
};

/// Spreads 4 × 4 × 4 node values over the 8 × 8 × 8 grid points, axis by axis.
void interpolate(const std::array<double, 64>& nodes, std::array<double, 512>& result) {
  std::array<double, 128> first;   // i (8), b, c
  std::array<double, 256> second;  // i, j (8), c
  for (std::size_t i = 0; i < kEdge; ++i)
    for (std::size_t bc = 0; bc < 16; ++bc) {
      double sum = 0;
      for (std::size_t a = 0; a < kNodes; ++a) sum += kFar.lagrange[i][a] * nodes[16 * a + bc];
      first[16 * i + bc] = sum;
    }
  for (std::size_t i = 0; i < kEdge; ++i)
    for (std::size_t j = 0; j < kEdge; ++j)
      for (std::size_t c = 0; c < kNodes; ++c) {
        double sum = 0;
        for (std::size_t b = 0; b < kNodes; ++b)
          sum += kFar.lagrange[j][b] * first[16 * i + 4 * b + c];
        second[32 * i + 4 * j + c] = sum;
      }
  for (std::size_t ij = 0; ij < 64; ++ij)
    for (std::size_t k = 0; k < kEdge; ++k) {
      double sum = 0;
      for (std::size_t c = 0; c < kNodes; ++c) sum += kFar.lagrange[k][c] * second[4 * ij + c];
      result[8 * ij + k] = sum;
    }
}

}  // namespace

V3d RbfMap::affine(const V3d& local) const {
  V3d result = constant_;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) result[k] += linear_[k][axis] * local[axis];
  return result;
}

V3d RbfMap::operator()(const V3d& x) const {
  const V3d local = x - origin_;
  V3d sum = affine(local);
  std::array<double, kChunk> distance;
  for (std::size_t begin = 0; begin < count_; begin += kChunk) {
    const std::size_t size = std::min(kChunk, count_ - begin);
    for (std::size_t i = 0; i < size; ++i) {
      const double dx = local.x - particles_.x[begin + i], dy = local.y - particles_.y[begin + i],
                   dz = local.z - particles_.z[begin + i];
      distance[i] = std::sqrt(dx * dx + dy * dy + dz * dz);
    }
    for (std::size_t i = 0; i < size; ++i) {
      sum.x += particles_.u[begin + i] * distance[i];
      sum.y += particles_.v[begin + i] * distance[i];
      sum.z += particles_.w[begin + i] * distance[i];
    }
  }
  return sum;
}

M33d RbfMap::jacobian(const V3d& x) const {
  const V3d local = x - origin_;
  M33d result = linear_;
  for (std::size_t i = 0; i < count_; ++i) {
    const V3d way = local - V3d(particles_.x[i], particles_.y[i], particles_.z[i]);
    const double distance = way.length();
    if (distance == 0) continue;
    const V3d direction = way / distance;
    for (int axis = 0; axis < 3; ++axis) {
      result[0][axis] += particles_.u[i] * direction[axis];
      result[1][axis] += particles_.v[i] * direction[axis];
      result[2][axis] += particles_.w[i] * direction[axis];
    }
  }
  return result;
}

double RbfMap::lipschitz(const V3d& center, double radius) const {
  const V3d local = center - origin_;
  const M33d gradient = jacobian(center);
  double squared = 0, change = 0;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) squared += gradient[k][axis] * gradient[k][axis];
  for (std::size_t i = 0; i < count_; ++i) {
    const double distance =
        (local - V3d(particles_.x[i], particles_.y[i], particles_.z[i])).length();
    // Seen from a particle outside the ball, directions to it lie within asin(radius / distance).
    const double turn = distance > radius ? std::min(2.0, std::sqrt(2.0) * radius / distance) : 2.0;
    change += weightNorm_[i] * turn;
  }
  return std::sqrt(squared) + change;
}

Imath::Box3d RbfMap::imageBounds(const V3d& center, const M33d& halfAxes) const {
  const V3d local = center - origin_;
  const double radius = halfDiagonal(halfAxes);
  V3d value = affine(local), remainder(0);
  M33d gradient = linear_;
  for (std::size_t i = 0; i < count_; ++i) {
    const V3d way = local - V3d(particles_.x[i], particles_.y[i], particles_.z[i]);
    const double distance = way.length();
    const V3d weight(particles_.u[i], particles_.v[i], particles_.w[i]);
    value += weight * distance;
    const V3d direction = distance > 0 ? way / distance : V3d(0);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) gradient[k][axis] += weight[k] * direction[axis];
    // |x − p| is convex with Hessian ≤ 1 / |x − p|, and its slope never passes 1.
    double beyond = 2 * radius;
    if (distance > radius) {
      beyond = std::min(beyond, 0.5 * radius * radius / (distance - radius));
    }
    for (int k = 0; k < 3; ++k) remainder[k] += std::abs(weight[k]) * beyond;
  }
  V3d extent = remainder;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) extent[k] += std::abs(row(gradient, k).dot(row(halfAxes, i)));
  return {value - extent, value + extent};
}

void RbfMap::evaluateBlock(const V3d& origin, const M33d& rows, double tolerance,
                           std::span<V3d, 512> result) const {
  constexpr double kHalfEdge = 0.5 * (kEdge - 1);
  const V3d step[3] = {row(rows, 0), row(rows, 1), row(rows, 2)};
  const V3d local = origin - origin_;
  const V3d middle = local + (step[0] + step[1] + step[2]) * kHalfEdge;
  const double radius = kHalfEdge * halfDiagonal(rows);
  double halfEdge = 0;
  for (const V3d& s : step) halfEdge = std::max(halfEdge, kHalfEdge * s.length());
  // The fourth derivative of |x − p| along a line is at most 3 / D³, so four Chebyshev nodes leave
  // a⁴ / (64 D³) in each axis; their Lebesgue constant 1.85 carries it through the other two.
  const double errorFactor = (1 + 1.85 + 1.85 * 1.85) * std::pow(halfEdge, 4) / 64;

  std::vector<double> distance(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    const double dx = middle.x - particles_.x[i], dy = middle.y - particles_.y[i],
                 dz = middle.z - particles_.z[i];
    distance[i] = std::sqrt(dx * dx + dy * dy + dz * dz);
  }
  double reach = 2 * radius, error = 0;
  for (;; reach *= 1.4) {
    error = 0;
    std::size_t far = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (distance[i] <= reach) continue;
      const double gap = distance[i] - radius;
      error += weightNorm_[i] * errorFactor / (gap * gap * gap);
      ++far;
    }
    if (error <= tolerance || far == 0) break;
  }

  // === The far field at the nodes, the affine part with it
  Batch<64> nodes;
  for (std::size_t a = 0, n = 0; a < kNodes; ++a)
    for (std::size_t b = 0; b < kNodes; ++b)
      for (std::size_t c = 0; c < kNodes; ++c, ++n) {
        const V3d p =
            local + step[0] * kFar.nodes[a] + step[1] * kFar.nodes[b] + step[2] * kFar.nodes[c];
        const V3d base = affine(p);
        nodes.x[n] = p.x, nodes.y[n] = p.y, nodes.z[n] = p.z;
        nodes.u[n] = base.x, nodes.v[n] = base.y, nodes.w[n] = base.z;
      }
  for (std::size_t i = 0; i < count_; ++i)
    if (distance[i] > reach)
      nodes.add(particles_.x[i], particles_.y[i], particles_.z[i], particles_.u[i], particles_.v[i],
                particles_.w[i]);

  // === The near field at every grid point
  Batch<512> points;
  interpolate(nodes.u, points.u);
  interpolate(nodes.v, points.v);
  interpolate(nodes.w, points.w);
  for (std::size_t n = 0; n < 512; ++n) {
    const V3d p = local + step[0] * static_cast<double>(n >> 6) +
                  step[1] * static_cast<double>((n >> 3) & 7) +
                  step[2] * static_cast<double>(n & 7);
    points.x[n] = p.x, points.y[n] = p.y, points.z[n] = p.z;
  }
  for (std::size_t i = 0; i < count_; ++i)
    if (distance[i] <= reach)
      points.add(particles_.x[i], particles_.y[i], particles_.z[i], particles_.u[i],
                 particles_.v[i], particles_.w[i]);
  for (std::size_t n = 0; n < 512; ++n) result[n] = V3d(points.u[n], points.v[n], points.w[n]);
}

}  // namespace mapping
