#include "levelset/segmented/operators/offset_region.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/offset/offset.h"
#include "levelset/segmented/operators/edit_segmented.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Int32Tree;

constexpr double kEditHalfWidth = 3;  // voxels
constexpr double kOffsetGap = 0.01;   // voxels

/// Distributes the space that a region frees among its neighbours.
class FreedSpace {
 public:
  /// @param kept   rest of the region; empty if nothing is left
  /// @param depth  largest depth of a freed point in the region, world units
  FreedSpace(const SegmentedField& field, RegionLabel label, const NarrowBand& kept, double depth,
             std::size_t maxMemory)
      : data_(*field.shared()), label_(label), kept_(kept), maxMemory_(maxMemory) {
    findNeighbours();
    const double halfWidth = depth / data_.voxelSize + kEditHalfWidth;
    for (const RegionLabel neighbour : neighbours_)
      old_.push_back(redistance(storedBand(field, neighbour),
                                {.halfWidth = halfWidth, .maxMemory = maxMemory}));
  }

  [[nodiscard]] SegmentedField run(const Progress& progress) {
    for (std::size_t s = 0; s < neighbours_.size(); ++s) new_.push_back(grown(s));
    const Int32Tree::Ptr tiles = copyTiles(data_, [](RegionLabel l) { return l; });
    std::vector<OwnedBlock> blocks = gatherBlocks();
    const auto distances = [&](std::size_t b, std::uint32_t n, RegionLabel,
                               const std::vector<RegionLabel>& others, std::vector<float>& result) {
      distancesOf(origins_[b] + SegmentedData::localOf(n), others, result);
    };
    SegmentedField result = packPartition(data_.transform->copy(), data_.halfWidth, tiles,
                                          std::move(blocks), distances, progress);
    requireRegion(result);
    return result;
  }

 private:
  using Accessor = openvdb::tree::ValueAccessor<const FloatTree>;

  /// Signed distances of one thread.
  struct Reader {
    SegmentedReader field;
    std::optional<Accessor> kept;
    std::vector<Accessor> old;

    explicit Reader(const FreedSpace& space) : field(space.data_) {
      if (!space.kept_.isEmpty()) kept.emplace(vdb(space.kept_).tree());
      for (const NarrowBand& band : space.old_) old.emplace_back(vdb(band).tree());
    }
  };
  [[nodiscard]] float signOf(std::size_t s) const { return neighbours_[s] == kVoid ? -1.0f : 1.0f; }
  [[nodiscard]] float keptDistance(const Reader& reader, const Coord& at) const {
    return reader.kept ? reader.kept->getValue(at) : std::numeric_limits<float>::infinity();
  }

  /// Finds the regions around the own one, and the blocks around it.
  void findNeighbours() {
    std::set<RegionLabel> found;
    for (std::size_t b = 0; b < data_.blockCount(); ++b) {
      if (!holds(b)) continue;
      for (std::size_t p = data_.blocks[b].palette; p < data_.blocks[b + 1].palette; ++p)
        if (data_.palettes[p] != label_) found.insert(data_.palettes[p]);
      const Coord block = SegmentedData::blockCoord(data_.blocks[b].origin);
      for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          for (int z = -1; z <= 1; ++z) changed_.insert(block.offsetBy(x, y, z));
    }
    neighbours_.assign(found.begin(), found.end());
  }
  [[nodiscard]] bool holds(std::size_t block) const {
    const auto first = data_.palettes.begin() + data_.blocks[block].palette,
               last = data_.palettes.begin() + data_.blocks[block + 1].palette;
    return std::find(first, last, label_) != last;
  }

  /// Computes the distances to a neighbour together with its part of the freed space.
  [[nodiscard]] NarrowBand grown(std::size_t s) const {
    const float background = backgroundOf(kEditHalfWidth, data_.voxelSize);
    const openvdb::FloatGrid::Ptr grid = vdb(old_[s]).deepCopy();
    std::vector<FloatTree::LeafNodeType*> leaves;
    grid->tree().getNodes(leaves);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t l) {
      Reader reader(*this);
      for (openvdb::Index n = 0; n < FloatTree::LeafNodeType::SIZE; ++n) {
        const float value = signOf(s) * grownValue(s, leaves[l]->offsetToGlobalCoord(n), reader);
        if (std::abs(value) < background)
          leaves[l]->setValueOn(n, value);
        else
          leaves[l]->setValueOff(n, std::copysign(background, value));
      }
    });
    auto tile = grid->tree().beginValueOff();
    tile.setMaxDepth(FloatTree::DEPTH - 2);
    for (; tile; ++tile) tile.setValue(std::copysign(background, *tile));
    grid->tree().root().setBackground(background, /*updateChildNodes=*/false);
    return redistance(makeBand(grid), {.halfWidth = data_.halfWidth + 1, .maxMemory = maxMemory_});
  }
  /// Function that is negative in a neighbour, or nearer to it than to the others.
  [[nodiscard]] float grownValue(std::size_t s, const Coord& at, Reader& reader) const {
    const float own = signOf(s) * reader.old[s].getValue(at);
    const RegionLabel label = reader.field.label(at);
    if (label != label_ && !std::binary_search(neighbours_.begin(), neighbours_.end(), label))
      return own;
    float rival = std::numeric_limits<float>::infinity();
    for (std::size_t t = 0; t < neighbours_.size(); ++t)
      if (t != s) rival = std::min(rival, signOf(t) * reader.old[t].getValue(at));
    return std::max((own - rival) / 2, -keptDistance(reader, at));
  }

  [[nodiscard]] std::vector<OwnedBlock> gatherBlocks() {
    std::vector<OwnedBlock> blocks;
    std::set<Coord> coords;
    for (std::size_t b = 0; b < data_.blockCount(); ++b)
      coords.insert(SegmentedData::blockCoord(data_.blocks[b].origin));
    // Blocks inside the region that it does not keep completely.
    Reader reader(*this);
    auto tile = data_.blockTree->cbeginValueAll();
    for (; tile; ++tile) {
      if (*tile != SegmentedData::tile(label_)) continue;
      const openvdb::CoordBBox box = tile.getBoundingBox();
      for (auto at = box.begin(); at; ++at)
        if (!fillsBlock(reader, *at)) coords.insert(*at);
    }
    for (const Coord& block : coords) {
      blocks.push_back({.block = block, .owners = {}});
      origins_.push_back(blocks.back().origin());
    }
    openvdb::tree::ValueAccessor<const Int32Tree> tree(*data_.blockTree);
    std::vector<std::int32_t> numbers;
    for (const Coord& block : coords) numbers.push_back(tree.getValue(block));
    tbb::parallel_for(std::size_t{0}, blocks.size(),
                      [&](std::size_t b) { setOwners(numbers[b], blocks[b]); });
    return blocks;
  }
  [[nodiscard]] bool fillsBlock(const Reader& reader, const Coord& block) const {
    const Coord origin(block[0] << 3, block[1] << 3, block[2] << 3);
    return reader.kept && !reader.kept->probeConstLeaf(origin) && reader.kept->getValue(origin) < 0;
  }

  void setOwners(std::int32_t number, OwnedBlock& block) const {
    Reader reader(*this);
    block.owners.resize(SegmentedData::kVoxels);
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
      block.owners[n] = ownerOf(block.origin() + SegmentedData::localOf(n), reader);
    block.shorten();
    if (number >= 0 && !changed_.contains(block.block))
      block.kept = packedBlockOf(data_, static_cast<std::size_t>(number));
  }
  [[nodiscard]] RegionLabel ownerOf(const Coord& at, Reader& reader) const {
    const RegionLabel label = reader.field.label(at);
    if (label != label_ || keptDistance(reader, at) < 0) return label;
    std::size_t best = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t s = 0; s < neighbours_.size(); ++s) {
      const float value = signOf(s) * reader.old[s].getValue(at);
      if (value >= least) continue;
      least = value;
      best = s;
    }
    return neighbours_[best];
  }

  void distancesOf(const Coord& at, const std::vector<RegionLabel>& others,
                   std::vector<float>& result) const {
    SegmentedReader reader(data_);
    const SegmentedReader::Nearest near = reader.nearest(at);
    result.clear();
    for (const RegionLabel other : others) {
      const auto found = std::lower_bound(neighbours_.begin(), neighbours_.end(), other);
      float distance = 0;
      if (other == label_) {
        distance = vdb(kept_).tree().getValue(at);
      } else if (found != neighbours_.end() && *found == other) {
        const auto s = static_cast<std::size_t>(found - neighbours_.begin());
        distance = signOf(s) * vdb(new_[s]).tree().getValue(at);
      } else {
        distance = storedDistance(reader, at, near, other);
      }
      result.push_back(std::max(0.0f, distance));
    }
  }

  const SegmentedData& data_;
  RegionLabel label_;
  const NarrowBand& kept_;
  std::size_t maxMemory_;
  std::vector<RegionLabel> neighbours_;  ///< ascending
  std::vector<NarrowBand> old_, new_;    ///< distances to the neighbours
  std::set<Coord> changed_;              ///< blocks in or beside the region
  std::vector<Coord> origins_;
};

SegmentedField growRegion(const SegmentedField& field, RegionLabel label, double distance,
                          const NarrowBand& band, const OffsetRegionOptions& options) {
  const NarrowBand space = offset(band, distance, {.maxMemory = options.maxMemory});
  EditedSpace edited{.tree = &vdb(space).tree(), .label = label, .over = {kVoid}};
  edited.gap = static_cast<float>(kOffsetGap * field.voxelSize());
  if (options.cost == OffsetCost::Neighbours)
    for (const RegionLabel other : field.labels())
      if (other != label) edited.over.push_back(other);
  return editSpace(field, edited, options.progress);
}

SegmentedField shrinkRegion(const SegmentedField& field, RegionLabel label, double distance,
                            const NarrowBand& band, const OffsetRegionOptions& options) {
  NarrowBand kept;
  try {
    kept = offset(band, -distance, {.maxMemory = options.maxMemory});
  } catch (const NoSurface&) {
    // Nothing is left.
  }
  // No point of the region is deeper than half of its shortest side.
  const Imath::V3d size = band.zeroSetBounds().size();
  distance = std::min(distance, std::min({size.x, size.y, size.z}) / 2);
  if (options.cost == OffsetCost::Neighbours)
    return FreedSpace(field, label, kept, distance, options.maxMemory).run(options.progress);
  if (kept.isEmpty())
    return relabel(field, {{label, kVoid}},
                   {.maxMemory = options.maxMemory, .progress = options.progress});
  return editSpace(field, {.tree = &vdb(kept).tree(), .sign = -1, .label = kVoid, .over = {label}},
                   options.progress);
}

}  // namespace

SegmentedField offsetRegion(const SegmentedField& field, RegionLabel label, double distance,
                            const OffsetRegionOptions& options) {
  if (label == kVoid)
    throw UsageError("label 0 is the void, which has no bounds; give a label from 1 to 65535");
  requireLabels(field, {label});
  requireNoSheets(field);
  if (!std::isfinite(distance))
    throw UsageError(fmt::format("the distance is {}; give a finite one", distance));
  if (distance == 0) return field;
  const NarrowBand band = redistance(storedBand(field, label),
                                     {.halfWidth = kEditHalfWidth, .maxMemory = options.maxMemory});
  return distance > 0 ? growRegion(field, label, distance, band, options)
                      : shrinkRegion(field, label, -distance, band, options);
}

}  // namespace levelset
