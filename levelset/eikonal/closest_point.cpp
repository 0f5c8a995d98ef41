#include "levelset/eikonal/closest_point.h"

#include <algorithm>
#include <cmath>

namespace levelset::eikonal {
namespace {

using openvdb::Vec3d;

constexpr int kMaxIterations = 8;
constexpr double kReach = 2;             // voxels from the start
constexpr double kLongestStep = 1;       // voxels
constexpr double kLastStep = 0.01;       // voxels: the step after it would be its square
constexpr double kLeastCurvature = 0.1;  // of the distance along the surface, against 1 on a plane

/// Two unit vectors perpendicular to a unit vector and to each other.
void tangents(const Vec3d& n, Vec3d& t1, Vec3d& t2) {
  // Duff et al. 2017, without a branch that loses precision.
  const double sign = std::copysign(1.0, n.z());
  const double a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  t1 = Vec3d(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
  t2 = Vec3d(b, sign + n.y() * n.y() * a, -n.y());
}

/// One Newton step of the constrained problem: along the normal to φ = 0, along the tangents to
/// where the distance to `from` is stationary.
Vec3d newtonStep(const Jet& jet, double slope, const Vec3d& toFrom) {
  const Vec3d n = jet.gradient / slope;
  const double along = -jet.value / slope;
  const double lambda = (toFrom.dot(n) - along) / slope;
  Vec3d t1, t2;
  tangents(n, t1, t2);
  const Vec3d h1 = jet.hessianTimes(t1), h2 = jet.hessianTimes(t2);
  double a11 = 1 + lambda * h1.dot(t1), a12 = lambda * h1.dot(t2), a22 = 1 + lambda * h2.dot(t2);
  const double b1 = toFrom.dot(t1) - lambda * along * h1.dot(n);
  const double b2 = toFrom.dot(t2) - lambda * along * h2.dot(n);
  // Past the centre of curvature the stationary point is a maximum: lift the eigenvalues.
  const double mean = (a11 + a22) / 2;
  const double least = mean - std::hypot((a11 - a22) / 2, a12);
  if (least < kLeastCurvature) {
    a11 += kLeastCurvature - least;
    a22 += kLeastCurvature - least;
  }
  const double determinant = a11 * a22 - a12 * a12;
  return n * along + t1 * ((a22 * b1 - a12 * b2) / determinant) +
         t2 * ((a11 * b2 - a12 * b1) / determinant);
}

}  // namespace

Foot closestPoint(const DenseBlock& block, const Vec3d& from, const Vec3d& start) {
  Foot foot{start, (from - start).length(), false};
  Vec3d y = start;
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!DenseBlock::contains(y)) return foot;
    const Jet jet = block.jet(y);
    const double slope = jet.gradient.length();
    if (!(slope > 0)) return foot;
    Vec3d step = newtonStep(jet, slope, from - y);
    const double length = step.length();
    if (!std::isfinite(length)) return foot;
    if (length > kLongestStep) step *= kLongestStep / length;
    y += step;
    if ((y - start).lengthSqr() > kReach * kReach) return foot;
    if (length < kLastStep) return Foot{y, (from - y).length(), true};
  }
  return foot;
}

}  // namespace levelset::eikonal
