#include "levelset/emboss/emboss_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

ItemBox<double> SegmentItem::box() const {
  ItemBox<double> box{begin, begin};
  box.extendBy({end, end});
  return box;
}

double SegmentItem::squaredDistance(const Imath::V3d& from) const {
  const Imath::V3d along = end - begin, to = from - begin;
  const double squared = along.dot(along);
  const double t = squared > 0 ? std::clamp(to.dot(along) / squared, 0.0, 1.0) : 0;
  const Imath::V3d gap = to - along * t;
  return gap.dot(gap);
}

EmbossCurve::EmbossCurve(const Polyline& line) {
  const std::vector<Vec3d>& p = line.points;
  std::vector<SegmentItem> segments;
  const auto add = [&](const Vec3d& begin, const Vec3d& end) {
    segments.push_back({toImath(begin), toImath(end), static_cast<std::uint32_t>(segments.size())});
    length_ += (end - begin).length();
  };
  if (!line.isJoined || p.size() == 1) {
    for (const Vec3d& point : p) add(point, point);
  } else {
    for (std::size_t i = 0; i + 1 < p.size(); ++i) add(p[i], p[i + 1]);
    if (line.isClosed) add(p.back(), p.front());
  }
  for (const Vec3d& point : p) bounds_.expand(point);
  tree_ = OverlapTree<SegmentItem>(std::move(segments));
}

double EmbossCurve::distance(const Vec3d& from, double limit) const {
  const FoundItem found = tree_.closest(toImath(from), limit * limit);
  return found.isValid() ? std::sqrt(found.squared) : limit;
}

}  // namespace levelset::embossing
