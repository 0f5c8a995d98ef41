#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/distance/moved/crease_distances.h"
#include "levelset/distance/nearest/distance_request.h"
#include "levelset/distance/nearest/propagate.h"
#include "levelset/distance/surface/zero_set.h"

namespace levelset::eikonal {

/// Corrects the distances to a surface minus a shift, so that they are the distances to the moved
/// surface. Wrong values lie on the side of the moved surface on which the old surface is, beside
/// creases in which moved parts meet. A value φ is correct if the point x − φ ∇φ/|∇φ| lies on the
/// moved surface. MovedSurface computes the other values. Where it fails, the distance to the zero
/// set of the corrected field is computed. Works slab by slab (all leaf blocks with the same x).
class MeetingParts {
 public:
  /// Keeps references to all parameters.
  /// @param surface  surface before it moves
  /// @param field    distances minus the shift, in a band of request.halfWidth around the moved
  ///                 surface
  MeetingParts(const ZeroSet& surface, Polishers& polishers, const DistanceRequest& request,
               openvdb::FloatGrid& field)
      : request_(request), field_(field), distances_(surface, polishers, request) {}

  /// Distance along each axis, voxels, within which a search reads nearest surface points.
  [[nodiscard]] static double reachOfSearch(const DistanceRequest& request) {
    return MovedSurface::reach(request.shift, request.halfWidth);
  }
  /// As above, for the field before the shift.
  [[nodiscard]] static double fieldReachOfSearch(const DistanceRequest& request) {
    return MovedSurface::fieldReach(request.shift, request.halfWidth);
  }

  /// Searches the wrong values of a slab. Slabs must come in ascending order.
  /// @pre the slab and those beside it in the field are complete
  void search(int slab, const std::vector<const NearestPoints::Block*>& blocks);
  /// Corrects most of the wrong values of the slabs first to last, see CreaseDistances::resolve().
  void resolve(int first, int last) { distances_.resolve(first, last, field_); }
  /// Corrects the other values.
  void finish();

 private:
  const DistanceRequest& request_;
  openvdb::FloatGrid& field_;
  CreaseDistances distances_;
  openvdb::MaskTree wrong_;
};

}  // namespace levelset::eikonal
