#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/progress_gate.h"
#include "levelset/segmented/local/block_surroundings.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::Int32Tree;

/// Packs the blocks of a partition, whose numbers are in a tree.
class PartitionPacker {
 public:
  PartitionPacker(const std::vector<OwnedBlock>& blocks, const Int32Tree& tiles,
                  const DistancesTo& distances, float background)
      : blocks_(blocks), tiles_(tiles), distances_(distances), background_(background) {}

  /// @return without words if the block is far from all interfaces
  [[nodiscard]] PackedBlock pack(std::size_t number) const {
    const OwnedBlock& block = blocks_[number];
    BlockSurroundings around;
    fill(block.block, around);
    if (around.palette().size() == 1) return {};
    around.findNeighbours();
    SegmentedBlockValues values;
    values.origin = block.origin();
    std::vector<RegionLabel> others, adjacent;
    std::vector<float> distances;
    const float largest = std::nextafter(background_, 0.0f);
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
      const RegionLabel own = block.ownerAt(n);
      values.labels[n] = own;
      values.distances[n] = background_;
      values.neighbours[n] = own;
      around.others(n, own, 2, others);
      if (others.empty()) continue;
      around.others(n, own, 1, adjacent);
      distances_(number, n, own, others, distances);
      const auto nearest = static_cast<std::size_t>(
          std::min_element(distances.begin(), distances.end()) - distances.begin());
      values.distances[n] = std::min(distances[nearest], background_);
      values.neighbours[n] = others[nearest];
      if (adjacent.empty()) continue;
      // Cells with several labels need a distance in all corners.
      values.distances[n] = std::min(values.distances[n], largest);
      for (std::size_t i = 0; i < others.size(); ++i)
        if (i != nearest && std::binary_search(adjacent.begin(), adjacent.end(), others[i]))
          values.extras.push_back(
              {static_cast<std::uint16_t>(n), others[i], std::min(distances[i], background_)});
    }
    return packBlock(values, background_);
  }

 private:
  void fill(const Coord& block, BlockSurroundings& around) const {
    openvdb::tree::ValueAccessor<const Int32Tree> tiles(tiles_);
    std::array<std::int32_t, 27> values{};
    std::size_t count = 0;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) values[count++] = tiles.getValue(block.offsetBy(x, y, z));
    around.fill([&](int i, int j, int k, int x, int y, RegionLabel* row) {
      const std::int32_t value = values[static_cast<std::size_t>(i * 9 + j * 3 + k + 13)];
      if (value < 0) {
        std::fill_n(row, 8, SegmentedData::labelOfTile(value));
        return;
      }
      const std::vector<RegionLabel>& owners = blocks_[static_cast<std::size_t>(value)].owners;
      if (owners.size() == 1)
        std::fill_n(row, 8, owners[0]);
      else
        std::copy_n(owners.begin() + (x * 64 + y * 8), 8, row);
    });
  }

  const std::vector<OwnedBlock>& blocks_;
  const Int32Tree& tiles_;
  const DistancesTo& distances_;
  float background_;
};

}  // namespace

void OwnedBlock::shorten() {
  if (std::all_of(owners.begin(), owners.end(), [&](RegionLabel l) { return l == owners[0]; }))
    owners.resize(1);
}

SegmentedField packPartition(openvdb::math::Transform::Ptr transform, double halfWidth,
                             Int32Tree::Ptr tiles, std::vector<OwnedBlock> blocks,
                             const DistancesTo& distances, const Progress& progress) {
  openvdb::tree::ValueAccessor<Int32Tree> tree(*tiles);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    tree.setValueOff(blocks[b].block, static_cast<std::int32_t>(b));
  const float background = backgroundOf(halfWidth, transform->voxelSize()[0]);
  const PartitionPacker packer(blocks, *tiles, distances, background);
  std::vector<PackedBlock> packed(blocks.size());
  ProgressGate gate(progress, blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    packed[b] = blocks[b].kept.words.empty() ? packer.pack(b) : std::move(blocks[b].kept);
    gate.advance(1);
  });
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (packed[b].words.empty())
      tree.setValueOff(blocks[b].block, SegmentedData::tile(blocks[b].owners[0]));
  std::erase_if(packed, [](const PackedBlock& block) { return block.words.empty(); });
  return assembleSegmented(std::move(transform), halfWidth, std::move(tiles), std::move(packed));
}

PackedBlock packedBlockOf(const SegmentedData& data, std::size_t number) {
  const SegmentedBlock& block = data.blocks[number];
  const SegmentedBlock& next = data.blocks[number + 1];
  const auto part = [](const auto& all, std::uint32_t first, std::uint32_t last) {
    return std::vector(all.begin() + first, all.begin() + last);
  };
  PackedBlock packed;
  packed.block = block;
  packed.words = part(data.words, block.words, next.words);
  packed.distances = part(data.distances, block.distances, next.distances);
  packed.extras = part(data.extras, block.extras, next.extras);
  packed.palette = part(data.palettes, block.palette, next.palette);
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    const RegionLabel label = data.labelAt(block, n);
    if (std::find(packed.owners.begin(), packed.owners.end(), label) == packed.owners.end())
      packed.owners.push_back(label);
  }
  return packed;
}

}  // namespace levelset
