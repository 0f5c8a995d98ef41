#include "levelset/points/field/local_quadric.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "levelset/geometry/perpendicular.h"

namespace levelset::points {
namespace {

using Imath::V3d;

constexpr double kSteep = 0.3;        // least cosine between two normals
constexpr double kSlopeWeight = 0.1;  // of a slope beside that of a height
constexpr double kRidge = 1e-9;       // of the weights; for points on one curve

}  // namespace

double LocalQuadric::distance(const V3d& at) const {
  const V3d d = scale * (at - centre);
  double x = d.dot(u), y = d.dot(v);
  const double radius = std::hypot(x, y);
  if (radius > 1) {
    x /= radius;
    y /= radius;
  }
  const auto& c = coefficients;
  const double slopeX = c[1] + 2 * c[3] * x + c[4] * y, slopeY = c[2] + c[4] * x + 2 * c[5] * y,
               height = c[0] + x * (c[1] + c[3] * x + c[4] * y) + y * (c[2] + c[5] * y);
  return (d.dot(normal) - height) / (scale * std::sqrt(1 + slopeX * slopeX + slopeY * slopeY));
}

QuadricFit::QuadricFit(const V3d& centre, const V3d& normal, double radius) {
  const auto [u, v] = tangents(normal);
  frame_ = {centre, normal, u, v, 1 / radius, Vector6::Zero()};
}

void QuadricFit::addRow(const Vector6& row, double value, double weight) {
  matrix_.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
  right_ += weight * value * row;
}

void QuadricFit::add(const V3d& position, const V3d& normal, double weight) {
  const V3d d = frame_.scale * (position - frame_.centre);
  const double x = d.dot(frame_.u), y = d.dot(frame_.v), upright = normal.dot(frame_.normal);
  addRow((Vector6() << 1, x, y, x * x, x * y, y * y).finished(), d.dot(frame_.normal), weight);
  weights_ += weight;
  if (!(upright > kSteep)) return;
  addRow((Vector6() << 0, 1, 0, 2 * x, y, 0).finished(), -normal.dot(frame_.u) / upright,
         kSlopeWeight * weight);
  addRow((Vector6() << 0, 0, 1, 0, x, 2 * y).finished(), -normal.dot(frame_.v) / upright,
         kSlopeWeight * weight);
}

LocalQuadric QuadricFit::solve() const {
  Eigen::Matrix<double, 6, 6> matrix = matrix_;
  matrix.diagonal().array() += kRidge * weights_;
  LocalQuadric quadric = frame_;
  quadric.coefficients = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right_);
  return quadric;
}

}  // namespace levelset::points
