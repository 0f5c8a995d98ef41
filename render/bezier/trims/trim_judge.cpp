#include <cmath>
#include <numbers>

#include "render/bezier/trims/trim_region.h"

namespace render {
namespace {

using Imath::V2d;

constexpr int kJudgedTrimLevels = 60;

/// Bernstein polynomials of a degree at t, by their recurrence.
std::vector<double> bernsteinRow(std::size_t degree, double t) {
  std::vector<double> row{1.0};
  for (std::size_t order = 0; order < degree; ++order) {
    row.push_back(0);
    for (std::size_t i = row.size() - 1; i > 0; --i) row[i] = (1 - t) * row[i] + t * row[i - 1];
    row[0] *= 1 - t;
  }
  return row;
}

/// Control points of the part of a curve between two parameters, as blossoms, relative to a point
/// and without their weights.
std::vector<V2d> partOf(const TrimCurve& curve, const V2d& point, double low, double high) {
  const std::size_t degree = curve.points.size() - 1;
  std::vector<V2d> result;
  for (std::size_t k = 0; k <= degree; ++k) {
    // The blossom at k times `high` and degree − k times `low`.
    std::vector<double> factors(degree + 1, 0.0);
    const std::vector<double> atLow = bernsteinRow(degree - k, low), atHigh = bernsteinRow(k, high);
    for (std::size_t i = 0; i < atLow.size(); ++i)
      for (std::size_t j = 0; j < atHigh.size(); ++j) factors[i + j] += atLow[i] * atHigh[j];
    V2d sum(0);
    for (std::size_t n = 0; n <= degree; ++n)
      sum +=
          (curve.points[n] - point) * (factors[n] * (curve.weights.empty() ? 1 : curve.weights[n]));
    result.push_back(sum);
  }
  return result;
}

/// Angle under which a point sees a part of a curve.
double angleOf(const TrimCurve& curve, const V2d& point, double low, double high, int level) {
  const std::vector<V2d> part = partOf(curve, point, low, high);
  const V2d middle = part.front() + part.back();
  bool isOnOneSide = true;
  for (const V2d& p : part) isOnOneSide = isOnOneSide && p.dot(middle) > 0;
  const double angle = std::atan2(part.front().cross(part.back()), part.front().dot(part.back()));
  if (isOnOneSide || level >= kJudgedTrimLevels) return angle;
  const double t = 0.5 * (low + high);
  return angleOf(curve, point, low, t, level + 1) + angleOf(curve, point, t, high, level + 1);
}

}  // namespace

bool judgedContains(const std::vector<TrimLoop>& loops, const V2d& point) {
  double sum = 0;
  for (const TrimLoop& loop : loops)
    for (const TrimCurve& curve : loop) sum += angleOf(curve, point, 0, 1, 0);
  return std::llround(sum / (2 * std::numbers::pi)) % 2 != 0;
}

}  // namespace render
