#include "levelset/distance/surface/closest_point.h"

#include <algorithm>
#include <cmath>

namespace levelset::eikonal {
namespace {

using openvdb::Vec3d;

constexpr int kMaxIterations = 12;
constexpr double kFootReach = 2;    // largest distance of the search from its start, voxels
constexpr double kLongestStep = 1;  // longest Newton step, voxels
// The iteration stops when the estimated error after a step falls below this, in voxels. The
// estimate is the cube of the step's length times the square of the curvature.
constexpr double kTolerance = 2e-5;
// Largest error along the surface after two steps with the same second derivatives, voxels. It
// changes the distance by half its square times the sum of curvature and inverse distance.
constexpr double kTangentTolerance = 1e-3;
constexpr double kLongestLastStep = 0.6;  // the iteration ends only after a shorter step, voxels
// A step that undoes more than this share of the step before is halved.
constexpr double kReversal = 0.3;
// Lower bound of the second derivative, along the surface, of half the squared distance from the
// query point. The derivative is 1 on a plane.
constexpr double kLeastCurvature = 0.1;

/// Computes two unit vectors perpendicular to a unit vector and to each other.
void tangents(const Vec3d& n, Vec3d& t1, Vec3d& t2) {
  // [Duff17], without a branch that loses precision.
  const double sign = std::copysign(1.0, n.z());
  const double a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  t1 = Vec3d(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
  t2 = Vec3d(b, sign + n.y() * n.y() * a, -n.y());
}

struct NewtonStep {
  Vec3d along;         ///< step vector, voxels
  double length = 0;   ///< length of the step, voxels
  double remains = 0;  ///< estimated distance to the solution after the step, voxels
};

/// Computes one Newton step of the constrained problem. Along the normal, the step leads to φ = 0;
/// along the tangents, to the point whose distance from the query point is stationary. The normal
/// part includes the second-order term.
/// @param toFrom  vector from the current point to the query point, voxels
NewtonStep newtonStep(const Jet& jet, double slope, const Vec3d& toFrom) {
  const Vec3d n = jet.gradient / slope;
  const double along = -jet.value / slope;
  const double lambda = (toFrom.dot(n) - along) / slope;
  Vec3d t1, t2;
  tangents(n, t1, t2);
  const Vec3d h1 = jet.hessianTimes(t1), h2 = jet.hessianTimes(t2);
  double a11 = 1 + lambda * h1.dot(t1), a12 = lambda * h1.dot(t2), a22 = 1 + lambda * h2.dot(t2);
  const double b1 = toFrom.dot(t1) - lambda * along * h1.dot(n);
  const double b2 = toFrom.dot(t2) - lambda * along * h2.dot(n);
  // If the query point lies beyond the centre of curvature, the stationary point is a maximum of
  // the distance. Increases the eigenvalues so that the step leads to a minimum.
  const double mean = (a11 + a22) / 2, half = (a11 - a22) / 2;
  const double least = mean - std::sqrt(half * half + a12 * a12);
  if (least < kLeastCurvature) {
    a11 += kLeastCurvature - least;
    a22 += kLeastCurvature - least;
  }
  const double scale = 1 / (a11 * a22 - a12 * a12);
  NewtonStep step;
  step.along =
      n * along + t1 * (scale * (a22 * b1 - a12 * b2)) + t2 * (scale * (a11 * b2 - a12 * b1));
  const double squared = step.along.lengthSqr();
  step.length = std::sqrt(squared);
  const double curvature = (h1.length() + h2.length()) / slope;
  step.remains = curvature * curvature * squared * step.length;
  if (step.length <= kLongestLastStep)
    step.along -= n * (step.along.dot(jet.hessianTimes(step.along)) / (2 * slope));
  return step;
}

}  // namespace

Foot closestPoint(const DenseBlock& block, const Vec3d& from, const Vec3d& start) {
  Foot foot{start, (from - start).length(), false, false};
  Vec3d y = start, last(0);
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!DenseBlock::contains(y)) return foot;
    const Jet jet = block.jet(y);
    const double slope = jet.gradient.length();
    if (!(slope > 0)) return foot;
    const NewtonStep step = newtonStep(jet, slope, from - y);
    if (!std::isfinite(step.length)) return foot;
    Vec3d move =
        step.length > kLongestStep ? step.along * (kLongestStep / step.length) : step.along;
    // The second derivatives jump between cells, so that full steps can cycle around the solution.
    if (move.dot(last) < -kReversal * last.lengthSqr()) move *= 0.5;
    y += move;
    last = move;
    if ((y - start).lengthSqr() > kFootReach * kFootReach)
      return Foot{y, foot.distance, false, true};
    if (step.length <= kLongestLastStep && step.remains < kTolerance)
      return Foot{y, (from - y).length(), true, false};
  }
  return foot;
}

Foot closestPointByOneStep(const Jet& jet, const Vec3d& from, const Vec3d& start, double longest) {
  const double slope = jet.gradient.length();
  if (!(slope > 0)) return {};
  const NewtonStep step = newtonStep(jet, slope, from - start);
  if (!(step.length <= longest)) return {};
  const Vec3d point = start + step.along;
  return {point, (from - point).length(), true, false};
}

Foot closestPointByTwoSteps(DenseBlockCache& blocks, const Jet& jet, const Vec3d& from,
                            const Vec3d& start) {
  const double slope = jet.gradient.length();
  if (!(slope > 0)) return {};
  const NewtonStep first = newtonStep(jet, slope, from - start);
  if (!(first.length <= kLongestLastStep)) return {};
  Vec3d point = start + first.along;
  if (first.remains < kTolerance) return {point, (from - point).length(), true, false};

  const DenseBlock& block = blocks.around(point);
  Jet next = jet;
  block.slope(point - block.origin().asVec3d(), next);
  const double nextSlope = next.gradient.length();
  if (!(nextSlope > 0)) return {};
  const NewtonStep second = newtonStep(next, nextSlope, from - point);
  // Both steps use the same second derivatives, so the error decreases by the same factor each.
  const double remains = second.length * second.length / first.length;
  if (!(second.length < first.length) || !(remains < kTangentTolerance)) return {};
  point += second.along;
  return {point, (from - point).length(), true, false};
}

bool changesSignAround(const DenseBlock& block, const Vec3d& point) {
  // A curved surface can bulge this far, in voxels, through the face of a cell before a corner
  // changes sign.
  constexpr double kBulge = 0.25;
  int low[3], high[3];
  for (int i = 0; i < 3; ++i) {
    low[i] = static_cast<int>(std::floor(point[i] - kBulge));
    high[i] = static_cast<int>(std::floor(point[i] + kBulge)) + 1;
  }
  const bool inside = block.at(low[0], low[1], low[2]) < 0;
  for (int x = low[0]; x <= high[0]; ++x)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int z = low[2]; z <= high[2]; ++z)
        if ((block.at(x, y, z) < 0) != inside) return true;
  return false;
}

}  // namespace levelset::eikonal
