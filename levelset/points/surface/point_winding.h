#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/oriented_points.h"

namespace levelset::points {

/// Winding number of a cloud: the sum over the points of the solid angle of a small disc
/// [Barill18]. About 1 inside a closed cloud, 0 outside, and 1/2 in the middle of a hole. Not
/// defined within about a spacing of the points. A tree groups the points; far groups enter by
/// their dipole and its first moment.
class PointWinding {
 public:
  /// @param points  in the order of a search tree; must outlive this object
  explicit PointWinding(const OrientedPoints& points);

  /// Winding number at a position relative to OrientedPoints::centre.
  [[nodiscard]] double at(const Imath::V3d& position) const;

 private:
  struct Group {
    Imath::V3d centre = Imath::V3d(0), dipole = Imath::V3d(0);  ///< dipole: Σ area · normal
    /// Row k: Σ area · normal · (position − centre)ₖ.
    std::array<Imath::V3d, 3> moment{Imath::V3d(0), Imath::V3d(0), Imath::V3d(0)};
    double squaredRadius = 0;
  };
  void build(std::size_t group, std::size_t begin, std::size_t end);
  [[nodiscard]] double far(const Group& group, const Imath::V3d& away, double squared) const;

  const OrientedPoints& points_;
  std::size_t firstLeaf_ = 0;  ///< group n has the children 2n + 1 and 2n + 2
  std::vector<Group> groups_;
};

}  // namespace levelset::points
