#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <limits>

// For the .cpp files of this library only.

namespace levelset {

/// Box of an item of a search tree.
/// @tparam Number  float or double
template <typename Number>
struct ItemBox {
  Imath::Vec3<Number> low, high;

  void extendBy(const ItemBox& other) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
  /// Squared distance from a point to the box. Rounds as the squared distance to a point in the box
  /// does, so it is never larger.
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double gap = std::max({static_cast<double>(low[axis]) - from[axis],
                                   from[axis] - static_cast<double>(high[axis]), 0.0});
      sum += gap * gap;
    }
    return sum;
  }
  /// Twice the centre, along an axis.
  [[nodiscard]] Number centre(int axis) const { return low[axis] + high[axis]; }
};

/// Returns a box in single precision that contains a box in double precision.
[[nodiscard]] inline ItemBox<float> floatBox(const Imath::V3d& low, const Imath::V3d& high) {
  ItemBox<float> box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = static_cast<float>(low[axis]);
    box.high[axis] = static_cast<float>(high[axis]);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (static_cast<double>(box.low[axis]) > low[axis])
      box.low[axis] = std::nextafter(box.low[axis], -kInfinity);
    if (static_cast<double>(box.high[axis]) < high[axis])
      box.high[axis] = std::nextafter(box.high[axis], kInfinity);
  }
  return box;
}

}  // namespace levelset
