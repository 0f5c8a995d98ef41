#include "levelset/emboss/emboss_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace levelset::embossing {
namespace {

using Imath::V2d;

// Intervals of a curved profile in which nearest points are searched.
constexpr std::size_t kIntervals = 32;

double squaredToSegment(const V2d& p, const V2d& a, const V2d& b) {
  const V2d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.length2(), 0.0, 1.0);
  return (p - a - t * along).length2();
}

}  // namespace

EmbossSection::EmbossSection(EmbossProfile profile, double width, double height)
    : profile_(profile), width_(width), raised_(std::abs(height)), sign_(height < 0 ? -1 : 1) {
  if (profile == EmbossProfile::Flat)
    nodes_ = {V2d(0, raised_), V2d(width, raised_), V2d(width, 0)};
  if (profile == EmbossProfile::Sharp) nodes_ = {V2d(0, raised_), V2d(width, 0)};
  if (!isCurved()) return;
  parameterStep_ = (profile == EmbossProfile::Round ? std::numbers::pi / 2 : 1.0) / kIntervals;
  for (std::size_t i = 0; i <= kIntervals; ++i)
    nodes_.push_back(arc(static_cast<double>(i) * parameterStep_).point);
}

bool EmbossSection::isCurved() const {
  return profile_ == EmbossProfile::Round || profile_ == EmbossProfile::Smooth;
}

double EmbossSection::height(double d) const {
  return sign_ * raisedHeight(d);
}

double EmbossSection::raisedHeight(double d) const {
  const double u = d / width_;
  if (!(u < 1)) return 0;
  switch (profile_) {
    case EmbossProfile::Round:
      return raised_ * std::sqrt(1 - u * u);
    case EmbossProfile::Flat:
      return raised_;
    case EmbossProfile::Sharp:
      return raised_ * (1 - u);
    case EmbossProfile::Smooth:
      return raised_ * (1 - u * u) * (1 - u * u) * (1 - u * u);
  }
  return 0;
}

EmbossSection::Jet EmbossSection::arc(double t) const {
  if (profile_ == EmbossProfile::Round) {
    const double c = std::cos(t), s = std::sin(t);
    return {{width_ * s, raised_ * c}, {width_ * c, -raised_ * s}, {-width_ * s, -raised_ * c}};
  }
  const double v = 1 - t * t;
  return {{width_ * t, raised_ * v * v * v},
          {width_, -6 * raised_ * t * v * v},
          {0, raised_ * v * (24 * t * t - 6 * v)}};
}

double EmbossSection::distance(double d, double phi) const {
  return sign_ * raisedDistance(d, sign_ * phi);
}

double EmbossSection::raisedDistance(double d, double phi) const {
  const bool isBeyond = d >= width_;
  if (isBeyond) {
    // Distance to the box around the part of the graph with d ≤ width.
    const double up = std::max({phi - raised_, -phi, 0.0});
    if (std::hypot(d - width_, up) >= std::abs(phi)) return phi;
  }
  const double squared = squaredToArc({d, phi});
  if (isBeyond && squared >= phi * phi) return phi;
  return phi < raisedHeight(d) ? -std::sqrt(squared) : std::sqrt(squared);
}

double EmbossSection::squaredToArc(const V2d& p) const {
  double least = INFINITY;
  if (!isCurved()) {
    for (std::size_t i = 0; i + 1 < nodes_.size(); ++i)
      least = std::min(least, squaredToSegment(p, nodes_[i], nodes_[i + 1]));
    return least;
  }
  std::array<double, kIntervals + 1> squared;
  for (std::size_t i = 0; i <= kIntervals; ++i) squared[i] = (nodes_[i] - p).length2();
  for (std::size_t i = 0; i <= kIntervals; ++i) {
    const bool isLeast = (i == 0 || squared[i] <= squared[i - 1]) &&
                         (i == kIntervals || squared[i] <= squared[i + 1]);
    if (isLeast) least = std::min({least, squared[i], footSquared(p, i)});
  }
  return least;
}

/// Squared distance from p to its foot point on the intervals beside a node: the zero of the
/// derivative of the squared distance, by Newton's method inside a bracket.
double EmbossSection::footSquared(const V2d& p, std::size_t node) const {
  const auto slope = [&](const Jet& jet) { return (jet.point - p).dot(jet.first); };
  const auto parameter = [&](std::size_t i) { return static_cast<double>(i) * parameterStep_; };
  double low = parameter(node == 0 ? 0 : node - 1),
         high = parameter(std::min(node + 1, kIntervals));
  double t = parameter(node);
  Jet jet = arc(t);
  constexpr int kMostSteps = 40;
  for (int step = 0; step < kMostSteps; ++step) {
    const double at = slope(jet);
    (at < 0 ? low : high) = t;
    const double bend = jet.first.length2() + (jet.point - p).dot(jet.second);
    double next = bend > 0 ? t - at / bend : 0.5 * (low + high);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = std::abs(next - t);
    t = next;
    jet = arc(t);
    if (change < 1e-9 * parameterStep_) break;
  }
  return (jet.point - p).length2();
}

}  // namespace levelset::embossing
