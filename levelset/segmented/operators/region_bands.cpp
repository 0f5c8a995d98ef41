#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <tuple>

#include "levelset/distance/redistance.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Int32Tree;
using Leaf = FloatTree::LeafNodeType;

Coord originOfBlock(const Coord& block) {
  return {block[0] << 3, block[1] << 3, block[2] << 3};
}

/// Writes the distances of a block to regions.
/// @param isInside  by label
template <typename IsInside>
void storeBlock(const SegmentedData& data, std::size_t number, const IsInside& isInside,
                Leaf& leaf) {
  const SegmentedBlock& block = data.blocks[number];
  SegmentedReader reader(data);
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    const Coord at = block.origin + SegmentedData::localOf(n);
    const SegmentedReader::Nearest near = reader.nearest(at);
    const bool isOwn = isInside(near.label);
    float distance = data.background;
    if (isInside(near.neighbour) != isOwn) {
      distance = near.distance;
    } else {
      // The nearest interface is one inside, or outside.
      for (std::size_t p = block.palette; p < data.blocks[number + 1].palette; ++p)
        if (isInside(data.palettes[p]) != isOwn)
          distance = std::min(distance, reader.distanceTo(at, near, data.palettes[p]));
    }
    // A grid point on an interface belongs to one of its sides.
    if (distance < data.background)
      leaf.setValueOn(n, isOwn ? -std::max(distance, std::numeric_limits<float>::min()) : distance);
    else
      leaf.setValueOff(n, isOwn ? -data.background : data.background);
  }
}

}  // namespace

NarrowBand storedBandOfAll(const SegmentedField& field, const std::vector<RegionLabel>& regions) {
  const SegmentedData& data = *field.shared();
  const bool holdsVoid = !regions.empty() && regions.front() == kVoid;
  const auto isInside = [&](RegionLabel label) {
    return std::binary_search(regions.begin(), regions.end(), label) != holdsVoid;
  };
  openvdb::FloatGrid::Ptr grid = emptyLevelSet(data.transform->copy(), data.halfWidth);
  FloatTree& tree = grid->tree();
  auto tile = data.blockTree->cbeginValueAll();
  for (; tile; ++tile) {
    if (*tile >= 0 || !isInside(SegmentedData::labelOfTile(*tile))) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    tree.sparseFill({originOfBlock(box.min()), originOfBlock(box.max()).offsetBy(7)},
                    -data.background, /*active=*/false);
  }
  std::vector<Leaf*> leaves(data.blockCount());
  for (std::size_t b = 0; b < data.blockCount(); ++b) {
    const auto first = data.palettes.begin() + data.blocks[b].palette,
               last = data.palettes.begin() + data.blocks[b + 1].palette;
    const auto inside = std::count_if(first, last, isInside);
    if (inside > 0 && inside < last - first)
      leaves[b] = tree.touchLeaf(data.blocks[b].origin);
    else if (inside > 0)
      tree.addTile(1, data.blocks[b].origin, -data.background, /*active=*/false);
  }
  tbb::parallel_for(std::size_t{0}, data.blockCount(), [&](std::size_t b) {
    if (leaves[b]) storeBlock(data, b, isInside, *leaves[b]);
  });
  return makeBand(grid);
}

NarrowBand storedBand(const SegmentedField& field, RegionLabel region) {
  return storedBandOfAll(field, {region});
}

RegionBands regionBands(const SegmentedField& field, double halfWidth, std::size_t maxMemory,
                        const Progress& progress) {
  RegionBands result;
  result.labels = field.labels();
  result.labels.insert(result.labels.begin(), kVoid);
  const double count = static_cast<double>(result.labels.size());
  for (std::size_t r = 0; r < result.labels.size(); ++r) {
    const double done = static_cast<double>(r);
    // With one region, the void is its complement.
    result.bands.push_back(
        r == 1 && result.labels.size() == 2
            ? result.bands[0]
            : redistance(storedBand(field, result.labels[r]),
                         {.halfWidth = halfWidth,
                          .maxMemory = maxMemory,
                          .progress = subProgress(progress, done / count, (done + 1) / count)}));
  }
  return result;
}

std::vector<LabelledLeaf> labelledLeaves(const RegionBands& bands) {
  std::vector<LabelledLeaf> leaves;
  for (std::size_t r = 0; r < bands.bands.size(); ++r)
    for (auto leaf = vdb(bands.bands[r]).tree().cbeginLeaf(); leaf; ++leaf)
      leaves.push_back({SegmentedData::blockCoord(leaf->origin()), r, &*leaf});
  tbb::parallel_sort(leaves.begin(), leaves.end(), [](const auto& a, const auto& b) {
    return std::tie(a.block, a.region) < std::tie(b.block, b.region);
  });
  return leaves;
}

std::vector<std::size_t> firstLeaves(const std::vector<LabelledLeaf>& leaves) {
  std::vector<std::size_t> firsts;
  for (std::size_t i = 0; i < leaves.size(); ++i)
    if (i == 0 || leaves[i].block != leaves[i - 1].block) firsts.push_back(i);
  firsts.push_back(leaves.size());
  return firsts;
}

namespace {

/// Fills the tiles inside the regions with their labels.
Int32Tree::Ptr tilesOf(const RegionBands& bands) {
  const auto tiles = std::make_shared<Int32Tree>(SegmentedData::tile(kVoid));
  for (std::size_t r = 0; r < bands.bands.size(); ++r) {
    if (bands.labels[r] == kVoid) continue;
    auto it = vdb(bands.bands[r]).tree().cbeginValueAll();
    it.setMaxDepth(FloatTree::DEPTH - 2);  // tiles only
    for (; it; ++it) {
      if (*it >= 0) continue;
      const openvdb::CoordBBox box = it.getBoundingBox();
      tiles->sparseFill(
          {SegmentedData::blockCoord(box.min()), SegmentedData::blockCoord(box.max())},
          SegmentedData::tile(bands.labels[r]), false);
    }
  }
  return tiles;
}

/// Signed distances of the voxels of a block to the regions near it.
struct BlockRegions {
  struct Region {
    RegionLabel label;
    float sign;
    const float* values;  ///< null: `far` everywhere
    float far;
    [[nodiscard]] float at(std::uint32_t n) const { return values ? sign * values[n] : far; }
  };
  std::vector<Region> regions;  ///< by label

  [[nodiscard]] const Region* find(RegionLabel label) const {
    const auto found = std::lower_bound(regions.begin(), regions.end(), label,
                                        [](const Region& r, RegionLabel l) { return r.label < l; });
    return found != regions.end() && found->label == label ? &*found : nullptr;
  }
  [[nodiscard]] float at(RegionLabel label, std::uint32_t n, float far) const {
    const Region* region = find(label);
    return region ? region->at(n) : far;
  }
};

class BandsPartition {
 public:
  BandsPartition(const RegionBands& bands, double halfWidth)
      : bands_(bands),
        transform_(vdb(bands.bands.front()).transform().copy()),
        halfWidth_(halfWidth),
        far_(vdb(bands.bands.front()).background()) {}

  [[nodiscard]] SegmentedField run(const Progress& progress) {
    const std::vector<LabelledLeaf> leaves = labelledLeaves(bands_);
    const std::vector<std::size_t> firsts = firstLeaves(leaves);
    const Int32Tree::Ptr tiles = tilesOf(bands_);
    std::vector<OwnedBlock> blocks(firsts.size() - 1);
    regions_.resize(blocks.size());
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
      const std::span leavesHere(leaves.data() + firsts[b], firsts[b + 1] - firsts[b]);
      gather(leavesHere, *tiles, regions_[b]);
      blocks[b].block = leavesHere.front().block;
      setOwners(regions_[b], blocks[b]);
    });
    const auto distances = [&](std::size_t b, std::uint32_t n, RegionLabel own,
                               const std::vector<RegionLabel>& others, std::vector<float>& result) {
      const float depth = -regions_[b].at(own, n, 0);
      result.clear();
      std::size_t nearest = 0;
      for (std::size_t i = 0; i < others.size(); ++i) {
        result.push_back(std::max(0.0f, regions_[b].at(others[i], n, far_)));
        if (result[i] < result[nearest]) nearest = i;
      }
      // Both distances belong to one interface. Their mean is zero where they balance, also if the
      // regions overlap or leave a gap by an error of the distances.
      if (result[nearest] < far_) result[nearest] = std::max(0.0f, (result[nearest] + depth) / 2);
    };
    return packPartition(transform_, halfWidth_, tiles, std::move(blocks), distances, progress);
  }

 private:
  /// Collects the regions near a block. The one that fills it has no leaf there.
  void gather(std::span<const LabelledLeaf> leaves, const Int32Tree& tiles,
              BlockRegions& result) const {
    const Coord block = leaves.front().block;
    const RegionLabel filled = SegmentedData::labelOfTile(tiles.getValue(block));
    bool hasVoid = false;
    for (const LabelledLeaf& entry : leaves) {
      hasVoid = hasVoid || bands_.labels[entry.region] == kVoid;
      result.regions.push_back(
          {bands_.labels[entry.region], bands_.sign(entry.region), entry.leaf->buffer().data(), 0});
    }
    if (!hasVoid && vdb(bands_.bands.front()).tree().getValue(originOfBlock(block)) > 0)
      result.regions.push_back({kVoid, 1, nullptr, -far_});
    if (filled != kVoid) result.regions.push_back({filled, 1, nullptr, -far_});
    std::sort(result.regions.begin(), result.regions.end(),
              [](const auto& a, const auto& b) { return a.label < b.label; });
  }

  static void setOwners(const BlockRegions& regions, OwnedBlock& block) {
    block.owners.resize(SegmentedData::kVoxels);
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
      float least = std::numeric_limits<float>::infinity();
      for (const BlockRegions::Region& region : regions.regions) {
        const float value = region.at(n);
        if (value >= least) continue;
        least = value;
        block.owners[n] = region.label;
      }
    }
    block.shorten();
  }

  const RegionBands& bands_;
  openvdb::math::Transform::Ptr transform_;
  double halfWidth_;
  float far_;
  std::vector<BlockRegions> regions_;  ///< by block
};

}  // namespace

SegmentedField fieldOfBands(const RegionBands& bands, double halfWidth, const Progress& progress) {
  return BandsPartition(bands, halfWidth).run(progress);
}

}  // namespace levelset
