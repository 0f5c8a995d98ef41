#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <Eigen/Core>

namespace levelset::points {

/// Quadratic height function over a plane.
struct LocalQuadric {
  Imath::V3d centre, normal, u, v;
  double scale;  ///< 1 / radius of the fitted points
  Eigen::Matrix<double, 6, 1> coefficients;

  /// Distance along the normal, divided by the secant of the slope. Beyond the fitted points, the
  /// height is that at their rim.
  [[nodiscard]] double distance(const Imath::V3d& at) const;
};

/// Weighted least-squares fit of a height function to the heights and slopes of points.
class QuadricFit {
 public:
  /// @param radius  of the points about the centre
  QuadricFit(const Imath::V3d& centre, const Imath::V3d& normal, double radius);
  void add(const Imath::V3d& position, const Imath::V3d& normal, double weight);
  [[nodiscard]] LocalQuadric solve() const;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  void addRow(const Vector6& row, double value, double weight);

  LocalQuadric frame_;
  Eigen::Matrix<double, 6, 6> matrix_ = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right_ = Vector6::Zero();
  double weights_ = 0;
};

}  // namespace levelset::points
