#include "mapping/surface/surface_walk.h"

#include <algorithm>
#include <cmath>

namespace mapping {
namespace {

using Imath::V3d;

constexpr double kStepVoxels = 0.5;
// Length of the shortest step, voxels; taken where the surface bends sharply.
constexpr double kShortestVoxels = 1.0 / 64;
constexpr double kMostTurn = 0.15;  // largest turn of the normal within a longer step, radians
constexpr double kSharpest = 1.2;   // largest turn of the normal within the shortest step, radians
// Largest |∇φ| on a surface. Distances have slope 1, and up to 1.1 where they are interpolated
// beside edges. At the end of a band the values jump, which looks like a steep wall but is not part
// of the surface.
constexpr double kSteepestWalk = 2.5;

V3d withoutNormal(const V3d& v, const V3d& normal) {
  return v - normal * v.dot(normal);
}

V3d unitOrZero(const V3d& v) {
  const double length = v.length();
  return length > 1e-9 ? v / length : V3d(0);
}

}  // namespace

V3d carried(const V3d& direction, const V3d& from, const V3d& to) {
  constexpr double kOpposite = -0.99;  // cosine; below it the least rotation is nearly ambiguous
  const V3d axis = from.cross(to);
  const double cosine = from.dot(to);
  if (cosine < kOpposite) return unitOrZero(withoutNormal(direction, to));
  const V3d turned =
      direction + axis.cross(direction) + axis.cross(axis.cross(direction)) / (1 + cosine);
  return unitOrZero(withoutNormal(turned, to));
}

SurfaceWalk::SurfaceWalk(const SurfaceField& field, double height, const V3d& from,
                         const V3d& direction)
    : field_(field),
      height_(height),
      position_(from),
      normal_(field.normal(from)),
      direction_(unitOrZero(withoutNormal(direction, normal_))) {}

bool SurfaceWalk::advance(double length) {
  if (direction_ == V3d(0) || normal_ == V3d(0)) return length == 0;
  const double voxel = field_.voxelSize();
  const double steps = std::max(1.0, std::ceil(length / (kStepVoxels * voxel)));
  for (int i = 0; i < static_cast<int>(steps); ++i)
    if (!step(length / steps)) return false;
  return true;
}

bool SurfaceWalk::step(double length) {
  V3d ahead = position_ + direction_ * length;
  const bool isShortest = length <= kShortestVoxels * field_.voxelSize();
  const auto inHalves = [&] { return !isShortest && step(0.5 * length) && step(0.5 * length); };
  if (!field_.project(ahead, height_)) return inHalves();
  V3d offset = ahead - position_;
  const double chord = offset.length();
  if (offset.dot(direction_) < 0.5 * length || chord > 2 * length) return inHalves();
  const double cosine = normal_.dot(field_.normal(ahead));
  const double turn = std::acos(std::clamp(cosine, -1.0, 1.0));
  if (turn > (isShortest ? kSharpest : kMostTurn)) return inHalves();
  // The projection makes the step too short or too long. So the next position is at the chord
  // length of an arc of length `length` whose normal turns by `turn`.
  const double half = 0.5 * turn;
  V3d next = position_ + offset * (length * (half > 1e-4 ? std::sin(half) / half : 1.0) / chord);
  if (!field_.project(next, height_)) return inHalves();
  const V3d gradient = field_.gradient(next);
  if (gradient.length() > kSteepestWalk) return inHalves();
  const V3d normal = unitOrZero(gradient);
  const V3d direction = carried(direction_, normal_, normal);
  if (direction == V3d(0)) return inHalves();
  position_ = next;
  normal_ = normal;
  direction_ = direction;
  walked_ += length;
  return true;
}

}  // namespace mapping
