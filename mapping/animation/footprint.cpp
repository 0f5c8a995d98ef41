#include "mapping/animation/footprint.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "mapping/animation/surface_frame.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/surface/surface_walk.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::NarrowBand;

/// Finds the tangent vector at the frame's centre whose geodesic, traced over the vector's length,
/// ends at `goal`. Starts with direction and length of the shortest path. Each step traces the
/// geodesic and corrects the vector by the gap to `goal`, as if the surface were flat. Since
/// geodesics spread on a curved surface, a step reduces the gap but does not close it. Returns none
/// if the gap stays above kNear.
std::optional<V3d> geodesicTo(const SurfaceField& field, const SurfaceFrame& frame,
                              const V3d& goal) {
  constexpr int kMostShots = 24;
  constexpr double kHit = 1e-4, kNear = 0.05;  // voxels: gap to stop at, largest accepted gap
  const std::vector<V3d> path = geodesic(field, 0, frame.centre, goal);
  if (path.size() < 2) return {};
  V3d best = frame.inPlane(path[1] - path[0]).normalized() * pathLength(path);
  V3d offset = best, correction(0);
  double miss = HUGE_VAL, step = 1;
  for (int shot = 0; shot < kMostShots && miss > kHit * field.voxelSize(); ++shot) {
    SurfaceWalk walk(field, 0, frame.centre, offset);
    const bool isWhole = walk.advance(offset.length());
    const V3d gap = goal - walk.position();
    if (isWhole && gap.length() < miss) {
      miss = gap.length();
      best = offset;
      const V3d ahead = best.normalized(), aside = frame.normal.cross(ahead);
      correction = ahead * gap.dot(walk.direction()) +
                   aside * gap.dot(walk.normal().cross(walk.direction()));
    } else {
      step *= 0.5;
    }
    if (!std::isfinite(miss)) return {};
    offset = best + correction * step;
  }
  if (miss > kNear * field.voxelSize()) return {};
  return best;
}

}  // namespace

V3d SurfaceFrame::inPlane(const V3d& offset) const {
  return offset - normal * normal.dot(offset);
}

V3d SurfaceFrame::turned(double angle) const {
  return direction * std::cos(angle) + normal.cross(direction) * std::sin(angle);
}

std::optional<std::array<V3d, 4>> cornersFrom(const SurfaceField& field, const SurfaceFrame& frame,
                                              const std::array<V2d, 4>& reach) {
  const V3d v = frame.normal.cross(frame.direction);
  std::array<V3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d offset = frame.direction * reach[i].x + v * reach[i].y;
    const std::optional<V3d> corner = walkStraight(field, 0, frame.centre, offset, offset.length());
    if (!corner) return {};
    corners[i] = *corner;
  }
  return corners;
}

PatchOutline outlineOf(const Patch& patch) {
  const ParticleLayer& surface = patch.layers.front();
  const std::size_t i = (surface.columns - 1) / 2, j = (surface.rows - 1) / 2;
  const std::size_t right = surface.columns / 2, above = surface.rows / 2;
  return {.corners = patch.corners,
          .middle = (surface.at(i, j) + surface.at(right, j) + surface.at(i, above) +
                     surface.at(right, above)) /
                    4.0,
          .height = patch.height};
}

Footprint footprintOf(const NarrowBand& base, const PatchOutline& outline) {
  Footprint footprint;
  footprint.height = outline.height;
  for (std::size_t i = 0; i < 4; ++i)
    footprint.corners[i] = closestSurfacePoint(base, outline.corners[i]);
  footprint.centre = closestSurfacePoint(base, outline.middle);
  SurfaceFrame frame{footprint.centre, V3d(0), SurfaceField(base).normal(footprint.centre)};
  const std::array<V3d, 4>& c = footprint.corners;
  const V3d u = outline.direction ? *outline.direction : c[1] + c[2] - c[0] - c[3];
  V3d direction = frame.inPlane(u);
  // The corners of a patch that goes all around an object give no direction of u; any tangent
  // direction is suitable.
  if (!(direction.length() > 1e-3 * u.length())) direction = eastOf(frame.normal);
  footprint.direction = direction.normalized();
  footprint.normal = frame.normal;
  return footprint;
}

Footprint withReach(const NarrowBand& base, Footprint footprint, bool keepsDirection) {
  const SurfaceField field(base);
  SurfaceFrame frame = frameOf(footprint);
  std::array<V3d, 4> offsets;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::optional<V3d> offset = geodesicTo(field, frame, footprint.corners[i]);
    if (!offset) return footprint;
    offsets[i] = *offset;
  }
  const V3d u = offsets[1] + offsets[2] - offsets[0] - offsets[3];
  if (!keepsDirection && u.length() > 1e-3 * offsets[0].length()) frame.direction = u.normalized();
  footprint.direction = frame.direction;
  const V3d v = frame.normal.cross(frame.direction);
  footprint.reach.emplace();
  for (std::size_t i = 0; i < 4; ++i)
    (*footprint.reach)[i] = {offsets[i].dot(frame.direction), offsets[i].dot(v)};
  return footprint;
}

Footprint carryFootprint(const NarrowBand& base, const Footprint& footprint, CarryRule rule) {
  Footprint moved = footprint;
  moved.centre = closestSurfacePoint(base, footprint.centre);
  const SurfaceField field(base);
  moved.normal = field.normal(moved.centre);
  moved.direction = carried(footprint.direction, footprint.normal, moved.normal);
  if (moved.direction == V3d(0)) moved.direction = eastOf(moved.normal);
  if (rule == CarryRule::Corners) {
    moved.reach.reset();
    for (V3d& corner : moved.corners) corner = closestSurfacePoint(base, corner);
    return moved;
  }
  const auto corners = cornersFrom(field, frameOf(moved), footprint.reach.value());
  if (!corners) {
    throw levelset::InvalidInput(fmt::format(
        "the surface breaks off between the centre {} of the patch and its corners; use "
        "--carry corners, or end the animation before this frame",
        pointAsOption(moved.centre)));
  }
  moved.corners = *corners;
  return moved;
}

double farthestMove(const Footprint& from, const Footprint& to) {
  double farthest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    farthest = std::max(farthest, (to.corners[i] - from.corners[i]).length());
  return farthest;
}

double Drift::factor() const {
  return std::max(most, least > 0 ? 1 / least : HUGE_VAL);
}

Drift driftBetween(const Footprint& first, const Footprint& now) {
  Drift drift{HUGE_VAL, 0};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double ratio = (now.corners[j] - now.corners[i]).length() /
                           (first.corners[j] - first.corners[i]).length();
      drift.least = std::min(drift.least, ratio);
      drift.most = std::max(drift.most, ratio);
    }
  return drift;
}

V3d movedAlong(const Footprint& from, const Footprint& to, const V3d& point) {
  const V3d offset = point - from.centre;
  return to.centre + to.direction * offset.dot(from.direction) +
         to.normal.cross(to.direction) * offset.dot(from.normal.cross(from.direction)) +
         to.normal * offset.dot(from.normal);
}

}  // namespace mapping
