#include "levelset/offset/offset.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using LeafNode = openvdb::FloatTree::LeafNodeType;

// Distance from the moved surface, voxels, within which re-distancing reads the shifted field, and
// least half width for which no re-distancing is needed.
constexpr double kPadding = 3;
// Least shift, voxels, for which the distances to a moved surface follow from the old surface.
// After a smaller shift, parts that meet can be so near to each other that they count as one part.
constexpr double kLeastShift = 2;
// Voxels by which offset lengths at points of the surface between the sampled points may lie
// outside the range of the sampled lengths.
constexpr double kRangeMargin = 0.5;

double checkedHalfWidth(const NarrowBand& solid, const OffsetOptions& options) {
  const double halfWidth = options.halfWidth.value_or(solid.halfWidth());
  if (!std::isfinite(halfWidth) || halfWidth < 1)
    throw UsageError(fmt::format("the half width is {} voxels; give at least 1", halfWidth));
  return halfWidth;
}

void requireSurface(const NarrowBand& solid) {
  requireSolid(solid);
  if (solid.isEmpty())
    throw NoSurface("the solid is empty, so there is no surface to move; give a solid");
}

/// Requests distances near the possible positions of the new surface.
/// @param shift  mean offset of the surface, voxels
/// @param reach  largest deviation of the offset from `shift`, voxels
eikonal::DistanceRequest nearSurfaceRequest(const OffsetOptions& options, double shift,
                                            double reach) {
  eikonal::DistanceRequest request;
  request.halfWidth = reach + kPadding;
  request.shift = shift;
  request.maxMemory = options.maxMemory;
  return request;
}

/// Re-distances a field. Distances to the old surface minus the offset are only a bound where parts
/// of the moved surface meet.
/// @param done  progress so far, 0 to 1
NarrowBand redistanced(const openvdb::FloatGrid& field, double halfWidth,
                       const OffsetOptions& options, double done) {
  eikonal::DistanceRequest request;
  request.halfWidth = halfWidth;
  request.maxMemory = options.maxMemory;
  request.progress = subProgress(options.progress, done, 1);
  return makeBand(eikonal::distanceTransform(field, request));
}

bool hasSurface(const openvdb::FloatGrid& field) {
  return field.activeVoxelCount() > 0 && eikonal::hasZeroCrossing(field.tree());
}

/// Offset lengths, in voxels, at points of the surface.
class Lengths {
 public:
  Lengths(const openvdb::FloatGrid& field, const ScalarField& distance)
      : field_(field), distance_(distance) {}

  [[nodiscard]] double at(const openvdb::Vec3d& point) const {
    const Imath::V3d world = toImath(field_.indexToWorld(point));
    const double length = distance_(world);
    if (!std::isfinite(length)) {
      throw InvalidInput(
          fmt::format("the distance is {} at {:.6g},{:.6g},{:.6g} on the surface; give a field "
                      "that is finite there",
                      length, world.x, world.y, world.z));
    }
    return length / field_.voxelSize()[0];
  }

  struct Range {
    double low = INFINITY, high = -INFINITY;
  };
  /// Range of the offset lengths, voxels, over the surface points that are closest to the grid
  /// points beside the surface.
  [[nodiscard]] Range range(const OffsetOptions& options) const {
    Range all;
    std::mutex mutex;
    eikonal::DistanceRequest request = nearSurfaceRequest(options, 0, 0);
    request.progress = subProgress(options.progress, 0, 0.3);
    request.visitPoints = [&](const LeafNode& leaf, const eikonal::ClosestPointLeaf& points) {
      Range own;
      for (auto it = leaf.cbeginValueOn(); it; ++it) {
        const double length = at(points[it.pos()]);
        own = {std::min(own.low, length), std::max(own.high, length)};
      }
      const std::lock_guard lock(mutex);
      all = {std::min(all.low, own.low), std::max(all.high, own.high)};
    };
    (void)eikonal::distanceTransform(field_, request);
    return all;
  }

 private:
  const openvdb::FloatGrid& field_;
  const ScalarField& distance_;
};

}  // namespace

bool followsFromOld(double distance, double halfWidth) {
  return halfWidth >= kPadding && std::abs(distance) >= kLeastShift;
}

// This reach is measured, not proven: the test RegionOfInterest.OffsetsHaveEqualBits compares
// regions of random solids with the complete result, to the bit. A bound that holds in all cases
// adds the reach of the search for creases, MovedSurface::reach(), and is about 16 voxels larger
// for a shift of 5 voxels. It has three terms. A grid point reads the searches of others within
// kCreaseReach. A search reads nearest surface points within MovedSurface::reach(). These are
// determined by the field within the distance that they propagate and distanceReach(0). Searches
// rarely go that far: on the dragon, 0.4 % of them pass 3 voxels and none passes 12.
double offsetReach(double distance, double halfWidth) {
  // Other offsets compute the shifted field first, and then the distances from it.
  const double more =
      followsFromOld(distance, halfWidth) ? eikonal::kCreaseReach : distanceReach(kPadding);
  return std::abs(distance) + distanceReach(halfWidth) + more;
}

NarrowBand offset(NarrowBand solid, double distance, const OffsetOptions& options) {
  if (!std::isfinite(distance))
    throw UsageError(fmt::format("the distance is {}; give a finite length", distance));
  requireSurface(solid);
  const double halfWidth = checkedHalfWidth(solid, options);
  if (distance == 0 && halfWidth == solid.halfWidth()) return solid;
  if (distance == 0) return redistanced(vdb(solid), halfWidth, options, 0);

  eikonal::DistanceRequest request = nearSurfaceRequest(options, distance / solid.voxelSize(), 0);
  request.progress = subProgress(options.progress, 0, 0.6);
  request.ofMovedSurface = followsFromOld(request.shift, halfWidth);
  if (request.ofMovedSurface) request.progress = options.progress;
  if (request.ofMovedSurface) request.halfWidth = halfWidth;
  openvdb::FloatGrid::Ptr own = takeUnshared(solid);
  const openvdb::FloatGrid::Ptr moved = own ? eikonal::distanceTransform(std::move(own), request)
                                            : eikonal::distanceTransform(vdb(solid), request);
  if (!hasSurface(*moved))
    throw NoSurface(
        fmt::format("the result is empty after an offset of {} world units, because no part of "
                    "the solid is "
                    "thicker than twice that; use a smaller length",
                    distance));
  if (request.ofMovedSurface) return makeBand(moved);
  return redistanced(*moved, halfWidth, options, 0.6);
}

NarrowBand offsetBy(NarrowBand solid, const ScalarField& distance, const OffsetOptions& options) {
  if (!distance) throw UsageError("the distance is missing; give a formula or a grid of numbers");
  requireSurface(solid);
  const double halfWidth = checkedHalfWidth(solid, options);
  const double voxel = solid.voxelSize();
  const Lengths lengths(vdb(solid), distance);
  const Lengths::Range range = lengths.range(options);

  // === Compute φ(x) − length(closest point) near the possible positions of the new surface
  const double middle = (range.low + range.high) / 2;
  eikonal::DistanceRequest request =
      nearSurfaceRequest(options, middle, (range.high - range.low) / 2 + kRangeMargin);
  request.progress = subProgress(options.progress, 0.3, 0.7);
  const auto limit = static_cast<float>(request.halfWidth * voxel);
  openvdb::FloatTree displaced;
  std::mutex mutex;
  request.visitPoints = [&](const LeafNode& leaf, const eikonal::ClosestPointLeaf& points) {
    auto part = std::make_unique<LeafNode>(leaf);
    for (auto it = part->beginValueOn(); it; ++it) {
      const double length = lengths.at(points[it.pos()]);
      const double value = static_cast<double>(*it) - (length - middle) * voxel;
      it.setValue(std::clamp(static_cast<float>(value), -limit, limit));
    }
    const std::lock_guard lock(mutex);
    displaced.addLeaf(part.release());
  };
  const openvdb::FloatGrid::Ptr moved = eikonal::distanceTransform(vdb(solid), request);
  for (auto leaf = displaced.beginLeaf(); leaf; ++leaf)
    *moved->tree().touchLeaf(leaf->origin()) = *leaf;
  if (!hasSurface(*moved))
    throw NoSurface(
        fmt::format("the result is empty after offsets of {:.6g} to {:.6g} world units; use "
                    "smaller lengths",
                    range.low * voxel, range.high * voxel));
  return redistanced(*moved, halfWidth, options, 0.7);
}

}  // namespace levelset
