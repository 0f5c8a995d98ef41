#include "levelset/distance/distance_transform.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/distance/closest_point.h"
#include "levelset/distance/propagate.h"
#include "levelset/distance/signs.h"
#include "levelset/error.h"
#include "levelset/memory_estimate.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;
using Block = NearestPoints::Block;

// If the nearest surface points of two neighbouring grid points are farther apart than this, in
// voxels, these points belong to different parts of the surface.
constexpr double kOtherPart = 2;
// Refinement of a surface point decreases its distance from the grid point by at most this, in
// voxels.
constexpr double kPolishGain = 0.5;

// A grid point keeps its old value if that equals the computed distance within the error of
// tricubic interpolation. So repeated redistancing does not shift a distance field. The error, in
// voxels, is about kTricubicError times the square of the curvature. Its upper limit is kMostError,
// reached at a radius of curvature of about 8 voxels, and its lower limit is kRounding.
constexpr double kTricubicError = 0.03, kMostError = 1e-3, kRounding = 1e-6;

// Number of searches for a foot point. Each starts where the search before it left its dense block,
// the stored values around a leaf.
constexpr int kAttempts = 4;

/// Point of the zero set, in index space, and its distance from a grid point, voxels.
struct Closest {
  Vec3d point;
  double distance = 0;
  void takeIfNearer(const Closest& other) {
    if (other.distance < distance) *this = other;
  }
};

/// Finds the closest point of the zero set for a grid point. Refines the nearest surface points
/// that NearestPoints found for the grid point and for its six neighbours.
class Polisher {
 public:
  Polisher(const FloatTree& field, const SurfacePoints& points, const SharpPatches& patches)
      : cache_(field), points_(points), patches_(patches) {}

  /// Returns the interpolation error of distances to the surface beside a surface point, voxels.
  [[nodiscard]] double interpolationError(std::uint32_t point) const {
    const Jet jet = points_.jets[point].jet();
    const double bend = jet.xx * jet.xx + jet.yy * jet.yy + jet.zz * jet.zz +
                        2 * (jet.xy * jet.xy + jet.xz * jet.xz + jet.yz * jet.yz);
    const double slope = jet.gradient.lengthSqr();
    return std::max(kRounding, slope > 0 ? kTricubicError * bend / slope : 0);
  }

  Closest closest(const Block& block, openvdb::Index n) {
    const Coord c = LeafNode::offsetToLocalCoord(n);
    const Vec3d x = (block.origin + c).asVec3d();
    const std::uint32_t first = block.nearest[n];
    const Vec3d nearest = points_.positions[first];
    Closest best{nearest, (x - nearest).length()};
    const double start = best.distance;
    if (!block.own.isOn(n)) best.takeIfNearer(polish(x, first));
    for (int axis = 0; axis < 3; ++axis)
      for (int side = -1; side <= 1; side += 2) {
        const std::uint32_t other = neighbour(block, c, axis, side);
        if (other == NearestPoints::kNone || other == first) continue;
        const Vec3d point = points_.positions[other];
        if ((point - nearest).lengthSqr() < kOtherPart * kOtherPart) continue;
        if ((x - point).length() < start + kPolishGain) best.takeIfNearer(polish(x, other));
      }
    return best;
  }

 private:
  /// Finds the closest point of the zero set to x near a surface point. The search starts on the
  /// sharp patches (triangles near edges) if the surface point lies on them, else on the
  /// interpolant. If the point that it finds lies in the domain of the other of the two, the search
  /// continues on that one.
  Closest polish(const Vec3d& x, std::uint32_t point) {
    const Vec3d start = points_.positions[point];
    if (!points_.sharp[point]) {
      const Foot foot = closestPointByOneStep(points_.jets[point].jet(), x, start);
      if (foot.converged && !patches_.covers(Coord::floor(foot.point)))
        return {foot.point, foot.distance};
      return polishOnInterpolant(x, start);
    }
    const TriangleTree::Hit hit = patches_.nearest(x, (x - start).length());
    if (!hit.found) return {start, (x - start).length()};
    if (patches_.covers(Coord::floor(hit.point))) return {hit.point, hit.distance};
    return polishOnInterpolant(x, hit.point);
  }

  /// Finds the foot point with Newton's method from `start`; returns `start` if that fails. Far
  /// inside a solid, a large part of the surface is almost equally near. The foot point may then be
  /// far from `start`, so a search that leaves the block restarts at that position.
  Closest polishOnInterpolant(const Vec3d& x, Vec3d start) {
    const Closest first{start, (x - start).length()};
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const DenseBlock& block = cache_.around(start);
      const Vec3d origin = block.origin().asVec3d();
      const Foot foot = closestPoint(block, x - origin, start - origin);
      if (foot.converged) {
        if (!changesSignAround(block, foot.point)) break;
        const Closest smooth{foot.point + origin, foot.distance};
        if (!patches_.covers(Coord::floor(smooth.point))) return smooth;
        const TriangleTree::Hit hit = patches_.nearest(x, foot.distance + kPolishGain);
        return hit.found ? Closest{hit.point, hit.distance} : smooth;
      }
      if (!foot.left) break;
      start = foot.point + origin;
    }
    return first;
  }

  static std::uint32_t neighbour(const Block& block, Coord c, int axis, int side) {
    c[axis] += side;
    if (c[axis] >= 0 && c[axis] < 8) return block.nearest[LeafNode::coordToOffset(c)];
    Coord d(1);
    d[axis] += side;
    const Block* other = block.neighbours[static_cast<std::size_t>(d.x() * 9 + d.y() * 3 + d.z())];
    return other ? other->nearest[LeafNode::coordToOffset(c)] : NearestPoints::kNone;
  }

  DenseBlockCache cache_;
  const SurfacePoints& points_;
  const SharpPatches& patches_;
};

/// Result for one block: a leaf, or the value of a tile if no grid point is in the band and all
/// have the same sign.
struct LeafOrTile {
  std::unique_ptr<LeafNode> leaf;
  float tile = 0;
};

/// Computes the distances of one block.
/// @param before  leaf of the input field; null where the field has none
LeafOrTile makeLeaf(const Block& block, const LeafNode* before, Polisher& polisher,
                    const DistanceRequest& request, double voxelSize, float background) {
  const double shift = request.shift, halfWidth = request.halfWidth;
  auto leaf = std::make_unique<LeafNode>(block.origin, background, false);
  std::unique_ptr<ClosestPointLeaf> points;
  if (request.visitPoints) points = std::make_unique<ClosestPointLeaf>();
  bool isOn = false;
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
    const bool inside = block.inside.isOn(n);
    const double sign = inside ? -1 : 1;
    double value = sign * 1e30;
    if (block.nearest[n] != NearestPoints::kNone) {
      value = sign * std::sqrt(static_cast<double>(block.squared[n])) - shift;
      if (std::abs(value) < halfWidth + kPolishGain) {
        const Closest closest = polisher.closest(block, n);
        value = sign * closest.distance - shift;
        if (points) (*points)[n] = closest.point;
      }
    }
    // An inside grid point stays inside when its distance rounds to zero.
    if (inside && shift == 0) value = std::min(value, -1e-7);
    if (before && shift == 0 && before->isValueOn(n)) {
      const double kept = static_cast<double>(before->getValue(n)) / voxelSize;
      if (std::abs(value - kept) < kMostError &&
          std::abs(value - kept) < polisher.interpolationError(block.nearest[n]))
        value = kept;
    }
    if (std::abs(value) < halfWidth)
      leaf->setValueOn(n, static_cast<float>(value * voxelSize));
    else
      leaf->setValueOnly(n, value < 0 ? -background : background);
  }
  float tile = 0;
  if (points && !leaf->isEmpty()) request.visitPoints(*leaf, *points);
  if (leaf->isEmpty() && leaf->isConstant(tile, isOn)) return {nullptr, tile};
  return {std::move(leaf), 0};
}

FloatTree::Ptr makeTree(const FloatTree& field, const FloatTree& interpolated,
                        const SurfacePoints& points, const SharpPatches& patches,
                        const NearestPoints& nearest, const DistanceRequest& request,
                        double voxelSize) {
  const auto background = backgroundOf(request.halfWidth, voxelSize);
  auto result = std::make_shared<FloatTree>(background);
  copySigns(
      field, [&](const Coord& origin) { return nearest.holds(origin); }, *result);

  std::vector<const Block*> blocks;
  for (const Block& block : nearest.blocks()) blocks.push_back(&block);
  std::sort(blocks.begin(), blocks.end(),
            [](const Block* a, const Block* b) { return a->origin < b->origin; });
  std::vector<LeafOrTile> leaves(blocks.size());
  tbb::enumerable_thread_specific<Polisher> polishers(
      [&] { return Polisher(interpolated, points, patches); });
  constexpr std::size_t kBatch = 4096;
  for (std::size_t begin = 0; begin < blocks.size(); begin += kBatch) {
    const std::size_t end = std::min(begin + kBatch, blocks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16), [&](const auto& range) {
      Polisher& polisher = polishers.local();
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        leaves[i] = makeLeaf(*blocks[i], field.probeConstLeaf(blocks[i]->origin), polisher, request,
                             voxelSize, background);
    });
    report(request.progress,
           0.6 + 0.4 * static_cast<double>(end) / static_cast<double>(blocks.size()));
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (leaves[i].leaf)
      result->addLeaf(leaves[i].leaf.release());
    else
      result->addTile(1, blocks[i]->origin, leaves[i].tile, false);
  }
  openvdb::tools::pruneTiles(*result);
  return result;
}

}  // namespace

FloatGrid::Ptr distanceTransform(const FloatGrid& field, const DistanceRequest& request) {
  NearestPoints::Reach reach;
  reach.outside = std::max(0.0, request.halfWidth + request.shift);
  reach.inside = std::max(0.0, request.halfWidth - request.shift);
  reach.region = request.region;
  std::optional<CoordBBox> within = request.region;
  if (within)
    within->expand(static_cast<int>(std::min(1e9, std::max(reach.inside, reach.outside) + 2)));

  // === Surface points
  FloatTree::ConstPtr interpolated = field.constTreePtr();
  const auto reportProgress = [&](double done) {
    report(request.progress, 0.2 * done);
    return true;
  };
  const SharpPatches patches =
      request.mayHaveEdges ? SharpPatches(field, within, reportProgress) : SharpPatches();
  SurfacePoints points = findSurfacePoints(*interpolated, within, patches);
  if (points.thin) {
    interpolated = thicken(field.tree());
    points = findSurfacePoints(*interpolated, within, patches);
  }
  if (points.size() == 0)
    throw InvalidInput(
        fmt::format("the field has no zero crossing{}, so there is no surface to "
                    "measure from; give a solid with a surface",
                    within ? " near the region" : ""));
  if (points.size() >= NearestPoints::kNone)
    throw ResourceLimit(
        "more than 2^32 grid points lie beside the surface; use larger "
        "voxels");
  MemoryEstimate estimate;
  for (const Coord& c : points.gridPoints) estimate.surface.expand(c);
  // There are at least 1.15 surface points for each voxel² of the surface.
  estimate.area = static_cast<double>(points.size()) / 1.15;
  estimate.inside = reach.inside;
  estimate.outside = reach.outside;
  estimate.region = request.region;
  // Bytes for the state of propagate.h and the result, including unused grid points in the blocks.
  estimate.bytesPerGridPoint = 25;
  checkMemory(estimate, request.maxMemory);
  report(request.progress, 0.3);

  // === Nearest surface point of each grid point
  NearestPoints nearest(field.tree(), points, reach);
  nearest.run(subProgress(request.progress, 0.3, 0.6));

  // === Distances
  FloatGrid::Ptr result = FloatGrid::create(makeTree(field.tree(), *interpolated, points, patches,
                                                     nearest, request, field.voxelSize()[0]));
  result->setTransform(field.transform().copy());
  result->setName(field.getName());
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  report(request.progress, 1);
  return result;
}

}  // namespace levelset::eikonal
