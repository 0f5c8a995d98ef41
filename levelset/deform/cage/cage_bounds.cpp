#include "levelset/deform/cage/cage_bounds.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "levelset/deform/cage/cage_shared.h"
#include "levelset/geometry/closest_on_triangle.h"

namespace levelset::cage {
namespace {

using Imath::V3d;

/// Largest norms of the derivatives of the kernels at distance 1, as symmetric multilinear forms.
/// Their largest values are directional derivatives [Banach38], which are Gegenbauer polynomials of
/// the angle: of d·n / |d|⁴ by order 2 and 3, of d·n / |d|³ by order 3, and of 1 / |d| by order 3.
constexpr double kMeanValueSecond = 12, kMeanValueThird = 60, kDoubleThird = 24, kSingleThird = 6;
/// Step of the differences of derivatives, over the radius.
constexpr double kDifferenceStep = 0.01;
/// Largest radius of a ball over the distance of its centre from the cage.
constexpr double kMostBallReach = 0.4;
/// Allowance for rounding errors, over the values that are summed.
constexpr double kBoundRounding = 1e-11;

/// Bound of ∫ |y − c|^−k dA over a triangle at a distance: its area times the largest value, and
/// the integral over the part of its plane at least that far from c.
double inversePower(double area, double distance, int k) {
  const double power = std::pow(distance, -k);
  return std::min(area * power, 2 * std::numbers::pi * power * distance * distance / (k - 2));
}

Eigen::Matrix3d jacobianOf(const std::array<V3d, 3>& columns) {
  Eigen::Matrix3d m;
  for (int axis = 0; axis < 3; ++axis)
    for (int c = 0; c < 3; ++c) m(c, axis) = columns[static_cast<std::size_t>(axis)][c];
  return m;
}

V3d timesColumns(const std::array<V3d, 3>& columns, const V3d& x) {
  return columns[0] * x.x + columns[1] * x.y + columns[2] * x.z;
}

}  // namespace

BallBounds ballBounds(const CageDeformation& cage, const V3d& centre, double radius) {
  BallBounds bounds;
  bounds.least = -std::numeric_limits<double>::infinity();
  const std::size_t count = cage.triangles().size();
  thread_local std::vector<V3d> feet;
  thread_local std::vector<double> distances;
  feet.resize(count);
  distances.resize(count);
  const auto& parts = cage.parts();
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < count; ++t) {
    const CageTriangle& part = parts[t];
    feet[t] = closestOnTriangle(centre, part.corners[0], part.corners[1], part.corners[2]).point;
    distances[t] = (feet[t] - centre).length();
    nearest = std::min(nearest, distances[t]);
  }
  bounds.isNearCage = radius >= nearest;
  if (!(nearest > 0)) return bounds;
  if (radius > kMostBallReach * nearest) {
    bounds.centre = cage.jet(centre);
    return bounds;
  }
  const bool isGreen = cage.coordinates() == CageCoordinates::Green;
  Sloped total;
  bounds.centre = cage.jet(centre, &total);
  const DeformationJet& jet = bounds.centre;
  const auto& moved = cage.moved();
  const auto& rest = cage.rest();
  thread_local std::vector<V3d> offs;  // of the moved vertices from the affine map at the centre
  offs.resize(rest.size());
  double largest = 0;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    offs[n] = moved[n] - jet.position - timesColumns(jet.slopes, rest[n] - centre);
    largest = std::max(largest, moved[n].length() + rest[n].length());
  }
  double third = 0, totalSecond = 0;  // of the numerator N and of the total weight W
  for (std::size_t t = 0; t < count; ++t) {
    const CageTriangle& part = parts[t];
    const auto& corners = cage.triangles()[t];
    const double area = 0.5 * part.doubleArea, distance = distances[t];
    const double reach = 1 - radius / distance;  // points of the ball are at least that much nearer
    // The offset is a linear function on the triangle: its value at the foot, and its gradient.
    V3d atFoot(0);
    double squares = 0;
    std::array<V3d, 3> gradient = {V3d(0), V3d(0), V3d(0)};
    for (std::size_t n = 0; n < 3; ++n) {
      const V3d& off = offs[corners[n]];
      atFoot += off * (1 - part.slopes[n].dot(part.corners[n] - feet[t]));
      for (int axis = 0; axis < 3; ++axis)
        gradient[static_cast<std::size_t>(axis)] += off * part.slopes[n][axis];
    }
    for (const V3d& column : gradient) squares += column.length2();
    const double slope = std::sqrt(squares), value = atFoot.length();
    const double by2 = 1 / (reach * reach), by4 = by2 * by2;
    if (isGreen) {
      constexpr double kShare = 1 / (4 * std::numbers::pi);
      const double fourth = inversePower(area, distance, 4);
      third += kShare * kDoubleThird * by4 / reach *
               (value * inversePower(area, distance, 5) + slope * fourth);
      const V3d flux = cage.stretchedNormalOf(t) - timesColumns(jet.slopes, part.normal);
      third += kShare * kSingleThird * by4 * flux.length() * fourth;
    } else {
      const double fifth = inversePower(area, distance, 5);
      third +=
          kMeanValueThird * by4 * by2 * (value * inversePower(area, distance, 6) + slope * fifth);
      totalSecond += kMeanValueSecond * by4 / reach * fifth;
    }
  }
  const double weight = isGreen ? 1 : std::abs(total.value),
               weightSlope = isGreen ? 0 : total.slope.length();
  const double least = weight - radius * (weightSlope + 0.5 * radius * totalSecond);
  if (!(least > 0)) return bounds;
  // N, the deformation minus A times W, and its first derivatives vanish at the centre. One-sided
  // differences of the first derivatives give the second ones.
  const double step = kDifferenceStep * radius;
  double squares = 0;
  for (int axis = 0; axis < 3; ++axis) {
    V3d at = centre;
    at[axis] += step;
    Sloped beside{1, V3d(0)};
    const DeformationJet next = isGreen ? cage.jet(at) : cage.jet(at, &beside);
    const V3d off =
        next.position - jet.position - jet.slopes[static_cast<std::size_t>(axis)] * step;
    for (std::size_t a = 0; a < 3; ++a)
      squares += ((next.slopes[a] - jet.slopes[a]) * beside.value +
                  off * beside.slope[static_cast<int>(a)])
                     .length2();
  }
  const double second = std::sqrt(squares) / step + 0.5 * std::sqrt(3.0) * step * third;
  const double r2 = 0.5 * radius * radius, r3 = r2 * radius / 3;
  bounds.spread = (radius * second + r2 * third +
                   (r2 * second + r3 * third) / least * (weightSlope + radius * totalSecond)) /
                  least;
  bounds.spread += kBoundRounding * largest / nearest;
  const Eigen::Vector3d stretches = jacobianOf(jet.slopes).jacobiSvd().singularValues();
  bounds.isBounded = true;
  bounds.stretch = stretches[0] + bounds.spread;
  // Singular values change by at most the norm of the change, and the sign stays while the least
  // one does not vanish.
  if (jet.determinant() > 0 && stretches[2] > bounds.spread)
    bounds.least = (stretches[0] - bounds.spread) * (stretches[1] - bounds.spread) *
                   (stretches[2] - bounds.spread);
  return bounds;
}

}  // namespace levelset::cage
