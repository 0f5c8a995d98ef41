#include "apps/viewer/editing/deform_editor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"

namespace viewer {

using Imath::V2d;
using Imath::V3d;

std::optional<V3d> dragOffset(const V3d& point, const V2d& place, const render::Camera& camera,
                              const std::optional<int>& axis) {
  const render::Camera::Ray ray = camera.ray(place.x, place.y);
  const V3d away = point - ray.origin;
  if (!axis) {
    const V3d view = camera.axis();
    const double distance = away.dot(view) / ray.direction.dot(view);
    if (!std::isfinite(distance) || (!camera.orthoHeight && distance <= 0)) return std::nullopt;
    return ray.direction * distance - away;
  }
  V3d line(0);
  line[*axis] = 1;
  const double cosine = line.dot(ray.direction), sine2 = 1 - cosine * cosine;
  constexpr double kLeastSine2 = 1e-3;  // below it, a pixel is a long way along the line
  if (sine2 < kLeastSine2) return std::nullopt;
  return line * ((cosine * ray.direction.dot(away) - line.dot(away)) / sine2);
}

DeformEditor::DeformEditor(const DeformDesign& design)
    : design_(design), net_(design.net()), isSelected_(design.points().size(), 0) {}

std::optional<std::size_t> DeformEditor::pointAt(const V2d& place,
                                                 const render::Camera& camera) const {
  // Points nearer to the eye win over points that are a little nearer to the pointer.
  constexpr double kStep = 3;
  std::optional<std::size_t> found;
  std::pair<double, double> least = {std::numeric_limits<double>::infinity(), 0};
  for (std::size_t n = 0; n < design_.points().size(); ++n) {
    const V3d& point = design_.points()[n];
    const std::optional<V2d> at = seenAt(point, camera);
    const double distance = at ? (*at - place).length() : kPointReach + 1;
    if (distance > kPointReach) continue;
    const std::pair<double, double> rank = {std::floor(distance / kStep),
                                            (point * camera.worldToCamera()).z};
    if (rank >= least) continue;
    least = rank;
    found = n;
  }
  return found;
}

bool DeformEditor::press(const V2d& place, const render::Camera& camera, bool isAdding) {
  const std::optional<std::size_t> point = pointAt(place, camera);
  if (!point) return false;
  if (isAdding) {
    isSelected_[*point] = isSelected_[*point] ? 0 : 1;
  } else if (!isSelected_[*point]) {
    selectNone();
    isSelected_[*point] = 1;
  }
  held_ = *point;
  grip_ = *seenAt(design_.points()[held_], camera) - place;
  start_ = design_.points();
  isDragging_ = true;
  return true;
}

bool DeformEditor::moveTo(const V2d& place, const render::Camera& camera) {
  if (!isDragging_ || !isSelected_[held_]) return false;
  const std::optional<V3d> offset = dragOffset(start_[held_], place + grip_, camera, axis_);
  if (!offset) return false;
  Points points = start_;
  for (std::size_t n = 0; n < points.size(); ++n)
    if (isSelected_[n]) points[n] += *offset;
  // A click moves nothing, although rays have rounding errors.
  constexpr double kLeastPixels = 1e-6;
  if (const auto now = seenAt(points[held_], camera), before = seenAt(start_[held_], camera);
      now && before && (*now - *before).length() < kLeastPixels)
    points = start_;
  return take(std::move(points));
}

void DeformEditor::release() {
  if (std::exchange(isDragging_, false) && start_ != design_.points()) history_.add(start_);
}

bool DeformEditor::take(Points points) {
  if (points == design_.points()) return false;
  try {
    design_ = design_.withPoints(std::move(points));
  } catch (const levelset::InvalidInput&) {
    return false;  // a face of the cage without area, or too far away
  }
  return true;
}

bool DeformEditor::undo() {
  Points points = design_.points();
  return !isDragging_ && history_.undo(points) && take(std::move(points));
}

bool DeformEditor::redo() {
  Points points = design_.points();
  return !isDragging_ && history_.redo(points) && take(std::move(points));
}

bool DeformEditor::reset() {
  const Points rest = design_.restPoints();
  Points points = design_.points(), before = points;
  const bool isAll = selectedCount() == 0;
  for (std::size_t n = 0; n < points.size(); ++n)
    if (isAll || isSelected_[n]) points[n] = rest[n];
  if (isDragging_ || !take(std::move(points))) return false;
  history_.add(std::move(before));
  return true;
}

void DeformEditor::selectNone() {
  std::fill(isSelected_.begin(), isSelected_.end(), 0);
}

void DeformEditor::selectAll() {
  std::fill(isSelected_.begin(), isSelected_.end(), 1);
}

std::size_t DeformEditor::selectedCount() const {
  return static_cast<std::size_t>(std::count(isSelected_.begin(), isSelected_.end(), 1));
}

std::vector<PictureStroke> DeformEditor::strokes(const render::Camera& camera) const {
  std::vector<std::optional<V2d>> places;
  for (const V3d& point : design_.points()) places.push_back(seenAt(point, camera));
  std::vector<PictureStroke> all;
  for (const auto& [a, b] : net_)
    if (places[a] && places[b])
      all.push_back({*places[a], *places[b], !isSelected_[a] && !isSelected_[b]});
  return all;
}

std::vector<PictureMark> DeformEditor::marks(const render::Camera& camera) const {
  std::vector<PictureMark> all;
  for (std::size_t n = 0; n < design_.points().size(); ++n)
    if (const std::optional<V2d> at = seenAt(design_.points()[n], camera))
      all.push_back({.place = *at, .isCorner = false, .isSelected = isSelected_[n] != 0});
  return all;
}

}  // namespace viewer
