#include "levelset/distance/distance_transform.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/distance/polisher.h"
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

// A grid point keeps its old value if that equals the computed distance within the error of
// tricubic interpolation. So repeated redistancing does not shift a distance field. kMostError is
// the upper limit of that error, voxels, reached at a radius of curvature of about 8 voxels.
constexpr double kMostError = 1e-3;

/// Distance of a grid point, voxels, and its closest point if it is near the band.
struct PointDistance {
  double value = 0;
  std::optional<Closest> closest = {};
};

/// Computes the distance of a grid point from the surface moved by the requested shift.
PointDistance distanceAt(const Block& block, openvdb::Index n, Polisher& polisher,
                         const DistanceRequest& request) {
  const bool inside = block.inside.isOn(n);
  const double sign = inside ? -1 : 1;
  PointDistance result{sign * 1e30};
  if (block.nearest[n] != NearestPoints::kNone) {
    result.value = sign * std::sqrt(static_cast<double>(block.squared[n])) - request.shift;
    if (std::abs(result.value) < request.halfWidth + kPolishGain) {
      result.closest = polisher.closest(block, n);
      result.value = sign * result.closest->distance - request.shift;
    }
  }
  // An inside grid point stays inside when its distance rounds to zero.
  if (inside && request.shift == 0) result.value = std::min(result.value, -1e-7);
  return result;
}

/// Returns the old value if the computed one equals it within the error of interpolation, voxels.
double keptOr(double value, double old, const Polisher& polisher, std::uint32_t surfacePoint) {
  const double change = std::abs(value - old);
  return change < kMostError && change < polisher.interpolationError(surfacePoint) ? old : value;
}

/// Result for one block: a leaf, or the value of a tile if no grid point is in the band and all
/// have the same sign.
struct LeafOrTile {
  std::unique_ptr<LeafNode> leaf;
  float tile = 0;
};

void setDistance(LeafNode& leaf, openvdb::Index n, double value, const DistanceRequest& request,
                 double voxelSize, float background) {
  if (std::abs(value) < request.halfWidth)
    leaf.setValueOn(n, static_cast<float>(value * voxelSize));
  else
    leaf.setValueOff(n, value < 0 ? -background : background);
}

/// Computes the distances of one block.
/// @param before  leaf of the input field; null where the field has none
LeafOrTile makeLeaf(const Block& block, const LeafNode* before, Polisher& polisher,
                    const DistanceRequest& request, double voxelSize, float background) {
  const double shift = request.shift;
  LeafOrTile result{std::make_unique<LeafNode>(block.origin, background, false)};
  std::unique_ptr<ClosestPointLeaf> points;
  if (request.visitPoints) points = std::make_unique<ClosestPointLeaf>();
  bool isOn = false;
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
    auto [value, closest] = distanceAt(block, n, polisher, request);
    if (points && closest) (*points)[n] = closest->point;
    if (before && shift == 0 && before->isValueOn(n))
      value = keptOr(value, static_cast<double>(before->getValue(n)) / voxelSize, polisher,
                     block.nearest[n]);
    setDistance(*result.leaf, n, value, request, voxelSize, background);
  }
  if (points && !result.leaf->isEmpty()) request.visitPoints(*result.leaf, *points);
  if (result.leaf->isEmpty() && result.leaf->isConstant(result.tile, isOn)) result.leaf.reset();
  return result;
}

/// Calls work(index, polisher) for the indices below `count`, in parallel.
template <typename Work>
void forEachWithPolisher(std::size_t count, const ZeroSet& surface, const Progress& progress,
                         const Work& work) {
  tbb::enumerable_thread_specific<Polisher> polishers([&] { return Polisher(surface); });
  constexpr std::size_t kBatch = 4096;
  for (std::size_t begin = 0; begin < count; begin += kBatch) {
    const std::size_t end = std::min(begin + kBatch, count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16), [&](const auto& range) {
      Polisher& polisher = polishers.local();
      for (std::size_t i = range.begin(); i != range.end(); ++i) work(i, polisher);
    });
    report(progress, static_cast<double>(end) / static_cast<double>(count));
  }
}

FloatTree::Ptr makeTree(const FloatTree& field, const ZeroSet& surface,
                        const NearestPoints& nearest, const DistanceRequest& request,
                        double voxelSize) {
  const auto background = backgroundOf(request.halfWidth, voxelSize);
  auto result = std::make_shared<FloatTree>(background);
  copySigns(
      field, [&](const Coord& origin) { return nearest.find(origin) != nullptr; }, *result);

  std::vector<const Block*> blocks;
  for (const Block& block : nearest.blocks()) blocks.push_back(&block);
  std::sort(blocks.begin(), blocks.end(),
            [](const Block* a, const Block* b) { return a->origin < b->origin; });
  std::vector<LeafOrTile> leaves(blocks.size());
  forEachWithPolisher(blocks.size(), surface, subProgress(request.progress, 0.6, 1),
                      [&](std::size_t i, Polisher& polisher) {
                        leaves[i] = makeLeaf(*blocks[i], field.probeConstLeaf(blocks[i]->origin),
                                             polisher, request, voxelSize, background);
                      });
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

  const BlockSelection blocks{within};
  const ZeroSet surface = readZeroSet(field, blocks, request.mayHaveEdges ? &blocks : nullptr,
                                      subProgress(request.progress, 0, 0.2));
  const SurfacePoints& points = surface.points;
  if (points.size() == 0)
    throw NoSurface(
        fmt::format("the field has no zero crossing{}, so there is no surface to "
                    "measure from; give a solid with a surface",
                    within ? " near the region" : ""));
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
  FloatGrid::Ptr result =
      FloatGrid::create(makeTree(field.tree(), surface, nearest, request, field.voxelSize()[0]));
  result->setTransform(field.transform().copy());
  result->setName(field.getName());
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  report(request.progress, 1);
  return result;
}

}  // namespace levelset::eikonal
