#include "render/bezier/trims/trim_region.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/deform/bernstein/tensor_bernstein.h"
#include "levelset/error.h"
#include "levelset/geometry/exact_predicates.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::InvalidInput;

constexpr double kLargestParameter = 1e6, kLeastTrimWeight = 1e-6, kLargestTrimWeight = 1e6;
constexpr std::size_t kMostControls = 21;
/// Halvings until a piece of a curve is as short as rounding errors.
constexpr int kMonotoneLevels = 30, kSideLevels = 60;
constexpr double kMostRows = 4096;
/// Rows in which a piece is listed, on average.
constexpr double kListings = 4;

V2d projected(const V3d& control) {
  return V2d(control.x, control.y) / control.z;
}

std::vector<V3d> homogeneous(const TrimCurve& curve) {
  std::vector<V3d> controls;
  for (std::size_t n = 0; n < curve.points.size(); ++n) {
    const double w = curve.weights.empty() ? 1 : curve.weights[n];
    controls.emplace_back(w * curve.points[n].x, w * curve.points[n].y, w);
  }
  return controls;
}

/// Halves a curve by the algorithm of de Casteljau. @return the second half; `controls` becomes the
/// first one
std::vector<V3d> halve(std::vector<V3d>& controls) {
  std::vector<V3d> second(controls.size());
  std::vector<V3d> row = controls;
  for (std::size_t n = 0; n < controls.size(); ++n) {
    controls[n] = row.front();
    second[controls.size() - 1 - n] = row.back();
    for (std::size_t k = 0; k + 1 < row.size(); ++k) row[k] = (row[k] + row[k + 1]) * 0.5;
    row.pop_back();
  }
  return second;
}

/// True if v rises or falls along the whole curve: all Bernstein coefficients of the numerator of
/// its derivative have one sign.
bool isMonotone(const std::vector<V3d>& controls) {
  const std::size_t d = controls.size() - 1;
  // v = N / W, and v' W² = N' W − N W', of degree 2 d − 1 as products of Bernstein polynomials.
  const std::vector<double> choose = levelset::binomials(static_cast<int>(d)),
                            chooseLess = levelset::binomials(static_cast<int>(d) - 1);
  std::vector<double> sums(2 * d, 0.0);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j <= d; ++j)
      sums[i + j] += chooseLess[i] * choose[j] *
                     ((controls[i + 1].y - controls[i].y) * controls[j].z -
                      controls[j].y * (controls[i + 1].z - controls[i].z));
  return std::all_of(sums.begin(), sums.end(), [](double s) { return s >= 0; }) ||
         std::all_of(sums.begin(), sums.end(), [](double s) { return s <= 0; });
}

void requireCurve(const TrimCurve& curve) {
  if (curve.points.size() < 2 || curve.points.size() > kMostControls)
    throw InvalidInput(fmt::format("a trimming curve has {} control points; give 2 to {}",
                                   curve.points.size(), kMostControls));
  if (!curve.weights.empty() && curve.weights.size() != curve.points.size())
    throw InvalidInput(
        fmt::format("a trimming curve has {} weights for {} control points; give "
                    "one for each, or none",
                    curve.weights.size(), curve.points.size()));
  for (const V2d& p : curve.points)
    if (!(std::abs(p.x) <= kLargestParameter) || !(std::abs(p.y) <= kLargestParameter))
      throw InvalidInput(
          fmt::format("a control point of a trimming curve is ({}, {}); give finite parameters up "
                      "to {:g}",
                      p.x, p.y, kLargestParameter));
  for (const double w : curve.weights)
    if (!(w >= kLeastTrimWeight) || !(w <= kLargestTrimWeight))
      throw InvalidInput(
          fmt::format("a weight of a trimming curve is {}; give weights from {} to "
                      "{:g}",
                      w, kLeastTrimWeight, kLargestTrimWeight));
}

}  // namespace

TrimLoop polylineLoop(const std::vector<V2d>& points) {
  TrimLoop loop;
  for (std::size_t n = 0; n < points.size(); ++n)
    loop.push_back({{points[n], points[(n + 1) % points.size()]}, {}});
  return loop;
}

TrimRegion::TrimRegion(std::vector<TrimLoop> loops) : loops_(std::move(loops)) {
  for (const TrimLoop& loop : loops_) {
    if (loop.empty()) throw InvalidInput("a trimming loop has no curves; give at least one");
    for (const TrimCurve& curve : loop) requireCurve(curve);
    for (std::size_t n = 0; n < loop.size(); ++n) {
      const V2d end = loop[n].points.back(),
                next = loop[n + 1 < loop.size() ? n + 1 : 0].points.front();
      if (end != next)
        throw InvalidInput(
            fmt::format("a trimming loop is not closed: curve {} ends at ({}, {}) and the next one "
                        "begins at ({}, {}); give equal points",
                        n, end.x, end.y, next.x, next.y));
      addCurve(loop[n], next);
    }
  }
  makeRows();
}

void TrimRegion::addCurve(const TrimCurve& curve, const V2d& end) {
  const V2d& from = curve.points.front();
  if (curve.points.size() > 2) {
    addMonotone(homogeneous(curve), from, end, 0);
    return;
  }
  // With weights a segment is the same set of points.
  if (from.y != end.y)
    pieces_.push_back({from, end, std::min(from.x, end.x), std::max(from.x, end.x)});
}

void TrimRegion::addMonotone(std::vector<V3d> controls, const V2d& from, const V2d& to, int level) {
  if (level < kMonotoneLevels && !isMonotone(controls)) {
    std::vector<V3d> second = halve(controls);
    const V2d middle = projected(second.front());
    addMonotone(std::move(controls), from, middle, level + 1);
    addMonotone(std::move(second), middle, to, level + 1);
    return;
  }
  if (from.y == to.y) return;
  Piece piece{from, to, std::min(from.x, to.x), std::max(from.x, to.x), {}};
  for (const V3d& control : controls) {
    piece.uMin = std::min(piece.uMin, control.x / control.z);
    piece.uMax = std::max(piece.uMax, control.x / control.z);
  }
  if (level < kMonotoneLevels) piece.controls = std::move(controls);
  pieces_.push_back(std::move(piece));
}

void TrimRegion::makeRows() {
  if (pieces_.empty()) return;
  vMin_ = vMax_ = pieces_.front().from.y;
  for (const Piece& piece : pieces_) {
    vMin_ = std::min({vMin_, piece.from.y, piece.to.y});
    vMax_ = std::max({vMax_, piece.from.y, piece.to.y});
  }
  // Pieces are listed a few times each on average, however tall they are.
  double heights = 0;
  for (const Piece& piece : pieces_)
    heights += std::abs(piece.to.y - piece.from.y) / (vMax_ - vMin_);
  const auto count = static_cast<double>(pieces_.size());
  rows_.resize(static_cast<std::size_t>(
      std::clamp(kListings * count / heights, 1.0, std::min(kMostRows, count))));
  for (std::uint32_t n = 0; n < pieces_.size(); ++n) {
    const auto [low, high] = std::minmax(pieces_[n].from.y, pieces_[n].to.y);
    for (std::size_t row = rowOf(low); row <= rowOf(high); ++row) rows_[row].push_back(n);
  }
}

/// Rises with v, so that a piece is listed in the rows of all points between its ends.
std::size_t TrimRegion::rowOf(double v) const {
  const double row = (v - vMin_) / (vMax_ - vMin_) * static_cast<double>(rows_.size());
  return std::min(rows_.size() - 1, static_cast<std::size_t>(std::max(row, 0.0)));
}

bool TrimRegion::contains(const V2d& point) const {
  if (rows_.empty() || !(point.y >= vMin_) || !(point.y <= vMax_)) return false;
  bool isInside = false;
  for (const std::uint32_t n : rows_[rowOf(point.y)]) {
    const Piece& piece = pieces_[n];
    const bool isFromBelow = piece.from.y <= point.y;
    if (isFromBelow == (piece.to.y <= point.y)) continue;
    if (point.x >= piece.uMax) continue;
    if (point.x < piece.uMin) {
      isInside = !isInside;
      continue;
    }
    V2d from = piece.from, to = piece.to;
    bool isDecided = false;
    if (!piece.controls.empty()) {
      std::vector<V3d> controls = piece.controls;
      for (int level = 0; level < kSideLevels && !isDecided; ++level) {
        std::vector<V3d> second = halve(controls);
        const V2d middle = projected(second.front());
        if ((middle.y <= point.y) == isFromBelow) {
          from = middle;
          controls = std::move(second);
        } else {
          to = middle;
        }
        double low = INFINITY, high = -INFINITY;
        for (const V3d& control : controls) {
          low = std::min(low, control.x / control.z);
          high = std::max(high, control.x / control.z);
        }
        if (point.x >= high) {
          isDecided = true;
        } else if (point.x < low) {
          isDecided = true;
          isInside = !isInside;
        }
      }
    }
    if (isDecided) continue;
    // The crossing is to the right if the point is to the left of the segment as it rises.
    const int side = levelset::convert::orient2d(from, to, point);
    if (isFromBelow ? side > 0 : side < 0) isInside = !isInside;
  }
  return isInside;
}

std::size_t TrimRegion::bytes() const {
  std::size_t sum = sizeof(TrimRegion);
  for (const TrimLoop& loop : loops_)
    for (const TrimCurve& curve : loop)
      sum += sizeof(TrimCurve) + sizeof(V2d) * curve.points.size() +
             sizeof(double) * curve.weights.size();
  for (const Piece& piece : pieces_) sum += sizeof(Piece) + sizeof(V3d) * piece.controls.size();
  for (const auto& row : rows_) sum += sizeof(row) + sizeof(std::uint32_t) * row.size();
  return sum;
}

}  // namespace render
