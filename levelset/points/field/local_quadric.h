#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>

namespace levelset::points {

/// Quadratic height function over a plane.
struct LocalQuadric {
  Imath::V3d centre, normal, u, v;
  double scale;  ///< 1 / radius of the fitted points
  /// Factors of 1, x, y, x², xy and y².
  std::array<double, 6> coefficients;

  /// Distance along the normal, divided by the secant of the slope. Beyond the fitted points, the
  /// height is that at their rim.
  [[nodiscard]] double distance(const Imath::V3d& at) const;
};

/// Weighted least-squares fit of a height function to the heights and slopes of points. Sums
/// moments, since the 21 entries of the normal equations repeat 15 of them.
class QuadricFit {
 public:
  /// @param radius  of the points about the centre
  QuadricFit(const Imath::V3d& centre, const Imath::V3d& normal, double radius);
  void add(const Imath::V3d& position, const Imath::V3d& normal, double weight);
  [[nodiscard]] LocalQuadric solve() const;

 private:
  LocalQuadric frame_;
  std::array<double, 15> moments_{};      ///< sums of 1, x, y, x², xy, y², x³, …, y⁴
  std::array<double, 6> slopeMoments_{};  ///< the same up to y², with the weights of slopes
  std::array<double, 6> right_{};
};

}  // namespace levelset::points
