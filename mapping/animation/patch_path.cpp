#include "mapping/animation/patch_path.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "mapping/animation/surface_frame.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_walk.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::InvalidInput;

constexpr double kNoDistance = 1e-6;  // voxels; points closer than this count as equal

/// Finds the point at the share `part` of a path's length: the index of its segment, and the share
/// of the segment's length up to the point.
std::pair<std::size_t, double> segmentAt(const std::vector<V3d>& path, double part) {
  double left = part * pathLength(path);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = (path[i] - path[i - 1]).length();
    if (left <= length || i + 1 == path.size())
      return {i - 1, length > 0 ? std::clamp(left / length, 0.0, 1.0) : 0};
    left -= length;
  }
  return {0, 0};
}

/// Point at the share `part` of a path's length, projected onto the surface.
V3d pointOn(const SurfaceField& field, const std::vector<V3d>& path, double part) {
  const auto [i, share] = segmentAt(path, part);
  V3d p = path[i] + (path[i + 1] - path[i]) * share;
  V3d projected = p;
  return field.project(projected, 0) ? projected : p;
}

std::array<V2d, 4> between(const std::array<V2d, 4>& a, const std::array<V2d, 4>& b, double part) {
  std::array<V2d, 4> result;
  for (std::size_t i = 0; i < 4; ++i) result[i] = a[i] + (b[i] - a[i]) * part;
  return result;
}

[[noreturn]] void refuseApart(const V3d& a, const V3d& b) {
  throw InvalidInput(
      fmt::format("the surface does not connect {} and {}; put both patches on the same surface "
                  "component of the base",
                  pointAsOption(a), pointAsOption(b)));
}

}  // namespace

PatchPath::PatchPath(const levelset::NarrowBand& base, Footprint from, Footprint to, CarryRule rule,
                     const std::vector<V3d>& guide)
    : base_(base), from_(std::move(from)), to_(std::move(to)), rule_(rule) {
  isConstant_ = from_.corners == to_.corners && from_.centre == to_.centre &&
                from_.direction == to_.direction;
  if (isConstant_) return;
  if (rule_ == CarryRule::Rigid && !(from_.reach && to_.reach)) {
    throw InvalidInput(fmt::format(
        "no geodesic leads from the centre {} of the patch to each of its corners; use --carry "
        "corners, or a smaller patch",
        pointAsOption(from_.reach ? to_.centre : from_.centre)));
  }
  findCentrePath(guide);
  carryDirections();
  if (rule_ == CarryRule::Corners) findCornerPaths();
}

void PatchPath::findCentrePath(const std::vector<V3d>& guide) {
  const SurfaceField field(base_);
  const V3d &a = from_.centre, &b = to_.centre;
  if ((b - a).length() <= kNoDistance * base_.voxelSize()) {
    path_ = {a, b};
    return;
  }
  std::vector<V3d> path;
  if (guide.size() > 1 && pathLength(guide) > 0) path = geodesicLike(field, 0, a, b, guide);
  if (path.empty()) {
    hasJumped_ = !guide.empty();
    path = geodesic(field, 0, a, b);
  }
  if (path.empty()) refuseApart(a, b);
  const double voxels = pathLength(path) / base_.voxelSize();
  path_ = sampleByArcLength(path, static_cast<std::size_t>(std::ceil(voxels)) + 2);
  for (std::size_t i = 1; i + 1 < path_.size(); ++i) {
    V3d p = path_[i];
    if (field.project(p, 0)) path_[i] = p;
  }
}

void PatchPath::carryDirections() {
  const SurfaceField field(base_);
  normals_ = {from_.normal};
  directions_ = {from_.direction};
  for (std::size_t i = 1; i < path_.size(); ++i) {
    V3d normal = i + 1 == path_.size() ? to_.normal : field.normal(path_[i]);
    if (normal == V3d(0)) normal = normals_.back();
    const V3d direction = carried(directions_.back(), normals_.back(), normal);
    directions_.push_back(direction == V3d(0) ? eastOf(normal) : direction);
    normals_.push_back(normal);
  }
  const V3d &u = directions_.back(), &n = normals_.back();
  turn_ = std::atan2(to_.direction.dot(n.cross(u)), to_.direction.dot(u));
}

SurfaceFrame PatchPath::frameAt(double part) const {
  const SurfaceField field(base_);
  const std::size_t i = segmentAt(path_, part).first;
  SurfaceFrame frame;
  frame.centre = pointOn(field, path_, part);
  frame.normal = field.normal(frame.centre);
  if (frame.normal == V3d(0)) frame.normal = normals_[i];
  frame.direction = carried(directions_[i], normals_[i], frame.normal);
  if (frame.direction == V3d(0)) frame.direction = eastOf(frame.normal);
  frame.direction = frame.turned(turn_ * part);
  return frame;
}

void PatchPath::findCornerPaths() {
  // Largest step between two samples of a corner's path, as a multiple of the mean step.
  constexpr double kJump = 4;
  const SurfaceField field(base_);
  const double voxel = base_.voxelSize();
  double farthest = pathLength(path_);
  for (std::size_t i = 0; i < 4; ++i)
    farthest = std::max(farthest, (to_.corners[i] - from_.corners[i]).length());
  const auto steps = static_cast<std::size_t>(std::max(4.0, std::ceil(farthest / (2 * voxel))));
  isAlike_ = from_.reach && to_.reach;
  std::array<std::vector<V3d>, 4> beside;
  for (std::vector<V3d>& path : beside) path.resize(steps + 1);
  for (std::size_t s = 0; isAlike_ && s <= steps; ++s) {
    const double part = static_cast<double>(s) / static_cast<double>(steps);
    const SurfaceFrame frame = frameAt(part);
    const auto corners = cornersFrom(field, frame, between(*from_.reach, *to_.reach, part));
    isAlike_ = corners.has_value();
    for (std::size_t i = 0; isAlike_ && i < 4; ++i)
      beside[i][s] = s == 0 ? from_.corners[i] : s == steps ? to_.corners[i] : (*corners)[i];
  }
  for (std::size_t i = 0; isAlike_ && i < 4; ++i) {
    const double most =
        std::max(2 * voxel, kJump * pathLength(beside[i]) / static_cast<double>(steps));
    for (std::size_t s = 1; s <= steps; ++s)
      isAlike_ = isAlike_ && (beside[i][s] - beside[i][s - 1]).length() <= most;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d &a = from_.corners[i], &b = to_.corners[i];
    if ((b - a).length() <= kNoDistance * voxel &&
        pathLength(isAlike_ ? beside[i] : path_) < voxel) {
      cornerPaths_[i] = {a, b};
      continue;
    }
    cornerPaths_[i] = isAlike_ ? straighten(field, 0, beside[i]) : geodesic(field, 0, a, b);
    if (cornerPaths_[i].size() < 2) refuseApart(a, b);
  }
}

Footprint PatchPath::at(double part) const {
  if (part <= 0) return from_;
  if (part >= 1) return to_;
  Footprint result = from_;
  // If both heights are equal, this form yields the bits of `from_.height`.
  result.height = from_.height + (to_.height - from_.height) * part;
  if (isConstant_) return result;
  const SurfaceField field(base_);
  const SurfaceFrame frame = frameAt(part);
  result.centre = frame.centre;
  result.direction = frame.direction;
  result.normal = frame.normal;
  result.reach.reset();
  if (from_.reach && to_.reach) result.reach = between(*from_.reach, *to_.reach, part);
  if (rule_ == CarryRule::Corners) {
    for (std::size_t i = 0; i < 4; ++i) result.corners[i] = pointOn(field, cornerPaths_[i], part);
    return result;
  }
  const auto corners = cornersFrom(field, frame, *result.reach);
  if (!corners) {
    throw InvalidInput(
        fmt::format("the surface breaks off between the centre {} of the patch and its "
                    "corners; use --carry corners, or choose other positions",
                    pointAsOption(frame.centre)));
  }
  result.corners = *corners;
  return result;
}

}  // namespace mapping
