#pragma once

#include <Imath/ImathVec.h>

#include <atomic>
#include <cstddef>
#include <memory>

#include "levelset/molecules/ball_union.h"

namespace levelset {

/// The solvent-excluded solid of a set of atoms [Connolly83]: all points that no ball of a probe
/// covers whose centre lies outside the balls with radii that are larger by that of the probe.
///
/// Let e be the distance from a point inside the larger balls to their boundary. The solid is where
/// e is at least the radius of the probe, and there e less this radius is the distance to its
/// surface. Outside, the surface is met along the line from the closest point of the boundary,
/// unless probes at other places cover that end of the line. Then the closest point lies on an edge
/// or a corner of the surface, where probes at several places meet. It is the closest point outside
/// a few probes. Those that cover it are added until there is none.
class ExcludedSurface {
 public:
  /// @param accessible  union of the larger balls, with a depth above `probe`
  /// @param probe  radius of the probe, world units, positive
  ExcludedSurface(BallUnion accessible, double probe);

  /// Signed distance from the surface, negative inside. Exact outside, and inside up to the depth
  /// of the union less the probe.
  [[nodiscard]] double distance(const Imath::V3d& point) const;
  [[nodiscard]] const BallUnion& accessible() const { return accessible_; }
  /// Number of distances so far that are lower bounds: outside, beside edges where more probes meet
  /// than are tried.
  [[nodiscard]] std::size_t unfinished() const { return *unfinished_; }

 private:
  [[nodiscard]] double distanceToEdge(const Imath::V3d& point, const BallUnion::Foot& first,
                                      const BallUnion::Foot& second) const;

  BallUnion accessible_;
  double probe_;
  std::shared_ptr<std::atomic<std::size_t>> unfinished_ =
      std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace levelset
