#include "levelset/deform/creases/face_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace levelset {
namespace {

using openvdb::Vec3d;

constexpr int kQuadraticTerms = 6;
/// Least number of samples for each coefficient.
constexpr double kSamplesPerTerm = 2;
constexpr int kFitSteps = 12, kFootSteps = 3, kProjectionSteps = 4;
/// The fit has converged when the mean error of the distances falls by less than this, voxels.
constexpr double kFitTolerance = 1e-7;
/// Share of the weights that is added to the diagonal, as by Levenberg and Marquardt. Polynomials
/// that the samples do not determine keep coefficients near zero.
constexpr double kDamping = 1e-4;
/// Largest mean error of the distances. Above it, the samples belong to several faces.
constexpr double kLargestError = 0.05;

}  // namespace

std::array<double, FaceFit::kTerms> FaceFit::termsAt(double x, double y) {
  return {1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y};
}

FaceFit::Height FaceFit::heightAt(double x, double y) const {
  const auto& c = coefficients_;
  Height h;
  h.value = c[0] + c[1] * x + c[2] * y + x * x * (c[3] + c[6] * x + c[7] * y) +
            x * y * (c[4] + c[8] * y) + y * y * (c[5] + c[9] * y);
  h.x = c[1] + 2 * c[3] * x + c[4] * y + 3 * c[6] * x * x + 2 * c[7] * x * y + c[8] * y * y;
  h.y = c[2] + c[4] * x + 2 * c[5] * y + c[7] * x * x + 2 * c[8] * x * y + 3 * c[9] * y * y;
  h.xx = 2 * c[3] + 6 * c[6] * x + 2 * c[7] * y;
  h.xy = c[4] + 2 * c[7] * x + 2 * c[8] * y;
  h.yy = 2 * c[5] + 2 * c[8] * x + 6 * c[9] * y;
  return h;
}

/// One step of Gauss and Newton's method. Updates the feet, then the coefficients.
/// @return the weighted mean of the squared errors before the step
double FaceFit::stepOf(const std::vector<FaceSample>& samples,
                       std::vector<std::array<double, 2>>& feet, int terms, double reach,
                       bool& isSolved) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(terms), row(terms);
  double sum = 0, weights = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const Vec3d from = samples[n].position - origin_;
    const double px = from.dot(right_), py = from.dot(up_), pz = from.dot(normal_);
    auto& [x, y] = feet[n];
    Height h = heightAt(x, y);
    for (int step = 0; step < kFootSteps; ++step) {
      const double above = h.value - pz, gx = x - px + above * h.x, gy = y - py + above * h.y;
      const double a = 1 + h.x * h.x + above * h.xx, b = h.x * h.y + above * h.xy,
                   d = 1 + h.y * h.y + above * h.yy, determinant = a * d - b * b;
      if (!(determinant > 0.1)) break;
      x -= std::clamp((d * gx - b * gy) / determinant, -1.0, 1.0);
      y -= std::clamp((a * gy - b * gx) / determinant, -1.0, 1.0);
      h = heightAt(x, y);
    }
    const double share = 1 - (samples[n].foot - origin_).lengthSqr() / (reach * reach);
    if (!(share > 0)) continue;
    const double weight = share * share, slope = 1 / std::sqrt(1 + h.x * h.x + h.y * h.y);
    const double distance = slope * (pz - h.value - h.x * (px - x) - h.y * (py - y));
    const double error = distance - samples[n].distance;
    const auto values = termsAt(x / reach, y / reach);
    for (int k = 0; k < terms; ++k) row[k] = values[static_cast<std::size_t>(k)] * slope;
    normal += weight * row * row.transpose();
    right += (weight * error) * row;
    sum += weight * error * error;
    weights += weight;
  }
  normal.diagonal().array() += kDamping * weights;
  const Eigen::VectorXd change = normal.ldlt().solve(right);
  isSolved = weights > 0 && change.allFinite();
  if (!isSolved) return INFINITY;
  const double scale[] = {1,
                          reach,
                          reach,
                          reach * reach,
                          reach * reach,
                          reach * reach,
                          reach * reach * reach,
                          reach * reach * reach,
                          reach * reach * reach,
                          reach * reach * reach};
  for (int k = 0; k < terms; ++k)
    coefficients_[static_cast<std::size_t>(k)] += change[k] / scale[k];
  return sum / weights;
}

std::optional<FaceFit> FaceFit::make(const Vec3d& origin, const Vec3d& normal, double reach,
                                     const std::vector<FaceSample>& samples) {
  const auto count = static_cast<double>(samples.size());
  if (count < kSamplesPerTerm * kQuadraticTerms) return {};
  const int terms =
      count < kSamplesPerTerm * static_cast<double>(kTerms) ? kQuadraticTerms : int{kTerms};
  FaceFit fit;
  fit.origin_ = origin;
  fit.normal_ = normal;
  Vec3d axis(0.0);
  const int least = std::abs(normal[0]) <= std::abs(normal[1])
                        ? (std::abs(normal[0]) <= std::abs(normal[2]) ? 0 : 2)
                        : (std::abs(normal[1]) <= std::abs(normal[2]) ? 1 : 2);
  axis[least] = 1;
  fit.right_ = normal.cross(axis);
  fit.right_.normalize();
  fit.up_ = normal.cross(fit.right_);
  std::vector<std::array<double, 2>> feet;
  feet.reserve(samples.size());
  for (const FaceSample& sample : samples) {
    const Vec3d from = sample.foot - origin;
    feet.push_back({from.dot(fit.right_), from.dot(fit.up_)});
  }
  double last = INFINITY;
  for (int step = 0; step < kFitSteps; ++step) {
    bool isSolved = false;
    const double squared = fit.stepOf(samples, feet, terms, reach, isSolved);
    if (!isSolved) return {};
    const double error = std::sqrt(squared);
    if (last - error < kFitTolerance && step > 1) {
      last = error;
      break;
    }
    last = error;
  }
  if (!(last < kLargestError)) return {};
  return fit;
}

FaceFit::Value FaceFit::valueAt(const Vec3d& point) const {
  const Vec3d from = point - origin_;
  const Height h = heightAt(from.dot(right_), from.dot(up_));
  return {from.dot(normal_) - h.value, normal_ - right_ * h.x - up_ * h.y};
}

Vec3d FaceFit::projected(Vec3d point) const {
  for (int step = 0; step < kProjectionSteps; ++step) {
    const Value at = valueAt(point);
    point -= at.gradient * (at.height / at.gradient.lengthSqr());
  }
  return point;
}

}  // namespace levelset
