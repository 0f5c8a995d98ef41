#pragma once

// Private to unions of balls and rods: curves where two of their surfaces meet.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <vector>

namespace levelset {

/// A ball (both ends equal), or a rod with round ends.
struct RodShape {
  Imath::V3d from{0}, to{0};
  double radius = 0;

  [[nodiscard]] bool isBall() const { return from == to; }
  /// Closest point of the axis.
  [[nodiscard]] Imath::V3d onAxis(const Imath::V3d& point) const;
  /// Signed distance, negative inside.
  [[nodiscard]] double distance(const Imath::V3d& point) const {
    return (point - onAxis(point)).length() - radius;
  }
};

/// A piece of the curve where the surfaces of two shapes meet, as a function of a number from −π/2
/// to π/2. The function is smooth.
struct MeetingCurve {
  std::uint32_t first = 0, second = 0;  ///< indices of the shapes
  bool isCircle = false;                ///< circle of two balls
  Imath::V3d origin{0};         ///< centre of the circle, or begin of the axis of the first shape
  Imath::V3d u{0}, v{0}, w{0};  ///< orthonormal; `w` along the axis
  double radius = 0;            ///< radius of the circle, or of the first shape
  double middle = 0, half = 0;  ///< range of the angle: middle ± half
  double sign = 1;              ///< which of two points on a line along the first shape

  /// Position on the curve. `isOnBoth` becomes false for points beyond the ends of a rod.
  [[nodiscard]] Imath::V3d at(double number, const RodShape& a, const RodShape& b,
                              bool& isOnBoth) const;
};

/// Appends the curves where two shapes meet. Rods whose axes are parallel have none.
void addMeetingCurves(const std::vector<RodShape>& shapes, std::uint32_t first,
                      std::uint32_t second, std::vector<MeetingCurve>& curves);

}  // namespace levelset
