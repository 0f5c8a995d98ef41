#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/point_field.h"
#include "levelset/points/field/point_winding.h"

namespace levelset::points {

/// Field of a cloud in the whole of space. Near the points it is a PointField. Farther than about
/// two spacings from them, it is the distance to the closest point, negative where the winding
/// number of the points exceeds 1/2 [Barill18]. So no part of the surface lies far from the points
/// but across holes, where the winding number is 1/2. Extrapolated planes and polynomials alone
/// have zeros far from the points, beside edges and between thin parts.
class SignedField {
 public:
  /// @param points  must outlive the field
  SignedField(const OrientedPoints& points, PointField near);

  /// Memory of one thread, for positions near each other.
  struct Memory {
    std::vector<Found> found = {};
    Imath::V3d at = Imath::V3d(0);  ///< position of the last winding number
    double winding = 0.5;
  };

  /// @param at  relative to OrientedPoints::centre
  [[nodiscard]] double value(const Imath::V3d& at, Memory& memory) const;
  [[nodiscard]] const OrientedPoints& points() const { return points_; }

 private:
  [[nodiscard]] double far(const Imath::V3d& at, double closest, Memory& memory) const;

  const OrientedPoints& points_;
  PointField near_;
  PointWinding winding_;
};

}  // namespace levelset::points
