#include "levelset/points/field/local_quadric.h"

#include <cmath>

#include "levelset/geometry/perpendicular.h"

namespace levelset::points {
namespace {

using Imath::V3d;

constexpr double kSteep = 0.3;        // least cosine between two normals
constexpr double kSlopeWeight = 0.1;  // of a slope beside that of a height
constexpr double kRidge = 1e-9;       // of the weights; for points on one curve
constexpr std::size_t kSize = 6;      // coefficients

using Matrix = std::array<std::array<double, kSize>, kSize>;  // lower triangle

/// Solves a positive definite system by Cholesky's method without square roots.
std::array<double, kSize> solveDefinite(Matrix m, std::array<double, kSize> right) {
  std::array<double, kSize> inverse;
  for (std::size_t j = 0; j < kSize; ++j) {
    inverse[j] = 1 / m[j][j];
    for (std::size_t i = j + 1; i < kSize; ++i) {
      const double factor = m[i][j] * inverse[j];
      for (std::size_t k = j + 1; k <= i; ++k) m[i][k] -= factor * m[k][j];
      right[i] -= factor * right[j];
    }
  }
  for (std::size_t j = kSize; j-- > 0;) {
    for (std::size_t i = j + 1; i < kSize; ++i) right[j] -= m[i][j] * right[i];
    right[j] *= inverse[j];
  }
  return right;
}

}  // namespace

double LocalQuadric::distance(const V3d& at) const {
  const V3d d = scale * (at - centre);
  double x = d.dot(u), y = d.dot(v);
  const double squared = x * x + y * y;
  if (squared > 1) {
    const double radius = std::sqrt(squared);
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
  frame_ = {centre, normal, u, v, 1 / radius, {}};
}

void QuadricFit::add(const V3d& position, const V3d& normal, double weight) {
  const V3d d = frame_.scale * (position - frame_.centre);
  const double x = d.dot(frame_.u), y = d.dot(frame_.v), upright = normal.dot(frame_.normal);
  const double xx = x * x, xy = x * y, yy = y * y;
  const std::array<double, 15> monomials{1,       x,       y,       xx,      xy,
                                         yy,      x * xx,  y * xx,  x * yy,  y * yy,
                                         xx * xx, xx * xy, xx * yy, xy * yy, yy * yy};
  for (std::size_t n = 0; n < monomials.size(); ++n) moments_[n] += weight * monomials[n];
  const double height = weight * d.dot(frame_.normal);
  for (std::size_t n = 0; n < kSize; ++n) right_[n] += height * monomials[n];
  if (!(upright > kSteep)) return;
  const double slopeWeight = kSlopeWeight * weight;
  for (std::size_t n = 0; n < kSize; ++n) slopeMoments_[n] += slopeWeight * monomials[n];
  const double slopeX = -slopeWeight * normal.dot(frame_.u) / upright,
               slopeY = -slopeWeight * normal.dot(frame_.v) / upright;
  right_[1] += slopeX;
  right_[2] += slopeY;
  right_[3] += 2 * x * slopeX;
  right_[4] += y * slopeX + x * slopeY;
  right_[5] += 2 * y * slopeY;
}

LocalQuadric QuadricFit::solve() const {
  const auto& [m0, mx, my, mxx, mxy, myy, mxxx, mxxy, mxyy, myyy, m40, m31, m22, m13, m04] =
      moments_;
  const auto& [s0, sx, sy, sxx, sxy, syy] = slopeMoments_;
  // Slopes are the derivatives: those by x have the row (0, 1, 0, 2x, y, 0), those by y the row
  // (0, 0, 1, 0, x, 2y).
  Matrix matrix{{{m0},
                 {mx, mxx + s0},
                 {my, mxy, myy + s0},
                 {mxx, mxxx + 2 * sx, mxxy, m40 + 4 * sxx},
                 {mxy, mxxy + sy, mxyy + sx, m31 + 2 * sxy, m22 + sxx + syy},
                 {myy, mxyy, myyy + 2 * sy, m22, m13 + 2 * sxy, m04 + 4 * syy}}};
  for (std::size_t n = 0; n < kSize; ++n) matrix[n][n] += kRidge * m0;
  LocalQuadric quadric = frame_;
  quadric.coefficients = solveDefinite(matrix, right_);
  return quadric;
}

}  // namespace levelset::points
