#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/hidden_distances_vdb.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Int32Tree;

constexpr std::uint32_t kEditVoxels = SegmentedData::kVoxels;

/// Calls visit(block) for all blocks of an index box.
template <typename Visit>
void forEachBlockIn(const openvdb::CoordBBox& box, const Visit& visit) {
  const Coord low = SegmentedData::blockCoord(box.min()),
              high = SegmentedData::blockCoord(box.max());
  for (int x = low[0]; x <= high[0]; ++x)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int z = low[2]; z <= high[2]; ++z) visit(Coord(x, y, z));
}

class SpaceEdit {
 public:
  SpaceEdit(const SegmentedData& data, const EditedSpace& space) : data_(data), space_(space) {}

  [[nodiscard]] SegmentedField run(const Progress& progress) {
    const Int32Tree::Ptr tiles = copyTiles(data_, [](RegionLabel label) { return label; });
    editTiles(*tiles);
    gatherBlocks();
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) { setOwners(b); });
    const auto distances = [&](std::size_t b, std::uint32_t n, RegionLabel own,
                               const std::vector<RegionLabel>& others, std::vector<float>& result) {
      distancesOf(b, n, own, others, result);
    };
    hasHidden_.assign(blocks_.size(), 0);
    SegmentedField result = packPartition(data_.transform->copy(), data_.halfWidth, tiles,
                                          std::move(blocks_), distances, progress);
    requireRegion(result);
    std::vector<Coord> hidden;
    for (std::size_t b = 0; b < hasHidden_.size(); ++b)
      if (hasHidden_[b]) hidden.push_back(SegmentedData::blockCoord(origins_[b]));
    if (hidden.empty()) return result;
    return withHiddenDistances(result, space_.label, hidden, space_.maxMemory);
  }

 private:
  /// Signed distance to the space in a block.
  [[nodiscard]] BlockValues spaceIn(const Coord& block) const {
    const openvdb::tree::ValueAccessor<const FloatTree> accessor(*space_.tree);
    return blockValues(accessor, {block[0] << 3, block[1] << 3, block[2] << 3});
  }
  [[nodiscard]] float valueIn(const BlockValues& values, std::uint32_t n) const {
    return space_.sign * (values.values ? values.values[n] : values.constant);
  }

  /// Gives the blocks with one label that lie in the space to its region.
  void editTiles(Int32Tree& tiles) const {
    openvdb::tree::ValueAccessor<Int32Tree> accessor(tiles);
    openvdb::tree::ValueAccessor<const FloatTree> space(*space_.tree);
    const auto change = [&](const Coord& block) {
      const Coord origin(block[0] << 3, block[1] << 3, block[2] << 3);
      if (space_.sign * space.getValue(origin) < 0)
        accessor.setValueOff(block, SegmentedData::tile(space_.label));
    };
    auto tile = data_.blockTree->cbeginValueAll();
    for (; tile; ++tile) {
      if (*tile >= 0) continue;
      const RegionLabel label = SegmentedData::labelOfTile(*tile);
      if (label == kVoid || !space_.takes(label)) continue;
      const openvdb::CoordBBox box = tile.getBoundingBox();
      for (int x = box.min()[0]; x <= box.max()[0]; ++x)
        for (int y = box.min()[1]; y <= box.max()[1]; ++y)
          for (int z = box.min()[2]; z <= box.max()[2]; ++z) change(Coord(x, y, z));
    }
    // The void has no bounds, so the space must have some.
    if (!space_.takes(kVoid)) return;
    auto filled = space_.tree->cbeginValueAll();
    filled.setMaxDepth(FloatTree::DEPTH - 2);  // tiles only
    for (; filled; ++filled)
      if (space_.sign * *filled < 0)
        forEachBlockIn(filled.getBoundingBox(), [&](const Coord& block) {
          if (accessor.getValue(block) == SegmentedData::tile(kVoid)) change(block);
        });
  }

  void gatherBlocks() {
    std::vector<std::pair<Coord, std::size_t>> found;  // with the number in the field
    for (std::size_t b = 0; b < data_.blockCount(); ++b)
      found.emplace_back(SegmentedData::blockCoord(data_.blocks[b].origin), b);
    openvdb::tree::ValueAccessor<const Int32Tree> tree(*data_.blockTree);
    for (auto leaf = space_.tree->cbeginLeaf(); leaf; ++leaf) {
      const Coord block = SegmentedData::blockCoord(leaf->origin());
      if (tree.getValue(block) < 0) found.emplace_back(block, kNone);
    }
    std::sort(found.begin(), found.end());
    for (const auto& [block, number] : found) {
      blocks_.push_back({.block = block, .owners = {}});
      numbers_.push_back(number);
      origins_.push_back(blocks_.back().origin());
      spaces_.push_back(spaceIn(block));
    }
  }

  void setOwners(std::size_t b) {
    OwnedBlock& block = blocks_[b];
    SegmentedReader reader(data_);
    block.owners.resize(kEditVoxels);
    const BlockValues& space = spaces_[b];
    if ((!space.values && valueIn(space, 0) > 0) || (numbers_[b] != kNone && !losesSpace(b))) {
      for (std::uint32_t n = 0; n < kEditVoxels; ++n)
        block.owners[n] = reader.label(block.origin() + SegmentedData::localOf(n));
      block.shorten();
      if (numbers_[b] != kNone) block.kept = packedBlockOf(data_, numbers_[b]);
      return;
    }
    for (std::uint32_t n = 0; n < kEditVoxels; ++n) {
      const SegmentedReader::Nearest near =
          reader.nearest(block.origin() + SegmentedData::localOf(n));
      const float value = valueIn(space, n);
      const bool isTaken = value < 0 || (near.label == kVoid && near.neighbour != space_.label &&
                                         value + near.distance <= space_.gap);
      block.owners[n] = isTaken && space_.takes(near.label) ? space_.label : near.label;
    }
    block.shorten();
  }

  /// Returns true if the space takes from a region near a block of the field.
  [[nodiscard]] bool losesSpace(std::size_t b) const {
    const auto first = data_.palettes.begin() + data_.blocks[numbers_[b]].palette,
               last = data_.palettes.begin() + data_.blocks[numbers_[b] + 1].palette;
    return std::any_of(first, last, [&](RegionLabel label) { return space_.takes(label); });
  }

  void distancesOf(std::size_t b, std::uint32_t n, RegionLabel own,
                   const std::vector<RegionLabel>& others, std::vector<float>& result) {
    SegmentedReader reader(data_);
    const Coord at = origins_[b] + SegmentedData::localOf(n);
    const SegmentedReader::Nearest near = reader.nearest(at);
    const float space = valueIn(spaces_[b], n);
    result.clear();
    bool isKnown = false;
    for (const RegionLabel other : others) {
      float distance = storedDistance(reader, at, near, other);
      if (other == space_.label)
        distance = std::min(distance, std::max(space, sourceDistance(reader, at, near, others)));
      else if (space_.takes(other))
        distance = std::max(distance, -space);
      result.push_back(std::max(0.0f, distance));
      isKnown = isKnown || distance < std::nextafter(data_.background, 0.0f);
    }
    // The interface between two regions that are one now hid the next one.
    if (!isKnown && own == space_.label && near.label != near.neighbour && belongs(near.label) &&
        belongs(near.neighbour))
      hasHidden_[b] = 1;
  }

  /// Returns true for the label of the space, and those that it takes from.
  [[nodiscard]] bool belongs(RegionLabel label) const {
    return label == space_.label || space_.takes(label);
  }

  /// Signed distance to the regions that the space takes from, together with its own region.
  /// @param others  regions near the grid point
  [[nodiscard]] float sourceDistance(SegmentedReader& reader, const Coord& at,
                                     const SegmentedReader::Nearest& near,
                                     const std::vector<RegionLabel>& others) const {
    float distance = data_.background;
    if (belongs(near.label)) {
      for (const RegionLabel other : others)
        if (!belongs(other)) distance = std::min(distance, storedDistance(reader, at, near, other));
      return -distance;
    }
    for (const RegionLabel label : space_.over)
      distance = std::min(distance, storedDistance(reader, at, near, label));
    return std::min(distance, storedDistance(reader, at, near, space_.label));
  }

  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  const SegmentedData& data_;
  const EditedSpace& space_;
  std::vector<OwnedBlock> blocks_;
  std::vector<std::size_t> numbers_;  ///< numbers in the field, by block
  std::vector<Coord> origins_;        ///< by block
  std::vector<BlockValues> spaces_;   ///< signed distances to the space, without its sign
  std::vector<char> hasHidden_;       ///< by block: some distances are not known any more
};

}  // namespace

Int32Tree::Ptr copyTiles(const SegmentedData& data,
                         const std::function<RegionLabel(RegionLabel)>& labelOf) {
  const auto tiles = std::make_shared<Int32Tree>(SegmentedData::tile(kVoid));
  auto tile = data.blockTree->cbeginValueAll();
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    const RegionLabel label = labelOf(SegmentedData::labelOfTile(*tile));
    if (label != kVoid)
      tiles->sparseFill(tile.getBoundingBox(), SegmentedData::tile(label), /*active=*/false);
  }
  return tiles;
}

void requireRegion(const SegmentedField& field) {
  if (field.isEmpty()) throw NoSurface("no region is left; leave at least one");
}

void requireNoSheets(const SegmentedField& field) {
  if (!field.sheetLabels().empty())
    throw InvalidInput(
        "the segmentation has sheets inside its regions, which would be lost; segment a mesh "
        "without sheets, or extract a region first");
}

void requireLabels(const SegmentedField& field, const std::vector<RegionLabel>& labels) {
  const std::vector<RegionLabel> known = field.labels();
  for (const RegionLabel label : labels)
    if (label != kVoid && !std::binary_search(known.begin(), known.end(), label))
      throw UsageError(
          fmt::format("the segmentation has no region {}; give labels that it has", label));
}

NarrowBand onGridOfField(const SegmentedField& field, const NarrowBand& solid,
                         std::size_t maxMemory) {
  constexpr double kLeast = 3, kTolerance = 1e-9;
  requireSolid(solid);
  if (solid.isEmpty()) throw InvalidInput("the solid has no surface; give one that has");
  const double halfWidth = std::max(kLeast, field.halfWidth() + 1);
  const Imath::M44d target = field.indexToWorld(), source = solid.indexToWorld();
  if (!target.equalWithAbsError(source, kTolerance * field.voxelSize()))
    return resampleField(solid, source, target, halfWidth, maxMemory, {});
  if (solid.halfWidth() >= halfWidth * (1 - 1e-6)) return solid;
  return redistance(solid, {.halfWidth = halfWidth, .maxMemory = maxMemory});
}

SegmentedField editSpace(const SegmentedField& field, const EditedSpace& space,
                         const Progress& progress) {
  return SpaceEdit(*field.shared(), space).run(progress);
}

}  // namespace levelset
