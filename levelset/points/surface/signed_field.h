#pragma once

// Internal header of levelset: public headers must not include it.

#include <optional>

#include "levelset/points/field/point_field.h"
#include "levelset/points/surface/point_winding.h"
#include "levelset/points/surface/sample_field.h"

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

  /// Values of a cube, as SampledField.
  /// @param at  relative to OrientedPoints::centre
  void values(const CubePositions& at, CubeValues& values, FieldMemory& memory, double bound) const;

 private:
  /// @param found  closest points of the position
  [[nodiscard]] double value(const Imath::V3d& at, const std::vector<FoundItem>& found,
                             FieldMemory& memory) const;
  /// Value of all positions in a ball, if it is the same but for values beyond the bound.
  [[nodiscard]] std::optional<double> commonValue(const Imath::V3d& centre, double radius,
                                                  const std::vector<FoundItem>& found,
                                                  FieldMemory& memory, double bound) const;
  [[nodiscard]] double far(const Imath::V3d& at, double closest, FieldMemory& memory) const;

  const OrientedPoints& points_;
  PointField near_;
  double reach_;  ///< size of the near field, relative to that of few neighbours
  PointWinding winding_;
};

}  // namespace levelset::points
