#include "apps/viewer/editing/sculpt_editor.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace viewer {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::BrushEffect;
using levelset::HeightField;

constexpr double kDabStep = 0.25;  // distance of dabs, in radii
constexpr std::size_t kMostDabsOfAMove = 1000;

/// Height of the ground at a position; NaN beside it and in triangles with a missing corner.
double heightAt(const HeightField& field, double x, double y) {
  const double u = (x - field.origin.x) / field.spacing.x,
               v = (y - field.origin.y) / field.spacing.y;
  if (!(u >= 0 && v >= 0 && u <= field.columns - 1 && v <= field.rows - 1)) return NAN;
  const int column = std::min(static_cast<int>(u), field.columns - 2),
            row = std::min(static_cast<int>(v), field.rows - 2);
  const double s = u - column, t = v - row;
  const auto z = [&](int i, int j) { return static_cast<double>(field.at(column + i, row + j)); };
  // The diagonal goes from (0, 0) to (1, 1).
  return s >= t ? z(0, 0) + s * (z(1, 0) - z(0, 0)) + t * (z(1, 1) - z(1, 0))
                : z(0, 0) + t * (z(0, 1) - z(0, 0)) + s * (z(1, 1) - z(0, 1));
}

BrushEffect effectOf(Brush brush) {
  switch (brush) {
    case Brush::Raise:
    case Brush::Lower:
      return BrushEffect::Raise;
    case Brush::Smooth:
      return BrushEffect::Smooth;
    case Brush::Flatten:
      return BrushEffect::Flatten;
    case Brush::Noise:
      return BrushEffect::Noise;
    case Brush::Erode:
      return BrushEffect::Erode;
  }
  return BrushEffect::Raise;
}

double strengthOf(const BrushChoice& choice) {
  switch (choice.brush) {
    case Brush::Raise:
    case Brush::Noise:
      return choice.height;
    case Brush::Lower:
      return -choice.height;
    default:
      return choice.share;
  }
}

}  // namespace

const char* brushName(Brush brush) {
  constexpr std::array<const char*, kBrushes.size()> kNames = {"raise",   "lower", "smooth",
                                                               "flatten", "noise", "erode"};
  return kNames[static_cast<std::size_t>(brush)];
}

std::optional<V3d> groundUnder(const HeightField& field, const render::Camera::Ray& ray) {
  if (field.columns < 2 || field.rows < 2) return std::nullopt;
  const Imath::Box3d box = field.bounds();
  double first = 0, last = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = ray.direction[axis];
    double in = (box.min[axis] - ray.origin[axis]) / step,
           out = (box.max[axis] - ray.origin[axis]) / step;
    if (step == 0) {
      if (ray.origin[axis] < box.min[axis] || ray.origin[axis] > box.max[axis]) return std::nullopt;
      continue;
    }
    if (in > out) std::swap(in, out);
    first = std::max(first, in);
    last = std::min(last, out);
  }
  if (!(first <= last)) return std::nullopt;
  // Steps of half a cell along the ground, and of the complete way for vertical rays.
  const double ground =
      std::hypot(ray.direction.x / field.spacing.x, ray.direction.y / field.spacing.y);
  const double most = 4.0 * (field.columns + field.rows);
  const double count = std::clamp(std::ceil(2 * (last - first) * ground), 1.0, most);
  const auto above = [&](double t) {
    const V3d p = ray.origin + ray.direction * t;
    return p.z - heightAt(field, p.x, p.y);
  };
  // The ends lie on the box, whose sides are those of the ground, so rounding must not miss it.
  const double margin = 1e-9 * (last - first);
  first += margin;
  last -= margin;
  const double touch = 1e-6 * box.size().length();
  // A level top of the ground lies on the box.
  if (std::abs(above(first)) <= touch) return ray.origin + ray.direction * first;
  double before = first;
  for (double n = 1; n <= count; ++n) {
    const double now = first + (last - first) * (n / count);
    const double from = above(before), to = above(now);
    if (from * to <= 0) {
      double low = before, high = now;
      for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        (above(middle) * from > 0 ? low : high) = middle;
      }
      return ray.origin + ray.direction * high;
    }
    before = now;
  }
  // At the lowest point of the box the ray may end on the ground.
  const V3d end = ray.origin + ray.direction * last;
  if (std::abs(above(last)) <= touch) return end;
  return std::nullopt;
}

std::string whyNoSculpting(const Model& model) {
  if (!model.terrain) return "The ground of a terrain can be sculpted; open one.";
  if (model.terrain->wasGeographic)
    return "The terrain is in degrees; make one in metres with 'terrain --metric' first.";
  if (!model.terrain->field)
    return "A tiled terrain is not in memory; make a file of a part of it with 'read --box'.";
  return "";
}

SculptEditor::SculptEditor(const std::shared_ptr<const Model>& model,
                           const levelset::GroundEdits* edits)
    : base_(model), ground_(*model->terrain->field, {.cells = kShownCells, .edits = edits}) {
  const V3d size = model->solidBounds.size();
  const double radius = std::max(size.x, size.y) / 16;
  setChoice({.radius = radius, .height = radius / 20});
}

void SculptEditor::setChoice(const BrushChoice& choice) {
  const V2d spacing = field().spacing;
  choice_ = choice;
  // A smaller brush may lie between the samples.
  choice_.radius = std::max(choice.radius, 1.5 * std::max(spacing.x, spacing.y));
  choice_.height = std::max(choice.height, 0.0);
  choice_.share = std::clamp(choice.share, 0.0, 1.0);
}

void SculptEditor::dabAt(const V2d& place) {
  const BrushChoice& choice = done_.back().choice;
  ground_.apply({.effect = effectOf(choice.brush),
                 .center = place,
                 .radius = choice.radius,
                 .strength = strengthOf(choice)});
  done_.back().places.push_back(place);
  undone_.clear();
  hasUnsaved_ = true;
}

bool SculptEditor::press(const V2d& place, const render::Camera& camera) {
  pointer_ = groundUnder(field(), render::CameraRays(camera).at(place.x, place.y));
  if (!pointer_) return false;
  ground_.beginStroke();
  done_.push_back({choice_, {}});
  isDragging_ = true;
  try {
    dabAt({pointer_->x, pointer_->y});
  } catch (...) {
    done_.pop_back();
    isDragging_ = false;
    throw;
  }
  return true;
}

bool SculptEditor::moveTo(const V2d& place, const render::Camera& camera) {
  pointer_ = groundUnder(field(), render::CameraRays(camera).at(place.x, place.y));
  if (!isDragging_ || !pointer_) return false;
  const double step = kDabStep * done_.back().choice.radius;
  bool isChanged = false;
  for (std::size_t n = 0; n < kMostDabsOfAMove; ++n) {
    const V2d last = done_.back().places.back(), way = V2d(pointer_->x, pointer_->y) - last;
    if (way.length() < step) break;
    dabAt(last + way * (step / way.length()));
    isChanged = true;
  }
  return isChanged;
}

bool SculptEditor::undo() {
  if (isDragging_ || !ground_.canUndo()) return false;
  ground_.undo();
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
  return hasUnsaved_ = true;
}

bool SculptEditor::redo() {
  if (isDragging_ || !ground_.canRedo()) return false;
  ground_.redo();
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
  return hasUnsaved_ = true;
}

std::string SculptEditor::actions() const {
  std::string text;
  for (const Stroke& stroke : done_) {
    const BrushChoice& choice = stroke.choice;
    std::string places;
    for (const V2d& place : stroke.places)
      places += fmt::format("{}{},{},0", places.empty() ? "" : " ", place.x, place.y);
    text += fmt::format("{}sculpt --brush {} --at=\"{}\" --radius {} --strength={}",
                        text.empty() ? "" : " ! ",
                        choice.brush == Brush::Lower ? "raise" : brushName(choice.brush), places,
                        choice.radius, strengthOf(choice));
  }
  return text;
}

std::shared_ptr<const Model> SculptEditor::model() const {
  auto model = std::make_shared<Model>(*base_);
  auto terrain = std::make_shared<ShownTerrain>(*base_->terrain);
  terrain->field = std::make_shared<const HeightField>(ground_.field());
  terrain->store = levelset::patchStoreOf(terrain->field, ground_.pyramid());
  terrain->isReadAtOnce = true;
  model->terrain = terrain;
  return model;
}

std::vector<PictureStroke> SculptEditor::strokes(const render::Camera& camera) const {
  std::vector<PictureStroke> strokes;
  if (!pointer_) return strokes;
  constexpr int kParts = 48;
  std::optional<V2d> before;
  for (int n = 0; n <= kParts; ++n) {
    const double angle = 2 * M_PI * n / kParts;
    const double x = pointer_->x + choice_.radius * std::cos(angle),
                 y = pointer_->y + choice_.radius * std::sin(angle), z = heightAt(field(), x, y);
    const std::optional<V2d> at = std::isnan(z) ? std::nullopt : seenAt({x, y, z}, camera);
    if (before && at) strokes.push_back({*before, *at});
    before = at;
  }
  return strokes;
}

}  // namespace viewer
