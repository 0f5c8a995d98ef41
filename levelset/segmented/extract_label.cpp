#include "levelset/segmented/extract_label.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using RegionLeaf = openvdb::FloatTree::LeafNodeType;

/// Signed distances to a region on a block of the field.
std::unique_ptr<RegionLeaf> regionLeaf(const SegmentedData& data, const SegmentedBlock& block,
                                       RegionLabel region) {
  auto leaf = std::make_unique<RegionLeaf>(block.origin, data.background, false);
  SegmentedReader reader(data);
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    const Coord at = block.origin + SegmentedData::localOf(n);
    const SegmentedReader::Nearest near = reader.nearest(at);
    const float value = near.label == region ? -near.distance : reader.distanceTo(at, near, region);
    if (std::abs(value) < data.background)
      leaf->setValueOn(n, value);
    else
      leaf->setValueOff(n, value);
  }
  return leaf;
}

/// Signed distances to a region, as far as the field stores them.
FloatGrid::Ptr regionGrid(const SegmentedData& data, RegionLabel region) {
  const FloatGrid::Ptr grid = emptyLevelSet(data.transform->copy(), data.halfWidth);
  auto tile = data.blockTree->cbeginValueAll();
  for (; tile; ++tile) {
    if (*tile != SegmentedData::tile(region)) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    const Coord low(box.min()[0] << 3, box.min()[1] << 3, box.min()[2] << 3),
        high((box.max()[0] << 3) + 7, (box.max()[1] << 3) + 7, (box.max()[2] << 3) + 7);
    grid->tree().sparseFill({low, high}, -data.background, false);
  }
  std::vector<std::unique_ptr<RegionLeaf>> leaves(data.blockCount());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t b) {
    const SegmentedBlock &block = data.blocks[b], &next = data.blocks[b + 1];
    const auto first = data.palettes.begin() + block.palette,
               last = data.palettes.begin() + next.palette;
    if (std::find(first, last, region) != last) leaves[b] = regionLeaf(data, block, region);
  });
  for (std::unique_ptr<RegionLeaf>& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  pruneOneSided(grid->tree());
  return grid;
}

}  // namespace

NarrowBand extractLabel(const SegmentedField& field, RegionLabel region,
                        const ExtractLabelOptions& options) {
  if (region == kVoid)
    throw UsageError("label 0 is the void, which has no bounds; give a label from 1 to 65535");
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth))
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
  const std::vector<RegionLabel> labels = field.labels();
  if (!std::binary_search(labels.begin(), labels.end(), region))
    throw NoSurface(
        fmt::format("no grid point has the label {}; give a label of the field", region));
  report(options.progress, 0);
  NarrowBand signs = makeBand(regionGrid(*field.shared(), region));
  return redistance(std::move(signs), {.halfWidth = options.halfWidth,
                                       .maxMemory = options.maxMemory,
                                       .progress = subProgress(options.progress, 0.2, 1)});
}

}  // namespace levelset
