#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>
#include <limits>
#include <vector>

#include "levelset/eikonal/upwind.h"
#include "levelset/geometry/point_tree.h"

namespace levelset::eikonal {

/// The time straight away from a point source, T0 = slowness |x − s|, as upwind differences see it.
/// Its curvature is infinite at the source, so they lose there what no resolution brings back; but
/// what they get wrong is known, and what is left of the time, T − T0, is smooth [Treister16].
struct StraightTime {
  /// Half a voxel, and what rounding may tell apart of two neighbours as far from the source.
  static constexpr double kLevel = 0.51;

  openvdb::Vec3d away;  ///< x − s, voxels
  double slowness = 0;  ///< 0: none is taken apart

  /// How far a time may come before that of a neighbour it was made from: where the front runs
  /// along an axis, what is upwind is not known for sure, and T0 makes up for it.
  [[nodiscard]] double slack() const { return 0.25 * slowness; }

  /// What a difference on the grid points x, x + d, x + 2 d, with d a step along the axis, lacks
  /// of the derivative of T0 along −d.
  [[nodiscard]] double missed(std::size_t axis, bool up, bool second) const {
    if (slowness == 0) return 0;
    const double along = up ? away[static_cast<int>(axis)] : -away[static_cast<int>(axis)];
    const double square = away.lengthSqr(), here = std::sqrt(square);
    if (along > here / 2) return 0;  // the front comes back: not straight from the source
    const double near = std::sqrt(square + 2 * along + 1);
    const double difference =
        second ? (3 * here - 4 * near + std::sqrt(square + 4 * along + 4)) / 2 : here - near;
    return slowness * (-along / here - difference);
  }
  /// The square of the derivative of T0 along an axis on which both neighbours are later: upwind
  /// differences take it for 0, but the source need not lie level with a grid point.
  [[nodiscard]] double level(std::size_t axis) const {
    const double a = away[static_cast<int>(axis)];
    return slowness == 0 || std::abs(a) > kLevel ? 0
                                                 : slowness * slowness * a * a / away.lengthSqr();
  }
};

/// The points that a front starts at, index space.
class PointSources {
 public:
  /// @param slowness  at each; kFar where nothing passes
  PointSources(std::vector<openvdb::Vec3d> positions, std::vector<double> slowness)
      : positions_(std::move(positions)), slowness_(std::move(slowness)), tree_(positions_) {}
  PointSources(const PointSources&) = delete;
  PointSources& operator=(const PointSources&) = delete;

  /// From the nearest of them. Where the front goes more than twice as fast as there, nothing: T0
  /// would bring in more than it takes away.
  [[nodiscard]] StraightTime straightTime(const openvdb::Coord& gridPoint, double slowness) const {
    const openvdb::Vec3d x = gridPoint.asVec3d();
    const std::uint32_t i =
        positions_.size() == 1 ? 0 : tree_.nearest(x, std::numeric_limits<double>::max());
    if (slowness_[i] > 2 * slowness || x == positions_[i]) return {};
    return {x - positions_[i], slowness_[i]};
  }

 private:
  std::vector<openvdb::Vec3d> positions_;
  std::vector<double> slowness_;
  PointTree tree_;
};

}  // namespace levelset::eikonal
