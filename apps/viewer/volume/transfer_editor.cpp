#include "apps/viewer/volume/transfer_editor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace viewer {

using render::TransferPoint;

TransferEditor::TransferEditor(std::vector<TransferPoint> points, double low, double high)
    : points_(std::move(points)), low_(low), high_(high) {
  std::sort(points_.begin(), points_.end(),
            [](const TransferPoint& a, const TransferPoint& b) { return a.value < b.value; });
}

double TransferEditor::xOf(const TransferPoint& point) const {
  return (point.value - low_) / (high_ - low_);
}

double TransferEditor::yOf(const TransferPoint& point) {
  return std::sqrt(point.opacity);
}

std::optional<std::size_t> TransferEditor::nearest(double x, double y, double reachX,
                                                   double reachY) const {
  std::optional<std::size_t> found;
  double least = 1;  // distance in units of the reach
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const double away = std::hypot((xOf(points_[n]) - x) / reachX, (yOf(points_[n]) - y) / reachY);
    if (away >= least) continue;
    least = away;
    found = n;
  }
  return found;
}

Imath::C3f TransferEditor::colourAt(double value) const {
  const auto next = std::find_if(points_.begin(), points_.end(),
                                 [&](const TransferPoint& point) { return point.value > value; });
  if (next == points_.begin()) return next->colour;
  const TransferPoint& before = *std::prev(next);
  if (next == points_.end()) return before.colour;
  const auto share = static_cast<float>((value - before.value) / (next->value - before.value));
  return before.colour + (next->colour - before.colour) * share;
}

void TransferEditor::press(double x, double y, double reachX, double reachY) {
  isDragging_ = true;
  selected_ = nearest(x, y, reachX, reachY);
  if (selected_) return;
  const double value = low_ + std::clamp(x, 0.0, 1.0) * (high_ - low_);
  const auto place = std::find_if(points_.begin(), points_.end(),
                                  [&](const TransferPoint& point) { return point.value >= value; });
  selected_ = static_cast<std::size_t>(place - points_.begin());
  points_.insert(place, {value, 0, colourAt(value)});
  moveTo(x, y);
}

void TransferEditor::moveTo(double x, double y) {
  if (!isDragging_ || !selected_) return;
  const std::size_t n = *selected_;
  // Two points of one value have no order.
  const double apart = 1e-4 * (high_ - low_);
  const double least = n > 0 ? points_[n - 1].value + apart : -HUGE_VAL,
               most = n + 1 < points_.size() ? points_[n + 1].value - apart : HUGE_VAL;
  const double value = low_ + std::clamp(x, 0.0, 1.0) * (high_ - low_);
  points_[n].value = least <= most ? std::clamp(value, least, most) : 0.5 * (least + most);
  const double height = std::clamp(y, 0.0, 1.0);
  points_[n].opacity = std::min(height * height, kMostOpaque);
}

void TransferEditor::removeAt(double x, double y, double reachX, double reachY) {
  const std::optional<std::size_t> found = nearest(x, y, reachX, reachY);
  if (!found || points_.size() == 1) return;
  points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(*found));
  selected_.reset();
  isDragging_ = false;
}

void TransferEditor::setColour(const Imath::C3f& colour) {
  if (selected_) points_[*selected_].colour = colour;
}

}  // namespace viewer
