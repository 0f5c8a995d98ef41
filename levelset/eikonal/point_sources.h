#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>
#include <limits>
#include <vector>

#include "levelset/eikonal/upwind.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Straight time T0 = slowness · |x − s| from a point source s to a grid point x, at the slowness
/// of the source. T0 has infinite curvature at the source, so differences of the arrival time T
/// lose accuracy there at any resolution. The solver corrects them by the error of the same
/// differences of T0, which is known exactly: T − T0 is smooth [Treister16].
struct StraightTime {
  /// Largest distance, voxels, of the source from the grid point along an axis for which level() is
  /// not 0. Half a voxel, with a margin for rounding when two neighbours are equally far from the
  /// source.
  static constexpr double kLevel = 0.51;

  openvdb::Vec3d away;  ///< x − s, voxels
  double slowness = 0;  ///< slowness at the source; 0: no correction

  /// Returns the largest amount by which the time of a grid point may precede that of a neighbour
  /// from which it is computed. Where the front runs along an axis, the choice of the upwind
  /// neighbour is uncertain, and the correction by T0 compensates for it.
  [[nodiscard]] double slack() const { return 0.25 * slowness; }

  /// Returns the error of a one-sided difference of T0: the derivative along −d, minus the
  /// difference on x, x + d and, if `second`, x + 2 d. Here d is one voxel along the axis, in
  /// positive direction if `up`.
  [[nodiscard]] double missed(std::size_t axis, bool up, bool second) const {
    if (slowness == 0) return 0;
    const double along = up ? away[static_cast<int>(axis)] : -away[static_cast<int>(axis)];
    const double square = away.lengthSqr(), here = std::sqrt(square);
    if (along > here / 2) return 0;  // x + d is farther from the source than x: a detour
    const double near = std::sqrt(square + 2 * along + 1);
    const double difference =
        second ? (3 * here - 4 * near + std::sqrt(square + 4 * along + 4)) / 2 : here - near;
    return slowness * (-along / here - difference);
  }
  /// Returns the square of the derivative of T0 along an axis on which both neighbours have later
  /// times. Upwind differences take this derivative as 0, but it is not 0 if the source lies up to
  /// half a voxel away along the axis.
  [[nodiscard]] double level(std::size_t axis) const {
    const double a = away[static_cast<int>(axis)];
    return slowness == 0 || std::abs(a) > kLevel ? 0
                                                 : slowness * slowness * a * a / away.lengthSqr();
  }
};

/// Points from which a front starts, index space.
class PointSources {
 public:
  /// @param slowness  slowness at each point; kFar where the front cannot pass
  PointSources(std::vector<openvdb::Vec3d> positions, std::vector<double> slowness)
      : positions_(std::move(positions)),
        slowness_(std::move(slowness)),
        tree_(makePointSearch(positions_)) {}
  PointSources(const PointSources&) = delete;
  PointSources& operator=(const PointSources&) = delete;

  /// Returns the straight time from the nearest source. Returns one without correction at the
  /// source itself, and where the front is more than twice as fast as at the source: T0 would then
  /// add more error than it removes.
  [[nodiscard]] StraightTime straightTime(const openvdb::Coord& gridPoint, double slowness) const {
    const openvdb::Vec3d x = gridPoint.asVec3d();
    const std::uint32_t i =
        positions_.size() == 1
            ? 0
            : tree_.closest(toImath(x), std::numeric_limits<double>::infinity()).index;
    if (slowness_[i] > 2 * slowness || x == positions_[i]) return {};
    return {x - positions_[i], slowness_[i]};
  }

 private:
  std::vector<openvdb::Vec3d> positions_;
  std::vector<double> slowness_;
  PointSearch tree_;
};

}  // namespace levelset::eikonal
