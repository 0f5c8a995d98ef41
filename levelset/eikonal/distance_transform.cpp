#include "levelset/eikonal/distance_transform.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/eikonal/closest_point.h"
#include "levelset/eikonal/propagate.h"
#include "levelset/error.h"
#include "levelset/memory_limit.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;
using Block = NearestPoints::Block;

// A neighbour's surface point further than this from ours belongs to another part of the surface.
constexpr double kOtherPart = 2;
// How much nearer another part can turn out to be once both are polished.
constexpr double kPolishGain = 0.5;

constexpr int kAttempts = 4;

/// Distance of one grid point to the zero set, from the surface points that it and its neighbours
/// got.
class Polisher {
 public:
  Polisher(const FloatTree& field, const SurfacePoints& points) : cache_(field), points_(points) {}

  double distance(const Block& block, openvdb::Index n) {
    const Coord c = LeafNode::offsetToLocalCoord(n);
    const Vec3d x = (block.origin + c).asVec3d();
    const Vec3d nearest = points_.positions[block.nearest[n]];
    double best = (x - nearest).length();
    const double start = best;
    if (!block.own.isOn(n)) best = std::min(best, polish(x, nearest));
    for (int axis = 0; axis < 3; ++axis)
      for (int side = -1; side <= 1; side += 2) {
        const std::uint32_t other = neighbour(block, c, axis, side);
        if (other == NearestPoints::kNone || other == block.nearest[n]) continue;
        const Vec3d point = points_.positions[other];
        if ((point - nearest).lengthSqr() < kOtherPart * kOtherPart) continue;
        if ((x - point).length() < start + kPolishGain) best = std::min(best, polish(x, point));
      }
    return best;
  }

 private:
  /// Distance to the foot that Newton's method finds from `start`; as far as `start` if it fails.
  /// Far inside, where the ways to much of the surface are almost as long, the foot may be far
  /// along it.
  double polish(const Vec3d& x, Vec3d start) {
    const double first = (x - start).length();
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const DenseBlock& block = cache_.around(start);
      const Vec3d origin = block.origin().asVec3d();
      const Foot foot = closestPoint(block, x - origin, start - origin);
      if (foot.converged) return foot.distance;
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
};

/// What the result holds in the place of a block: a leaf, or a tile when no value of it lies in the
/// band and all are of one sign.
struct LeafOrTile {
  std::unique_ptr<LeafNode> leaf;
  float tile = 0;
};

LeafOrTile makeLeaf(const Block& block, Polisher& polisher, double shift, double halfWidth,
                    double voxelSize, float background) {
  auto leaf = std::make_unique<LeafNode>(block.origin, background, false);
  bool isOn = false;
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
    const bool inside = block.inside.isOn(n);
    const double sign = inside ? -1 : 1;
    double value = sign * 1e30;
    if (block.nearest[n] != NearestPoints::kNone) {
      value = sign * std::sqrt(static_cast<double>(block.squared[n])) - shift;
      if (std::abs(value) < halfWidth + kPolishGain)
        value = sign * polisher.distance(block, n) - shift;
    }
    // A grid point that was inside stays so when its distance rounds to nothing.
    if (inside && shift == 0) value = std::min(value, -1e-7);
    if (std::abs(value) < halfWidth)
      leaf->setValueOn(n, static_cast<float>(value * voxelSize));
    else
      leaf->setValueOnly(n, value < 0 ? -background : background);
  }
  float tile = 0;
  if (leaf->isEmpty() && leaf->isConstant(tile, isOn)) return {nullptr, tile};
  return {std::move(leaf), 0};
}

/// Signs where no distance was made: those of the operand.
void copySigns(const FloatTree& field, const NearestPoints& nearest, FloatTree& result) {
  const float background = result.background();
  for (auto it = field.cbeginValueAll(); it; ++it) {
    it.setMaxDepth(FloatTree::DEPTH - 2);
    if (it.getDepth() == FloatTree::DEPTH - 1) continue;
    if (*it < 0) result.addTile(it.getLevel(), it.getCoord(), -background, false);
  }
  for (auto leaf = field.cbeginLeaf(); leaf; ++leaf) {
    if (nearest.holds(leaf->origin())) continue;
    openvdb::Index inside = 0;
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) inside += leaf->getValue(n) < 0;
    if (inside == LeafNode::SIZE) {
      result.addTile(1, leaf->origin(), -background, false);
    } else if (inside > 0) {
      auto* signs = new LeafNode(leaf->origin(), background, false);
      for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n)
        if (leaf->getValue(n) < 0) signs->setValueOnly(n, -background);
      result.addLeaf(signs);
    }
  }
}

FloatTree::Ptr makeTree(const FloatTree& field, const FloatTree& interpolated,
                        const SurfacePoints& points, const NearestPoints& nearest,
                        const DistanceRequest& request, double voxelSize) {
  const auto background = static_cast<float>(request.halfWidth * voxelSize);
  auto result = std::make_shared<FloatTree>(background);
  copySigns(field, nearest, *result);

  std::vector<const Block*> blocks;
  for (const Block& block : nearest.blocks()) blocks.push_back(&block);
  std::sort(blocks.begin(), blocks.end(),
            [](const Block* a, const Block* b) { return a->origin < b->origin; });
  std::vector<LeafOrTile> leaves(blocks.size());
  tbb::enumerable_thread_specific<Polisher> polishers(
      [&] { return Polisher(interpolated, points); });
  constexpr std::size_t kBatch = 4096;
  for (std::size_t begin = 0; begin < blocks.size(); begin += kBatch) {
    const std::size_t end = std::min(begin + kBatch, blocks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16), [&](const auto& range) {
      Polisher& polisher = polishers.local();
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        leaves[i] =
            makeLeaf(*blocks[i], polisher, request.shift, request.halfWidth, voxelSize, background);
    });
    report(request.progress,
           0.6 + 0.4 * static_cast<double>(end) / static_cast<double>(blocks.size()),
           request.action);
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

/// Refuses what cannot fit before anything is allocated.
void requireRoom(const SurfacePoints& points, const NearestPoints::Reach& reach,
                 const DistanceRequest& request) {
  CoordBBox box;
  for (const Coord& c : points.gridPoints) box.expand(c);
  // Inwards there is never more than the solid's own box.
  const double out = reach.outside + 1;
  double reached = 1, longest = 0;
  for (int i = 0; i < 3; ++i) {
    double from = box.min()[i] - out, to = box.max()[i] + out;
    if (from < -2.1e9 || to > 2.1e9)
      throw ResourceLimit(
          fmt::format("{}: distances up to {:.4g} voxels pass the range of 32-bit indices; use a "
                      "smaller distance or larger voxels",
                      request.action, out));
    if (request.region) {
      from = std::max<double>(from, request.region->min()[i]);
      to = std::min<double>(to, request.region->max()[i]);
    }
    reached *= std::max(0.0, to - from + 1);
    longest = std::max(longest, static_cast<double>(box.dim()[i]));
  }
  // Steiner's formula for a convex body, or the whole box. There are at least 1.15 points to a unit
  // of area.
  const double area = static_cast<double>(points.size()) / 1.15;
  const double steiner = area * (std::min(reach.inside, longest / 2) + out) +
                         2 * M_PI * longest * out * out + 4.0 / 3 * M_PI * out * out * out;
  constexpr double kBytesPerGridPoint = 20;  // state and result, with the unused part of blocks
  const double bytes = std::min(reached, steiner) * kBytesPerGridPoint;
  requireMemory(bytes, memoryLimit(request.maxMemory), request.action);
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

  // === Points of the surface
  FloatTree::ConstPtr interpolated = field.constTreePtr();
  SurfacePoints points = findSurfacePoints(*interpolated, within);
  if (points.thin) {
    interpolated = thicken(field.tree());
    points = findSurfacePoints(*interpolated, within);
  }
  if (points.size() == 0)
    throw InvalidInput(
        fmt::format("{}: the field has no zero crossing{}, so there is no surface to "
                    "measure from; give a solid",
                    request.action, within ? " within reach of the region" : ""));
  if (points.size() >= NearestPoints::kNone)
    throw ResourceLimit(
        fmt::format("{}: more than 2^32 grid points lie beside the surface; use larger "
                    "voxels",
                    request.action));
  requireRoom(points, reach, request);
  report(request.progress, 0.3, request.action);

  // === Nearest of them for each grid point
  NearestPoints nearest(field.tree(), points, reach);
  nearest.run(subProgress(request.progress, 0.3, 0.6), request.action);

  // === Distances
  FloatGrid::Ptr result = FloatGrid::create(
      makeTree(field.tree(), *interpolated, points, nearest, request, field.voxelSize()[0]));
  result->setTransform(field.transform().copy());
  result->setName(field.getName());
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  report(request.progress, 1, request.action);
  return result;
}

}  // namespace levelset::eikonal
