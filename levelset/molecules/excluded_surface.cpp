#include "levelset/molecules/excluded_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace levelset {
namespace {

using Imath::V3d;

// Errors of distances that count as none, as a share of the probe's radius.
constexpr double kTolerance = 1e-10;
constexpr int kMostSteps = 100;
constexpr std::size_t kMostProbes = 12;

/// Finds the closest point to `from` that lies in none of some balls of one radius. It lies on one
/// sphere, on the circle of two, or in a corner of three.
class ClosestOutside {
 public:
  ClosestOutside(const std::vector<V3d>& centres, double radius, const V3d& from)
      : centres_(centres), radius_(radius), from_(from), at_(from) {
    for (std::size_t i = 0; i < centres.size(); ++i) {
      onSphere(centres[i]);
      for (std::size_t j = i + 1; j < centres.size(); ++j) {
        onCircle(centres[i], centres[j]);
        for (std::size_t k = j + 1; k < centres.size(); ++k)
          inCorners(centres[i], centres[j], centres[k]);
      }
    }
  }
  [[nodiscard]] bool isFound() const { return least_ < std::numeric_limits<double>::infinity(); }
  [[nodiscard]] const V3d& point() const { return at_; }

 private:
  void onSphere(const V3d& centre) {
    const V3d away = from_ - centre;
    const double length = away.length();
    if (length > 0) offer(centre + away * (radius_ / length));
  }
  void onCircle(const V3d& a, const V3d& b) {
    const V3d between = b - a, middle = (a + b) / 2;
    const double squared = between.length2(), circle = radius_ * radius_ - squared / 4;
    if (!(squared > 0) || !(circle > 0)) return;
    V3d away = from_ - middle;
    away -= between * (away.dot(between) / squared);
    const double length = away.length();
    if (length > 0) offer(middle + away * (std::sqrt(circle) / length));
  }
  void inCorners(const V3d& a, const V3d& b, const V3d& c) {
    const V3d u = b - a, v = c - a, normal = u.cross(v);
    const double squared = normal.length2();
    if (!(squared > 0)) return;
    // Centre of the circle through the three centres.
    const V3d middle =
        (v.cross(normal) * u.length2() + normal.cross(u) * v.length2()) / (2 * squared);
    const double height = radius_ * radius_ - middle.length2();
    if (!(height > 0)) return;
    const V3d up = normal * std::sqrt(height / squared);
    offer(a + middle + up);
    offer(a + middle - up);
  }
  void offer(const V3d& x) {
    const double squared = (x - from_).length2();
    if (!(squared < least_)) return;
    const double inner = radius_ * (1 - kTolerance / 8);
    for (const V3d& centre : centres_)
      if ((x - centre).length2() < inner * inner) return;
    least_ = squared;
    at_ = x;
  }

  const std::vector<V3d>& centres_;
  double radius_;
  V3d from_, at_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

ExcludedSurface::ExcludedSurface(BallUnion accessible, double probe)
    : accessible_(std::move(accessible)), probe_(probe) {}

double ExcludedSurface::distance(const V3d& point) const {
  const BallUnion::Foot foot = accessible_.closest(point);
  const double inside = -foot.distance;
  if (inside <= 0 || !foot.isExact || inside >= probe_) return probe_ - inside;
  const double tolerance = kTolerance * probe_;
  V3d along = point - foot.point;
  if (inside < 1e-7 * probe_) {  // on the boundary: inwards
    const V3d centre = foot.isOnArc ? accessible_.arcs()[foot.feature].centre + accessible_.origin()
                                    : accessible_.ball(foot.feature).centre;
    along = centre - foot.point;
  }
  const double length = along.length();
  if (!(length > 0)) return probe_ - inside;
  const V3d end = foot.point + along * (probe_ / length);
  const BallUnion::Foot other = accessible_.closest(end);
  if (-other.distance >= probe_ - tolerance) return probe_ - inside;
  return distanceToEdge(point, foot, other);
}

double ExcludedSurface::distanceToEdge(const V3d& point, const BallUnion::Foot& first,
                                       const BallUnion::Foot& second) const {
  // Centres of probes. The closest point outside some probes is not beyond that outside all of
  // them. So it is the result when no other probe covers it.
  std::vector<V3d> probes{first.point, second.point};
  double least = probe_ + first.distance;
  for (int step = 0; step < kMostSteps; ++step) {
    const ClosestOutside closest(probes, probe_, point);
    if (!closest.isFound()) break;  // rounding
    const V3d& at = closest.point();
    least = std::max(least, (at - point).length());
    const BallUnion::Foot found = accessible_.closest(at);
    if (-found.distance >= probe_ * (1 - kTolerance)) return least;
    if (probes.size() >= kMostProbes) {
      const auto farthest = std::max_element(probes.begin(), probes.end(), [&](auto& a, auto& b) {
        return (a - at).length2() < (b - at).length2();
      });
      probes.erase(farthest);
    }
    // A probe outside the larger balls covers the point, too.
    probes.push_back(found.distance > 0 ? at : found.point);
  }
  ++*unfinished_;
  return least;
}

}  // namespace levelset
