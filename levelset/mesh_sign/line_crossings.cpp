#include "levelset/mesh_sign/line_crossings.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "levelset/geometry/exact_predicates.h"
#include "levelset/progress_gate.h"

namespace levelset::convert {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr std::size_t kChunk = 4096;  // triangles per chunk; fixed, so that the number of threads
                                      // does not change the result

/// Side of the edge a → b on which the point q, shifted by (ε, ε²), lies: +1 left, −1 right. 0 only
/// when a = b.
int sideOf(const V2d& a, const V2d& b, const V2d& q) {
  if (const int side = orient2d(a, b, q)) return side;
  if (a.y != b.y) return a.y > b.y ? 1 : -1;
  return (b.x > a.x) - (b.x < a.x);
}

/// Projects a point along x onto the plane (y, z).
V2d project(const V3d& p) {
  return {p.y, p.z};
}

/// Lowest integer x for which the point (x, q) lies on the +x side of the triangle's plane.
/// @param q      y and z of the grid line
/// @param front  +1 when the front of the triangle faces +x, −1 when it faces −x
int firstBehind(const V3d& a, const V3d& b, const V3d& c, const V2d& q, int front) {
  const V2d pa = project(a) - q, pb = project(b) - q, pc = project(c) - q;
  const double bc = pb.x * pc.y, cb = pb.y * pc.x;
  const double ca = pc.x * pa.y, ac = pc.y * pa.x;
  const double ab = pa.x * pb.y, ba = pa.y * pb.x;
  const double wa = std::abs(bc - cb), wb = std::abs(ca - ac), wc = std::abs(ab - ba);
  const double sum = wa + wb + wc;
  const double low = std::min({a.x, b.x, c.x}), high = std::max({a.x, b.x, c.x});
  const double size =
      std::abs(bc) + std::abs(cb) + std::abs(ca) + std::abs(ac) + std::abs(ab) + std::abs(ba);
  const double magnitude = std::max(std::abs(low), std::abs(high));
  // Rounding changes each weight by at most 4 ulp of its terms. The weighted mean of a.x, b.x and
  // c.x then changes by at most the relative error of the weights times high − low.
  constexpr double kUlp = 2.3e-16;
  double x = (low + high) / 2, error = (high - low) / 2;
  if (sum > 0 && 32 * kUlp * size < sum) {
    x = (wa * a.x + wb * b.x + wc * c.x) / sum;
    error = std::min(high - low, 32 * kUlp * size / sum * (high - low));
  }
  error += 8 * kUlp * magnitude;
  int before = static_cast<int>(std::floor(x - error));
  int behind = static_cast<int>(std::floor(x + error)) + 1;
  // Bisection by the exact predicate. `before` lies on the −x side or in the plane, `behind` on the
  // +x side. Integers between `before` and `behind` lie within the rounding error of x.
  while (behind - before > 1) {
    const int middle = before + (behind - before) / 2;
    if (orient3d(a, b, c, V3d(middle, q.x, q.y)) == front)
      behind = middle;
    else
      before = middle;
  }
  return behind;
}

/// Range of z that the triangle a, b, c in the plane (y, z) covers on the line of constant `y`,
/// slightly enlarged. The caller tests each z in it exactly.
std::pair<double, double> rangeAt(double y, const V2d& a, const V2d& b, const V2d& c) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto visit = [&](const V2d& p, const V2d& q) {
    if (std::min(p.x, q.x) > y || std::max(p.x, q.x) < y) return;
    const double from = std::min(p.y, q.y), to = std::max(p.y, q.y);
    if (p.x == q.x) {
      low = std::min(low, from), high = std::max(high, to);
      return;
    }
    const double z = std::clamp(p.y + (q.y - p.y) * ((y - p.x) / (q.x - p.x)), from, to);
    low = std::min(low, z), high = std::max(high, z);
  };
  visit(a, b), visit(b, c), visit(c, a);
  const double margin = 1e-6 + 1e-14 * (std::abs(low) + std::abs(high));
  return {low - margin, high + margin};
}

}  // namespace

void LineCrossings::addTriangle(const V3d& a, const V3d& b, const V3d& c, int weight,
                                std::vector<Crossing>& out) {
  const V2d pa = project(a), pb = project(b), pc = project(c);
  const int firstY = static_cast<int>(std::ceil(std::min({pa.x, pb.x, pc.x})));
  const int lastY = static_cast<int>(std::floor(std::max({pa.x, pb.x, pc.x})));
  for (int y = firstY; y <= lastY; ++y) {
    const auto [low, high] = rangeAt(y, pa, pb, pc);
    for (int z = static_cast<int>(std::ceil(low)); z <= high; ++z) {
      const V2d q(y, z);
      const int side = sideOf(pa, pb, q);
      if (side == 0 || sideOf(pb, pc, q) != side || sideOf(pc, pa, q) != side) continue;
      // Counter-clockwise in (y, z) means a normal towards +x: the line leaves the solid there.
      out.push_back({y, z, firstBehind(a, b, c, q, side), -side * weight, {}});
    }
  }
}

LineCrossings::LineCrossings(const LocalMesh& mesh, std::span<const int> weights,
                             const Progress& progress) {
  const std::size_t chunks = (mesh.triangles.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<Crossing>> found(chunks);
  ProgressGate gate(progress, chunks);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    const std::size_t end = std::min(mesh.triangles.size(), (chunk + 1) * kChunk);
    for (std::size_t t = chunk * kChunk; t < end; ++t)
      addTriangle(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2),
                  weights.empty() ? 1 : weights[t], found[chunk]);
    gate.advance(1);
  });
  std::size_t total = 0;
  for (const auto& part : found) total += part.size();
  crossings_.reserve(total);
  for (auto& part : found) {
    crossings_.insert(crossings_.end(), part.begin(), part.end());
    part = {};
  }
  tbb::parallel_sort(crossings_.begin(), crossings_.end());
  CrossingSum sum;
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    Crossing& crossing = crossings_[i];
    if (i == 0 || crossings_[i - 1].y != crossing.y || crossings_[i - 1].z != crossing.z) sum = {};
    sum.winding += crossing.step;
    ++sum.crossings;
    crossing.sum = sum;
  }
}

CrossingSum LineCrossings::at(int x, int y, int z) const {
  const auto behind =
      std::upper_bound(crossings_.begin(), crossings_.end(), x, [&](int, const Crossing& other) {
        if (other.y != y) return other.y > y;
        if (other.z != z) return other.z > z;
        return other.x > x;
      });
  if (behind == crossings_.begin()) return {};
  const Crossing& last = *(behind - 1);
  return last.y == y && last.z == z ? last.sum : CrossingSum{};
}

void LineCrossings::slab(int x0, int y, int z0, CrossingSum* sums) const {
  auto next =
      std::lower_bound(crossings_.begin(), crossings_.end(), z0,
                       [&](const Crossing& c, int z) { return c.y != y ? c.y < y : c.z < z; });
  for (int dz = 0; dz < 8; ++dz) {
    CrossingSum sum;
    const auto onLine = [&] {
      return next != crossings_.end() && next->y == y && next->z == z0 + dz;
    };
    for (int dx = 0; dx < 8; ++dx) {
      for (; onLine() && next->x <= x0 + dx; ++next) sum = next->sum;
      sums[8 * dx + dz] = sum;
    }
    while (onLine()) ++next;
  }
}

}  // namespace levelset::convert
