#include "render/quadrics/quadric_caster.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "render/quadrics/quadric_tables.h"
#include "render/quadrics/quadric_trace.h"

namespace render {
namespace {

using Imath::V3d;

const QuadricModel& checkedQuadrics(const QuadricModel& model) {
  requireQuadrics(model);
  return model;
}

double farthestAlong(const Ball& ball, const V3d& direction) {
  return ball.centre.dot(direction) + static_cast<double>(ball.radius) * direction.length();
}

double farthestAlong(const Stick& stick, const V3d& direction) {
  const V3d along = (stick.b - stick.a).normalized();
  const double across = (direction - along * along.dot(direction)).length();
  return std::max(stick.a.dot(direction), stick.b.dot(direction)) +
         static_cast<double>(stick.radius) * across;
}

double farthestAlong(const Quadric& quadric, const V3d& direction) {
  const auto extent = extentOf(quadric, {direction.x, direction.y, direction.z, 0});
  return extent ? extent->high : -std::numeric_limits<double>::infinity();
}

}  // namespace

QuadricCaster::QuadricCaster(const QuadricModel& model, std::size_t maxBytes)
    : tables_(std::make_shared<const QuadricTables>(
          makeQuadricTables(checkedQuadrics(model), maxBytes))) {
  const std::vector<double> e = extents(
      {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1), V3d(-1, 0, 0), V3d(0, -1, 0), V3d(0, 0, -1)});
  bounds_ = {V3d(-e[3], -e[4], -e[5]), V3d(e[0], e[1], e[2])};
}

std::vector<double> QuadricCaster::extents(const std::vector<V3d>& directions) const {
  constexpr std::size_t kGrain = 1u << 13;  // slots
  const std::vector<double> none(directions.size(), -std::numeric_limits<double>::infinity());
  // Maxima do not depend on the order, except for the sign of zeros.
  std::vector<double> result = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, tables_->slotCount(), kGrain), none,
      [&](const auto& part, std::vector<double> most) {
        forEachStored(*tables_, part.begin(), part.end(), [&](const auto& primitive) {
          for (std::size_t n = 0; n < directions.size(); ++n)
            most[n] = std::max(most[n], farthestAlong(primitive, directions[n]));
        });
        return most;
      },
      [](std::vector<double> a, const std::vector<double>& b) {
        std::transform(a.begin(), a.end(), b.begin(), a.begin(),
                       [](double x, double y) { return std::max(x, y); });
        return a;
      });
  for (double& extent : result) extent += 0.0;
  return result;
}

std::size_t QuadricCaster::count() const {
  return tables_->count;
}

std::size_t QuadricCaster::bytes() const {
  return tables_->bytes();
}

QuadricModel QuadricCaster::model() const {
  QuadricModel model;
  forEachStored(*tables_, 0, tables_->slotCount(), [&](const auto& primitive) {
    using Primitive = std::decay_t<decltype(primitive)>;
    if constexpr (std::is_same_v<Primitive, Ball>)
      model.balls.push_back(primitive);
    else if constexpr (std::is_same_v<Primitive, Stick>)
      model.sticks.push_back(primitive);
    else
      model.quadrics.push_back(primitive);
  });
  return model;
}

QuadricHit QuadricCaster::firstHit(const Camera::Ray& ray) const {
  const NearestQuadric nearest = traceQuadrics(*tables_, ray, false, hasWideVectors());
  if (nearest.slot == NearestQuadric::kNoSlot) return {};
  return hitOn(ray, nearest.t, nearest.slot, nearest.face);
}

std::vector<QuadricHit> QuadricCaster::firstHits(std::span<const Camera::Ray> rays) const {
  std::vector<QuadricHit> hits(rays.size());
  std::array<NearestQuadric, kBeamRays> nearest;
  for (std::size_t first = 0; first < rays.size(); first += kBeamRays) {
    const std::size_t count = std::min<std::size_t>(kBeamRays, rays.size() - first);
    traceQuadricBeam(*tables_, rays.subspan(first, count), hasWideVectors(), nearest.data());
    for (std::size_t n = 0; n < count; ++n)
      if (nearest[n].slot != NearestQuadric::kNoSlot)
        hits[first + n] = hitOn(rays[first + n], nearest[n].t, nearest[n].slot, nearest[n].face);
  }
  return hits;
}

bool QuadricCaster::isOccluded(const Camera::Ray& ray) const {
  return traceQuadrics(*tables_, ray, true, hasWideVectors()).slot != NearestQuadric::kNoSlot;
}

QuadricHit QuadricCaster::hitAt(const Camera::Ray& ray, double distance, std::uint32_t slot) const {
  return hitOn(ray, distance, slot, tables_->rootIn(slot, relativeRay(*tables_, ray)).face);
}

QuadricHit QuadricCaster::hitOn(const Camera::Ray& ray, double distance, std::uint32_t slot,
                                int face) const {
  const QuadricKernel::QuadricRay relative = relativeRay(*tables_, ray);
  const V3d at = V3d(relative.x, relative.y, relative.z) + ray.direction * distance;
  return {true, distance, tables_->normalAt(slot, face, at), slot};
}

Imath::C3f QuadricCaster::colourOf(const QuadricHit& hit) const {
  return unpackedColour(tables_->colours[hit.slot]);
}

}  // namespace render
