#include "levelset/deform/cage/cage_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/gauss_rule.h"

namespace levelset::cage {
namespace {

using Imath::V3d;

/// Beside the triangle, the closed form loses (distance / height)² units of precision in the
/// gradient. Below this ratio a quadrature takes over.
constexpr double kFlatRatio = 0.02;
/// The closed form also loses (distance / diameter)³ units of precision far away.
constexpr double kFarRatio = 40;
/// Points of the quadrature along each parameter, and the largest ratio of diameter to distance for
/// which it reaches the precision.
constexpr std::size_t kQuadraturePoints = 8;
constexpr double kQuadratureRatio = 0.4;
constexpr int kMostQuarterings = 40;
/// Height over the diameter within which a point lies in the plane of a triangle.
constexpr double kOnPlane = 1e-13;

/// Adds the integrals over a part of a triangle. `corners` and `hats` are the corners of the part
/// and the values of the three linear functions there.
void addQuadrature(const CageTriangle& triangle, const V3d& x, const std::array<V3d, 3>& corners,
                   const std::array<V3d, 3>& hats, int depth, std::array<Sloped, 3>& sums) {
  const double longest =
      std::sqrt(std::max({(corners[1] - corners[0]).length2(), (corners[2] - corners[1]).length2(),
                          (corners[0] - corners[2]).length2()}));
  const V3d foot = closestOnTriangle(x, corners[0], corners[1], corners[2]).point;
  if (longest > kQuadratureRatio * (foot - x).length() && depth < kMostQuarterings) {
    std::array<V3d, 3> middles, halves;
    for (std::size_t n = 0; n < 3; ++n) {
      middles[n] = (corners[n] + corners[(n + 1) % 3]) * 0.5;
      halves[n] = (hats[n] + hats[(n + 1) % 3]) * 0.5;
    }
    for (std::size_t n = 0; n < 3; ++n)
      addQuadrature(triangle, x, {corners[n], middles[n], middles[(n + 2) % 3]},
                    {hats[n], halves[n], halves[(n + 2) % 3]}, depth + 1, sums);
    addQuadrature(triangle, x, middles, halves, depth + 1, sums);
    return;
  }
  static const GaussRule<kQuadraturePoints> rule;
  const V3d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const double area = e1.cross(e2).length();
  const double height = triangle.normal.dot(triangle.corners[0] - x);
  for (std::size_t i = 0; i < kQuadraturePoints; ++i)
    for (std::size_t j = 0; j < kQuadraturePoints; ++j) {
      // Duffy's map of the square to the triangle.
      const double u = rule.at[i], v = (1 - u) * rule.at[j];
      const double weight = rule.weight[i] * rule.weight[j] * (1 - u) * area;
      const V3d d = corners[0] + e1 * u + e2 * v - x;
      const double r2 = d.length2(), by4 = weight / (r2 * r2);
      const double value = height * by4;
      const V3d slope = triangle.normal * -by4 + d * (4 * height * by4 / r2);
      const V3d hat = hats[0] * (1 - u - v) + hats[1] * u + hats[2] * v;
      for (std::size_t n = 0; n < 3; ++n) {
        sums[n].value += value * hat[static_cast<int>(n)];
        sums[n].slope += slope * hat[static_cast<int>(n)];
      }
    }
}

/// θ / sin θ over the product of the lengths, for the edge between two corners, as a number with a
/// gradient. `cross` is the cross product of the two vectors `d` and `e` from x.
Sloped angleOverSine(const V3d& d, const V3d& e, const V3d& cross, const V3d& edge) {
  const double s2 = cross.length2(), s = std::sqrt(s2), c = d.dot(e),
               r2 = d.length2() * e.length2();
  const double r = std::sqrt(r2);
  Sloped result;
  double bend = 0;  // (cos θ / r − θ / (r sin θ)) / s²
  if (c > 0 && s < 1e-2 * r) {
    // Series by sin² θ, because both terms nearly cancel.
    const double z = s2 / r2;
    result.value = (1 + z * (1.0 / 6 + z * (3.0 / 40 + z * (15.0 / 336 + z * (105.0 / 3456))))) / r;
    // cos θ − θ / sin θ = −(2/3) z − (1/5) z² − (3/28) z³ − …
    bend = -(2.0 / 3 + z * (1.0 / 5 + z * (3.0 / 28 + z * (5.0 / 72)))) / (r * r2);
  } else {
    result.value = std::atan2(s, c) / s;
    bend = (c / r2 - result.value) / s2;
  }
  result.slope = edge.cross(cross) * bend + (d + e) / r2;
  return result;
}

}  // namespace

CageTriangle cageTriangle(const V3d& a, const V3d& b, const V3d& c) {
  const V3d cross = (b - a).cross(c - a);
  CageTriangle triangle{{a, b, c}, cross, cross.length(), 0, {}};
  triangle.normal = cross / triangle.doubleArea;
  triangle.diameter = std::max({(b - a).length(), (c - b).length(), (a - c).length()});
  for (std::size_t n = 0; n < 3; ++n) {
    const V3d& j = triangle.corners[(n + 1) % 3];
    const V3d& k = triangle.corners[(n + 2) % 3];
    triangle.slopes[n] = triangle.normal.cross(k - j) / triangle.doubleArea;
  }
  return triangle;
}

MeanValueWeights meanValueQuadrature(const CageTriangle& triangle, const V3d& x) {
  MeanValueWeights weights;
  weights.height = triangle.normal.dot(triangle.corners[0] - x);
  addQuadrature(triangle, x, triangle.corners, {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}, 0,
                weights.terms);
  return weights;
}

MeanValueWeights meanValueWeights(const CageTriangle& triangle, const V3d& x) {
  MeanValueWeights weights;
  std::array<V3d, 3> d, cross, edge;
  for (std::size_t n = 0; n < 3; ++n) d[n] = triangle.corners[n] - x;
  weights.height = triangle.normal.dot(d[0]);
  const double height = std::abs(weights.height);
  const double nearest = std::sqrt(std::min({d[0].length2(), d[1].length2(), d[2].length2()}));
  if (nearest > (kFarRatio + 1) * triangle.diameter) return meanValueQuadrature(triangle, x);
  // The distance from the triangle is at most that from a corner.
  if (height < kFlatRatio * nearest) {
    const auto foot =
        closestOnTriangle(x, triangle.corners[0], triangle.corners[1], triangle.corners[2]);
    if (foot.part < 6 && height < kFlatRatio * (foot.point - x).length())
      return meanValueQuadrature(triangle, x);
  }
  // w_i height = C_i · m / |n|, where m = ½ Σ θ_k C_k / |C_k| and C_i is the cross product of the
  // vectors to the other corners.
  weights.isScaled = true;
  std::array<Sloped, 3> angle;
  for (std::size_t n = 0; n < 3; ++n) {
    const V3d &j = d[(n + 1) % 3], &k = d[(n + 2) % 3];
    // By the shorter vector and the edge, which cancels least.
    edge[n] = triangle.corners[(n + 1) % 3] - triangle.corners[(n + 2) % 3];
    cross[n] = j.length2() < k.length2() ? edge[n].cross(j) : edge[n].cross(k);
    angle[n] = angleOverSine(j, k, cross[n], edge[n]);
  }
  const double scale = 0.5 / triangle.doubleArea;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double dot = cross[i].dot(cross[k]);
      weights.terms[i].value += scale * angle[k].value * dot;
      weights.terms[i].slope +=
          (angle[k].slope * dot +
           (edge[i].cross(cross[k]) + edge[k].cross(cross[i])) * angle[k].value) *
          scale;
    }
  return weights;
}

GreenWeights greenWeights(const CageTriangle& triangle, const V3d& x) {
  std::array<V3d, 3> d;
  std::array<double, 3> r;
  for (std::size_t n = 0; n < 3; ++n) {
    d[n] = triangle.corners[n] - x;
    r[n] = d[n].length();
  }
  const V3d& normal = triangle.normal;
  const double height = normal.dot(d[0]);
  double volume = d[0].dot(d[1].cross(d[2]));
  const double base =
      r[0] * r[1] * r[2] + d[0].dot(d[1]) * r[2] + d[1].dot(d[2]) * r[0] + d[2].dot(d[0]) * r[1];
  // Rounding errors must not put a point of the triangle outside.
  if (std::abs(height) <= kOnPlane * triangle.diameter) volume = std::abs(volume);
  const double solid = 2 * std::atan2(volume, base);
  V3d solidSlope(0), flow(0);  // gradient of the solid angle; Σ ν L over the edges
  double potential = -height * solid;
  std::array<double, 3> logarithm;
  std::array<V3d, 3> across, logarithmSlope;
  for (std::size_t n = 0; n < 3; ++n) {
    const std::size_t j = n, k = (n + 1) % 3;
    const V3d edge = triangle.corners[k] - triangle.corners[j];
    const double length = edge.length(), sum = r[j] + r[k];
    across[n] = edge.cross(normal) / length;  // in the plane, outwards
    // (sum − length) (sum + length) = 2 (r_j r_k + d_j · d_k)
    const double gap = 2 * (r[j] * r[k] + d[j].dot(d[k]));
    const double ratio = (sum + length) * (sum + length) / gap;
    const bool isOnEdge = !(gap > 0) || !std::isfinite(ratio);
    logarithm[n] = isOnEdge ? 0 : std::log(ratio);
    logarithmSlope[n] = isOnEdge ? V3d(0) : (d[j] / r[j] + d[k] / r[k]) * (2 * length / gap);
    flow += across[n] * logarithm[n];
    potential += across[n].dot(d[j]) * logarithm[n];
    if (!isOnEdge) solidSlope += d[j].cross(d[k]) * (2 * sum / (r[j] * r[k] * gap));
  }
  constexpr double kShare = 1 / (4 * std::numbers::pi);
  GreenWeights weights;
  weights.normal = {potential * kShare, (normal * solid - flow) * kShare};
  for (std::size_t i = 0; i < 3; ++i) {
    // The linear function at the foot of x in the plane.
    const double hat = 1 - triangle.slopes[i].dot(d[i]);
    const double along = triangle.slopes[i].dot(flow);
    V3d slope = triangle.slopes[i] * solid + solidSlope * hat + normal * along;
    for (std::size_t n = 0; n < 3; ++n)
      slope -= logarithmSlope[n] * (height * triangle.slopes[i].dot(across[n]));
    weights.corners[i] = {(hat * solid - height * along) * kShare, slope * kShare};
  }
  return weights;
}

}  // namespace levelset::cage
