#pragma once

// For the .cpp files of levelset/emboss only.

#include <vector>

#include "levelset/geometry/search/overlap_tree.h"
#include "levelset/vdb.h"

namespace levelset::embossing {

/// Points in the order of the curve, of which neighbours are joined by line segments.
struct Polyline {
  std::vector<openvdb::Vec3d> points;
  bool isJoined = true;   ///< false: separate points without segments
  bool isClosed = false;  ///< true: a segment joins the last point to the first
};

/// Replaces a polyline by points on the uniform Catmull-Rom spline through its points. An
/// open spline is extended straight by one point at each end. Fewer than three points stay as they
/// are.
/// @param tolerance  largest distance between the spline and the segments, in the unit of the
/// points
[[nodiscard]] Polyline onSpline(const Polyline& line, double tolerance);

/// Line segment with its number; a separate point is a segment without length.
struct SegmentItem {
  using Number = double;
  static constexpr bool kHasExtent = true;
  Imath::V3d begin, end;
  std::uint32_t index;

  [[nodiscard]] ItemBox<double> box() const;
  [[nodiscard]] double centre(int axis) const { return begin[axis] + end[axis]; }
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const;
  [[nodiscard]] bool isSameAs(const SegmentItem& other) const {
    return begin == other.begin && end == other.end;
  }
};

/// Points or segments in a search tree, for distances.
class EmbossCurve {
 public:
  explicit EmbossCurve(const Polyline& line);

  /// Distance from a point to the curve, or `limit` if the curve is not nearer.
  [[nodiscard]] double distance(const openvdb::Vec3d& from, double limit) const;
  [[nodiscard]] const openvdb::BBoxd& bounds() const { return bounds_; }
  /// Sum of the lengths of the segments.
  [[nodiscard]] double length() const { return length_; }

 private:
  OverlapTree<SegmentItem> tree_;
  openvdb::BBoxd bounds_;
  double length_ = 0;
};

}  // namespace levelset::embossing
