#include "levelset/distance/distance_transform.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/distance/moved/meeting_parts.h"
#include "levelset/distance/nearest/point_distance.h"
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
  const double shift = request.shift;
  LeafOrTile result{std::make_unique<LeafNode>(block.origin, background, false)};
  std::unique_ptr<ClosestPointLeaf> points;
  if (request.visitPoints) points = std::make_unique<ClosestPointLeaf>();
  bool isOn = false;
  const NearestPoints::Mask near = nearBand(block, request);
  polisher.prepare(block, near);
  float* values = result.leaf->buffer().data();
  for (auto it = near.beginOff(); it; ++it)
    if (distanceAt(block, it.pos(), polisher, request).value < 0) values[it.pos()] = -background;
  for (auto it = near.beginOn(); it; ++it) {
    const openvdb::Index n = it.pos();
    auto [value, closest] = nearDistanceAt(block, n, polisher, request);
    if (points) (*points)[n] = closest->point;
    if (before && shift == 0 && before->isValueOn(n))
      value = keptOr(value, static_cast<double>(before->getValue(n)) / voxelSize, polisher,
                     block.nearest[n]);
    setDistance(*result.leaf, n, value, request.halfWidth, voxelSize, background);
  }
  if (points && !result.leaf->isEmpty()) request.visitPoints(*result.leaf, *points);
  if (result.leaf->isEmpty() && result.leaf->isConstant(result.tile, isOn)) result.leaf.reset();
  return result;
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
  // Blocks in a cube of 4³ blocks follow each other, so that the dense copies of their surroundings
  // are used again.
  std::sort(blocks.begin(), blocks.end(), [](const Block* a, const Block* b) {
    const Coord cubeA = a->origin & ~31, cubeB = b->origin & ~31;
    return cubeA != cubeB ? cubeA < cubeB : a->origin < b->origin;
  });
  std::vector<LeafOrTile> leaves(blocks.size());
  forEachWithPolisher(blocks.size(), surface,
                      subProgress(request.progress, 0.6, request.ofMovedSurface ? 0.8 : 1),
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
  if (request.ofMovedSurface)
    correctMeetingParts(*result, surface, nearest, request, subProgress(request.progress, 0.8, 1));
  result->setName(field.getName());
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  report(request.progress, 1);
  return result;
}

}  // namespace levelset::eikonal
