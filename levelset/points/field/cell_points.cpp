#include "levelset/points/field/cell_points.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace levelset::points {
namespace {

using Imath::V3d;

constexpr double kRounding = 1e-12;
/// Most candidates of a ball. With more of them, searches of the tree take less time.
constexpr std::size_t kMostCandidates = 400;

double square(double x) {
  return x * x;
}

Eigen::Map<const Eigen::ArrayXd> arrayOf(const std::vector<double>& list) {
  return {list.data(), static_cast<Eigen::Index>(list.size())};
}

}  // namespace

void CellPoints::Ball::move(const V3d& to, double newRadius,
                            const std::vector<FoundItem>& atCentre) {
  centre = to;
  radius = newRadius;
  farthest = std::sqrt(atCentre.back().squared);
  candidates = Candidates::Unknown;
}

const std::vector<FoundItem>& CellPoints::move(const OrientedPoints& points, const V3d& centre,
                                               double radius, std::size_t count) {
  points_ = &points;
  count_ = std::min(count, points.size());
  points.search.closest(centre, count_, atOuter_);
  outer_.move(centre, radius, atOuter_);
  return atOuter_;
}

const std::vector<FoundItem>& CellPoints::moveInside(const V3d& centre, double radius) {
  find(outer_, centre, atInner_);
  inner_.move(centre, radius, atInner_);
  return atInner_;
}

void CellPoints::closest(const V3d& at, std::vector<FoundItem>& found) {
  find(inner_, at, found);
}

/// Finds the closest points of a position in a ball.
void CellPoints::find(Ball& ball, const V3d& at, std::vector<FoundItem>& found) {
  if (ball.candidates == Candidates::Unknown) list(ball);
  if (ball.candidates == Candidates::Listed)
    choose(ball, at, found);
  else
    points_->search.closest(at, count_, found);
}

/// Lists the points that can be among the closest ones of a position in the ball.
void CellPoints::list(Ball& ball) const {
  // The closest points of a position reach at most a radius farther than those of the centre, and
  // the position lies at most a radius from it.
  double squared = square((1 + kRounding) * (ball.farthest + 2 * ball.radius));
  ball.numbers.clear();
  ball.candidates = Candidates::Listed;
  if (&ball == &inner_ && outer_.candidates == Candidates::Listed) {
    for (std::size_t n = 0; n < outer_.numbers.size(); ++n) {
      const V3d arm = V3d(outer_.x[n], outer_.y[n], outer_.z[n]) - ball.centre;
      if (arm.length2() <= squared) ball.numbers.push_back(outer_.numbers[n]);
    }
  } else {
    points_->search.visit(ball.centre, squared, [&](const PointItem& item) {
      if (ball.numbers.size() == kMostCandidates) {
        ball.candidates = Candidates::TooMany;
        squared = -1;  // ends the visit
      } else {
        ball.numbers.push_back(item.index);
      }
    });
    if (ball.candidates == Candidates::TooMany) return;
  }
  const std::size_t size = ball.numbers.size();
  for (std::vector<double>* axis : {&ball.x, &ball.y, &ball.z}) axis->resize(size);
  for (std::size_t n = 0; n < size; ++n) {
    const V3d& p = points_->positions[ball.numbers[n]];
    ball.x[n] = p.x;
    ball.y[n] = p.y;
    ball.z[n] = p.z;
  }
}

/// Finds the closest points of a position among the candidates of a ball that contains it.
void CellPoints::choose(const Ball& ball, const V3d& at, std::vector<FoundItem>& found) {
  squared_.resize(ball.numbers.size());
  Eigen::Map<Eigen::ArrayXd>(squared_.data(), static_cast<Eigen::Index>(squared_.size())) =
      (arrayOf(ball.x) - at.x).square() + (arrayOf(ball.y) - at.y).square() +
      (arrayOf(ball.z) - at.z).square();
  // The farthest of the closest points moves no more than the position.
  const double moved = (at - ball.centre).length();
  const double rounding = kRounding * (ball.farthest + moved),
               nearer = ball.farthest - moved - rounding, least = nearer > 0 ? square(nearer) : 0,
               most = square(ball.farthest + moved + rounding);
  const std::size_t size = ball.numbers.size();
  sure_.resize(size + 1);
  possible_.resize(size + 1);
  std::size_t sure = 0, possible = 0;
  for (std::size_t n = 0; n < size; ++n) {  // without branches, which would be unpredictable
    const double squared = squared_[n];
    sure_[sure] = possible_[possible] = static_cast<std::uint32_t>(n);
    const bool isSure = squared < least;
    sure += isSure;
    possible += !isSure && squared <= most;
  }
  order_.resize(possible);
  for (std::size_t n = 0; n < possible; ++n) order_[n] = squared_[possible_[n]];
  const auto last = order_.begin() + static_cast<std::ptrdiff_t>(count_ - sure - 1);
  std::nth_element(order_.begin(), last, order_.end());
  found.resize(sure + possible);
  std::size_t chosen = 0;
  for (std::size_t n = 0; n < sure; ++n) {
    const std::uint32_t i = sure_[n];
    found[chosen++] = {squared_[i], ball.numbers[i]};
  }
  for (std::size_t n = 0; n < possible; ++n) {
    const std::uint32_t i = possible_[n];
    found[chosen] = {squared_[i], ball.numbers[i]};
    chosen += squared_[i] <= *last;
  }
  found.resize(chosen);
  // Points at one distance count by their numbers.
  if (found.size() > count_) {
    std::sort(found.begin(), found.end());
    found.resize(count_);
  }
  std::swap(found.front(), *std::min_element(found.begin(), found.end()));
  std::swap(found.back(), *std::max_element(found.begin(), found.end()));
}

}  // namespace levelset::points
