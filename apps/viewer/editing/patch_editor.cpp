#include "apps/viewer/editing/patch_editor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/viewer/interaction/surface_ray.h"
#include "apps/viewer/text/point_text.h"
#include "levelset/grids/sample.h"

namespace viewer {
namespace {

using Imath::V2d;
using Imath::V3d;

// Distance from a side within which a press adds a point to it, pixels.
constexpr double kLineReach = 6;

/// Distance of a picture position from a line, pixels.
double distanceTo(const V2d& from, const V2d& to, const V2d& place) {
  const V2d along = to - from;
  const double length2 = along.length2();
  const double share =
      length2 > 0 ? std::clamp((place - from).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (place - from - along * share).length();
}

/// Index of the point of a path that is nearest to a point.
std::size_t nearestOn(const std::vector<V3d>& path, const V3d& point) {
  const auto nearest = std::min_element(path.begin(), path.end(), [&](const V3d& a, const V3d& b) {
    return (a - point).length2() < (b - point).length2();
  });
  return static_cast<std::size_t>(nearest - path.begin());
}

}  // namespace

PatchEditor::PatchEditor(std::shared_ptr<const Model> base, PatchDesign design)
    : base_(std::move(base)), design_(std::move(design)) {}

std::vector<PatchEditor::Handle> PatchEditor::handles() const {
  std::vector<Handle> all;
  for (std::size_t i = 0; i < design_.corners.size(); ++i) all.push_back({std::nullopt, i});
  for (std::size_t side = 0; side < 4; ++side)
    for (std::size_t i = 0; i < design_.sides[side].size(); ++i) all.push_back({side, i});
  return all;
}

const V3d& PatchEditor::pointOf(const Handle& handle) const {
  return handle.side ? design_.sides[*handle.side][handle.index] : design_.corners[handle.index];
}

bool PatchEditor::facesAway(const V3d& point, const render::Camera& camera) const {
  const V3d normal = levelset::BandSampler(base_->scene.solids.front().band).normal(point);
  const V3d toEye = camera.orthoHeight ? -camera.axis() : camera.from - point;
  return normal.dot(toEye) < 0;
}

std::optional<V3d> PatchEditor::surfaceAt(const V2d& place, const render::Camera& camera) const {
  const std::optional<SurfaceHit> hit = surfaceUnder(
      base_->scene.solids.front().band, base_->solidBounds, camera.ray(place.x, place.y));
  // Rounded, so that the command line gets the same bits.
  return hit ? std::optional(asWritten(hit->position)) : std::nullopt;
}

std::optional<PatchEditor::Handle> PatchEditor::handleAt(const V2d& place,
                                                         const render::Camera& camera) const {
  std::optional<Handle> found;
  double least = kPointReach;
  for (const Handle& handle : handles()) {
    const std::optional<V2d> at = seenAt(pointOf(handle), camera);
    if (!at || (*at - place).length() > least || facesAway(pointOf(handle), camera)) continue;
    least = (*at - place).length();
    found = handle;
  }
  return found;
}

std::optional<PatchEditor::Handle> PatchEditor::addToSide(const V2d& place,
                                                          const render::Camera& camera) {
  std::optional<std::size_t> side;
  std::size_t step = 0;
  double least = kLineReach;
  for (std::size_t s = 0; s < 4; ++s)
    for (std::size_t i = 0; i + 1 < sides_[s].size(); ++i) {
      const std::optional<V2d> from = seenAt(sides_[s][i], camera),
                               to = seenAt(sides_[s][i + 1], camera);
      if (!from || !to || facesAway(sides_[s][i], camera)) continue;
      const double distance = distanceTo(*from, *to, place);
      if (distance > least) continue;
      least = distance;
      side = s;
      step = i;
    }
  if (!side) return std::nullopt;
  const std::optional<V3d> point = surfaceAt(place, camera);
  if (!point) return std::nullopt;
  std::vector<V3d>& points = design_.sides[*side];
  const auto before = std::count_if(points.begin(), points.end(), [&](const V3d& other) {
    return nearestOn(sides_[*side], other) <= step;
  });
  points.insert(points.begin() + before, *point);
  return Handle{*side, static_cast<std::size_t>(before)};
}

bool PatchEditor::press(const V2d& place, const render::Camera& camera) {
  grip_ = V2d(0, 0);
  std::optional<Handle> held = handleAt(place, camera);
  if (held) {
    grip_ = *seenAt(pointOf(*held), camera) - place;
  } else if (!design_.isWhole()) {
    const std::optional<V3d> point = surfaceAt(place, camera);
    if (!point) return false;
    design_.corners.push_back(*point);
    held = Handle{std::nullopt, design_.corners.size() - 1};
  } else {
    held = addToSide(place, camera);
  }
  if (!held) return false;
  selected_ = held;
  isDragging_ = true;
  return true;
}

bool PatchEditor::moveTo(const V2d& place, const render::Camera& camera) {
  if (!isDragging_ || !selected_) return false;
  const std::optional<V3d> point = surfaceAt(place + grip_, camera);
  V3d& held = selected_->side ? design_.sides[*selected_->side][selected_->index]
                              : design_.corners[selected_->index];
  if (!point || *point == held) return false;
  held = *point;
  return true;
}

void PatchEditor::release() {
  if (!std::exchange(isDragging_, false) || !selected_ || !design_.isWhole()) return;
  const V3d held = pointOf(*selected_);
  orderCorners(base_->scene.solids.front().band, design_);
  for (const Handle& handle : handles())
    if (pointOf(handle) == held) selected_ = handle;
}

bool PatchEditor::removeSelected() {
  if (!selected_) return false;
  const auto at = static_cast<std::ptrdiff_t>(selected_->index);
  if (selected_->side) {
    std::vector<V3d>& points = design_.sides[*selected_->side];
    points.erase(points.begin() + at);
  } else {
    design_.corners.erase(design_.corners.begin() + at);
    design_.sides = {};
    sides_ = {};
  }
  selected_.reset();
  isDragging_ = false;
  return true;
}

void PatchEditor::setTexture(const PatchDesign& changed) {
  design_.texture = changed.texture;
  design_.columns = std::max(1, changed.columns);
  design_.relief = changed.relief;
}

std::vector<PictureStroke> PatchEditor::strokes(const render::Camera& camera) const {
  std::vector<PictureStroke> all;
  for (const std::vector<V3d>& side : sides_)
    for (std::size_t i = 0; i + 1 < side.size(); ++i) {
      const std::optional<V2d> from = seenAt(side[i], camera), to = seenAt(side[i + 1], camera);
      if (from && to) all.push_back({*from, *to, facesAway(0.5 * (side[i] + side[i + 1]), camera)});
    }
  return all;
}

std::vector<PictureMark> PatchEditor::marks(const render::Camera& camera) const {
  std::vector<PictureMark> all;
  for (const Handle& handle : handles())
    if (const std::optional<V2d> at = seenAt(pointOf(handle), camera))
      all.push_back({*at, !handle.side, selected_ == handle, facesAway(pointOf(handle), camera)});
  return all;
}

}  // namespace viewer
