#include "levelset/points/projection/candidates.h"

#include "levelset/geometry/perpendicular.h"

namespace levelset::points {
namespace {

/// Least cosine between the normals of a candidate and the frame. Below that across a sharp edge.
constexpr double kLeastCosine = -0.3;

}  // namespace

using Imath::V3d;

void LocalFrame::setNormal(const V3d& unit) {
  normal = unit;
  const auto [first, second] = tangents(unit);
  u = first;
  v = second;
}

const std::vector<FitCandidate>& CandidateSearch::find(std::uint32_t point, const LocalFrame& frame,
                                                       double reach) {
  ++search_;
  found_.assign(1, {point, V3d(0), frame.normal});
  seen_[point] = search_;
  const double limit = reach / frame.scale;
  for (std::size_t next = 0; next < found_.size(); ++next)
    for (const std::uint32_t to : graph_.neighbours(found_[next].point)) {
      if (seen_[to] == search_) continue;
      seen_[to] = search_;
      if ((positions_[to] - frame.origin).length2() > limit * limit) continue;
      const V3d& own = graph_.normals[to];
      const V3d normal = own.dot(found_[next].normal) < 0 ? -own : own;
      if (normal.dot(frame.normal) < kLeastCosine) continue;
      found_.push_back({to, frame.toLocal(positions_[to]), normal});
    }
  return found_;
}

}  // namespace levelset::points
