#include "levelset/points/field/point_field.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace levelset::points {

using Imath::V3d;

namespace {

struct LocalQuadrics {
  const OrientedPoints* points;

  double operator()(const V3d& at, const std::vector<Found>& found) const {
    const double squaredCutOff = found.back().squared;
    V3d centre(0), normal(0);
    double weights = 0;
    for (std::size_t n = 0; n + 1 < found.size(); ++n) {
      const double weight = pointWeight(found[n].squared / squaredCutOff);
      weights += weight;
      centre += weight * points->positions[found[n].index];
      normal += weight * points->normals[found[n].index];
    }
    const std::uint32_t first = found.front().index;
    if (!(weights > 0) || !(normal.length() > 1e-3 * weights))
      return points->normals[first].dot(at - points->positions[first]);
    centre /= weights;
    normal.normalize();
    const auto [u, v] = tangents(normal);

    // Heights and slopes at the points, in units of the cut-off.
    using Vector6 = Eigen::Matrix<double, 6, 1>;
    Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    const double scale = 1 / std::sqrt(squaredCutOff);
    const auto add = [&](const Vector6& row, double value, double weight) {
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      right += weight * value * row;
    };
    for (std::size_t n = 0; n + 1 < found.size(); ++n) {
      const V3d& m = points->normals[found[n].index];
      const double upright = m.dot(normal);
      const double weight = pointWeight(found[n].squared / squaredCutOff);
      const V3d d = scale * (points->positions[found[n].index] - centre);
      const double x = d.dot(u), y = d.dot(v);
      add((Vector6() << 1, x, y, x * x, x * y, y * y).finished(), d.dot(normal), weight);
      if (!(upright > kSteep)) continue;
      add((Vector6() << 0, 1, 0, 2 * x, y, 0).finished(), -m.dot(u) / upright,
          kSlopeWeight * weight);
      add((Vector6() << 0, 0, 1, 0, x, 2 * y).finished(), -m.dot(v) / upright,
          kSlopeWeight * weight);
    }
    matrix.diagonal().array() += kRidge * weights;
    const Vector6 c = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    const V3d d = scale * (at - centre);
    double x = d.dot(u), y = d.dot(v);
    const double radius = std::hypot(x, y);
    if (radius > 1) {  // beyond the fitted points
      x /= radius;
      y /= radius;
    }
    const double slopeX = c[1] + 2 * c[3] * x + c[4] * y, slopeY = c[2] + c[4] * x + 2 * c[5] * y,
                 height = c[0] + x * (c[1] + c[3] * x + c[4] * y) + y * (c[2] + c[5] * y);
    return (d.dot(normal) - height) / (scale * std::sqrt(1 + slopeX * slopeX + slopeY * slopeY));
  }

  static constexpr double kSteep = 0.3;        // least cosine between two normals
  static constexpr double kSlopeWeight = 0.1;  // of a slope beside that of a height
  static constexpr double kRidge = 1e-9;       // of the weights; for points on one curve
};

}  // namespace

PointField movingLeastSquares(const OrientedPoints& points, std::size_t neighbours) {
  return {LocalQuadrics{&points}, std::min(neighbours + 1, points.size())};
}

}  // namespace levelset::points
