#include "apps/regress/truth/gaps.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace regress {

using Imath::V3d;
using openvdb::Coord;

namespace {

constexpr int kEdge = 8;  // edge of a leaf, in grid points

/// Returns the origins of the leaf blocks that can contain grid points of a region.
std::vector<Coord> blocksOf(const Region& region, const openvdb::math::Transform& transform) {
  const double h = transform.voxelSize()[0];
  const double toCorner = (kEdge - 1) / 2.0 * std::numbers::sqrt3 * h * region.steepest;
  const openvdb::Vec3d middle = transform.worldToIndex(levelset::toVdb(region.centre));
  Coord low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = static_cast<int>(std::floor(middle[axis] - region.extent / h)) & ~(kEdge - 1);
    high[axis] = static_cast<int>(std::ceil(middle[axis] + region.extent / h)) & ~(kEdge - 1);
  }
  std::vector<Coord> blocks;
  Coord c;
  for (c[0] = low[0]; c[0] <= high[0]; c[0] += kEdge)
    for (c[1] = low[1]; c[1] <= high[1]; c[1] += kEdge)
      for (c[2] = low[2]; c[2] <= high[2]; c[2] += kEdge) {
        const openvdb::Vec3d at = c.asVec3d() + openvdb::Vec3d((kEdge - 1) / 2.0);
        const double value = region.value(levelset::toImath(transform.indexToWorld(at)));
        if (value > region.low - toCorner && value < region.high + toCorner) blocks.push_back(c);
      }
  return blocks;
}

template <typename Grid>
GapCount countBlock(const Region& region, const Grid& grid, const Coord& origin) {
  using GridLeaf = typename Grid::TreeType::LeafNodeType;
  const GridLeaf* leaf = grid.tree().probeConstLeaf(origin);
  const bool isTileOn = !leaf && grid.tree().isValueOn(origin);
  GapCount count;
  for (openvdb::Index i = 0; i < GridLeaf::SIZE; ++i) {
    const Coord c = origin + GridLeaf::offsetToLocalCoord(i);
    const V3d p = levelset::toImath(grid.indexToWorld(c));
    if (region.compared && !region.compared(p)) continue;
    const double value = region.value(p);
    if (!(value > region.low && value < region.high)) continue;
    ++count.wanted;
    count.missing += leaf ? !leaf->isValueOn(i) : !isTileOn;
  }
  return count;
}

template <typename Grid>
GapCount countBlocks(const Region& region, const Grid& grid, const std::vector<Coord>& blocks) {
  std::vector<GapCount> counts(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(),
                    [&](std::size_t i) { counts[i] = countBlock(region, grid, blocks[i]); });
  GapCount all;
  for (const GapCount& count : counts) all.add(count);
  return all;
}

}  // namespace

double GapCount::share() const {
  return wanted > 0 ? missing / wanted : std::nan("");
}

GapCount countWithoutLeaf(const Region& region, const openvdb::FloatGrid& grid) {
  std::vector<Coord> blocks = blocksOf(region, grid.transform());
  std::erase_if(blocks, [&](const Coord& origin) { return grid.tree().probeConstLeaf(origin); });
  return countBlocks(region, grid, blocks);
}

double missingShare(const Region& region, const openvdb::FloatGrid& grid) {
  return countBlocks(region, grid, blocksOf(region, grid.transform())).share();
}

double missingShare(const Region& region, const openvdb::Vec3SGrid& grid) {
  return countBlocks(region, grid, blocksOf(region, grid.transform())).share();
}

Region bandRegion(const Truth& truth, double halfWidth, double voxelSize) {
  const double reach = std::max(halfWidth - 1, halfWidth / 2) * voxelSize;
  return {.value = truth.distance,
          .low = -reach,
          .high = reach,
          .centre = truth.centre,
          .extent = truth.reach + reach,
          .compared = truth.compared};
}

}  // namespace regress
