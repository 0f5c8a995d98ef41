#include "levelset/emboss/emboss_curve.h"

#include <algorithm>
#include <cmath>

namespace levelset::embossing {

using openvdb::Vec3d;

Polyline onSpline(const Polyline& line, double tolerance) {
  const std::vector<Vec3d>& p = line.points;
  const auto count = static_cast<std::ptrdiff_t>(p.size());
  if (!line.isJoined || count < 3) return line;
  const auto at = [&](std::ptrdiff_t i) -> Vec3d {
    if (line.isClosed) return p[static_cast<std::size_t>((i + count) % count)];
    if (i < 0) return 2 * p[0] - p[1];
    if (i >= count) return 2 * p[p.size() - 1] - p[p.size() - 2];
    return p[static_cast<std::size_t>(i)];
  };
  Polyline result{{}, true, line.isClosed};
  const std::ptrdiff_t spans = line.isClosed ? count : count - 1;
  for (std::ptrdiff_t i = 0; i < spans; ++i) {
    const Vec3d a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
    // The second derivative is linear in t. A chord over a step of t deviates from the curve by at
    // most |second derivative| × step² / 8.
    const double bend =
        std::max((2 * a - 5 * b + 4 * c - d).length(), (-a + 4 * b - 5 * c + 2 * d).length());
    constexpr double kMostSteps = 1e4;
    const int steps =
        static_cast<int>(std::clamp(std::ceil(std::sqrt(bend / (8 * tolerance))), 1.0, kMostSteps));
    for (int k = 0; k < steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      result.points.push_back(
          b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * b - a - 3 * c + d))));
    }
  }
  if (!line.isClosed) result.points.push_back(p.back());
  return result;
}

EmbossCurve::EmbossCurve(const Polyline& line) {
  const std::vector<Vec3d>& p = line.points;
  if (!line.isJoined || p.size() == 1) {
    for (const Vec3d& point : p) segments_.push_back({point, point});
  } else {
    for (std::size_t i = 0; i + 1 < p.size(); ++i) segments_.push_back({p[i], p[i + 1]});
    if (line.isClosed) segments_.push_back({p.back(), p.front()});
  }
  for (const Vec3d& point : p) bounds_.expand(point);
  tree_ = BoxTree(
      segments_.size(),
      [&](std::uint32_t i, Vec3d& low, Vec3d& high) {
        for (const Vec3d& end : {segments_[i].begin, segments_[i].end}) {
          low = openvdb::math::minComponent(low, end);
          high = openvdb::math::maxComponent(high, end);
        }
      },
      [&](std::uint32_t i, int axis) { return segments_[i].begin[axis] + segments_[i].end[axis]; });
}

double EmbossCurve::squaredDistance(const Vec3d& from, const Segment& segment) {
  const Vec3d along = segment.end - segment.begin, to = from - segment.begin;
  const double squared = along.lengthSqr();
  const double t = squared > 0 ? std::clamp(to.dot(along) / squared, 0.0, 1.0) : 0;
  return (to - t * along).lengthSqr();
}

double EmbossCurve::distance(const Vec3d& from, double limit) const {
  double squared = limit * limit;
  const double before = squared;
  tree_.search(from, squared, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i)
      squared = std::min(squared, squaredDistance(from, segments_[tree_.order()[i]]));
  });
  return squared < before ? std::sqrt(squared) : limit;
}

double EmbossCurve::length() const {
  double sum = 0;
  for (const Segment& segment : segments_) sum += (segment.end - segment.begin).length();
  return sum;
}

}  // namespace levelset::embossing
