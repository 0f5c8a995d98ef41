#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;

/// Bits of the codes of a palette.
std::uint16_t bitsOfPalette(std::size_t size) {
  for (const unsigned bits : {1u, 2u, 4u, 8u})
    if (size <= std::size_t{1} << bits) return static_cast<std::uint16_t>(bits);
  return 16;
}

void putCode(std::uint64_t* words, std::uint32_t index, std::uint16_t bits, std::uint64_t code) {
  const std::uint32_t at = index * bits;
  words[at >> 6] |= code << (at & 63);
}

std::uint32_t checkedCount(std::size_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit("the segmented field has more than 2^32 distances; use larger voxels");
  return static_cast<std::uint32_t>(count);
}

}  // namespace

std::size_t SegmentedData::memoryUse() const {
  return sizeof(SegmentedData) + blockTree->memUsage() +
         blocks.capacity() * sizeof(SegmentedBlock) + words.capacity() * sizeof(std::uint64_t) +
         distances.capacity() * sizeof(float) + extras.capacity() * sizeof(SegmentedExtra) +
         (palettes.capacity() + labels.capacity()) * sizeof(RegionLabel) +
         (sheets ? sheets->memoryUse() : 0);
}

float SegmentedReader::extraAt(const Coord& at, RegionLabel other) {
  const std::int32_t block = blockOf(at);
  if (block < 0) return data_.background;
  const auto begin = data_.extras.begin();
  const auto first = begin + data_.blocks[static_cast<std::size_t>(block)].extras,
             last = begin + data_.blocks[static_cast<std::size_t>(block) + 1].extras;
  const std::uint32_t key = SegmentedData::offsetOf(at) << 16 | other;
  const auto keyOf = [](const SegmentedExtra& e) { return std::uint32_t{e.voxel} << 16 | e.label; };
  const auto found = std::lower_bound(
      first, last, key, [&](const SegmentedExtra& e, std::uint32_t k) { return keyOf(e) < k; });
  return found != last && keyOf(*found) == key ? found->distance : data_.background;
}

PackedBlock packTwoRegions(const openvdb::Coord& origin, const float* phi, RegionLabel inside,
                           RegionLabel outside, float background) {
  PackedBlock packed;
  packed.block.origin = origin;
  packed.block.paletteSize = 2;
  packed.palette = {std::min(inside, outside), std::max(inside, outside)};
  packed.words.assign(SegmentedData::kLabelWord + 8, 0);
  packed.distances.resize(SegmentedData::kVoxels);
  std::size_t rank = 0;
  bool isInside = false, isOutside = false;
  for (std::uint32_t w = 0; w < 8; ++w) {
    std::uint64_t active = 0, negative = 0;
    if (w > 0) packed.words[8] |= std::uint64_t{rank} << (9 * (w - 1));
    for (std::uint32_t b = 0; b < 64; ++b) {
      const float value = phi[64 * w + b], distance = std::abs(value);
      negative |= std::uint64_t{value < 0} << b;
      active |= std::uint64_t{distance < background} << b;
      packed.distances[rank] = distance;
      rank += distance < background;
    }
    packed.words[w] = active;
    packed.words[SegmentedData::kLabelWord + w] = inside < outside ? ~negative : negative;
    isInside = isInside || negative != 0;
    isOutside = isOutside || ~negative != 0;
  }
  packed.distances.resize(rank);
  packed.distances.shrink_to_fit();
  if (isInside) packed.owners.push_back(inside);
  if (isOutside) packed.owners.push_back(outside);
  return packed;
}

PackedBlock packBlock(const SegmentedBlockValues& values, float background) {
  PackedBlock packed;
  packed.block.origin = values.origin;
  std::vector<RegionLabel>& palette = packed.palette;
  std::uint32_t active = 0;
  RegionLabel last = values.labels[0];
  palette.push_back(last);
  const auto addLabel = [&](RegionLabel label) {
    if (label == last) return;
    last = label;
    if (std::find(palette.begin(), palette.end(), label) == palette.end()) palette.push_back(label);
  };
  for (const RegionLabel label : values.labels) addLabel(label);
  packed.owners = palette;
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    if (values.distances[n] >= background) continue;
    ++active;
    addLabel(values.neighbours[n]);
  }
  // A palette of two implies that the neighbour is the other label.
  if (palette.size() == 1) palette.push_back(palette[0]);
  std::sort(palette.begin(), palette.end());
  RegionLabel known = palette[0];
  std::uint64_t code = 0;
  const auto codeOf = [&](RegionLabel label) {
    if (label != known) {
      known = label;
      code = static_cast<std::uint64_t>(std::lower_bound(palette.begin(), palette.end(), label) -
                                        palette.begin());
    }
    return code;
  };
  const std::uint16_t bits = bitsOfPalette(palette.size());
  constexpr std::uint32_t kLabels = SegmentedData::kLabelWord;
  packed.block.bits = bits;
  packed.block.paletteSize = static_cast<std::uint16_t>(palette.size());
  const std::size_t neighbourWords = palette.size() > 2 ? (active * bits + 63u) / 64u : 0;
  packed.words.assign(kLabels + 8u * bits + neighbourWords, 0);
  packed.distances.reserve(active);
  std::uint32_t rank = 0;
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    if (n % 64 == 0 && n > 0) packed.words[8] |= std::uint64_t{rank} << (9 * (n / 64 - 1));
    putCode(&packed.words[kLabels], n, bits, codeOf(values.labels[n]));
    if (values.distances[n] >= background) continue;
    packed.words[n >> 6] |= std::uint64_t{1} << (n & 63);
    packed.distances.push_back(values.distances[n]);
    if (palette.size() > 2)
      putCode(&packed.words[kLabels + 8u * bits], rank, bits, codeOf(values.neighbours[n]));
    ++rank;
  }
  packed.extras = values.extras;
  return packed;
}

SegmentedField assembleSegmented(openvdb::math::Transform::Ptr transform, double halfWidth,
                                 openvdb::Int32Tree::Ptr tiles, std::vector<PackedBlock> blocks,
                                 std::shared_ptr<const SheetData> sheets) {
  const auto data = std::make_shared<SegmentedData>();
  data->voxelSize = transform->voxelSize()[0];
  data->halfWidth = halfWidth;
  data->background = backgroundOf(halfWidth, data->voxelSize);
  data->transform = std::move(transform);
  SegmentedBlock end;
  for (const PackedBlock& packed : blocks) {
    end.words = checkedCount(end.words + packed.words.size());
    end.distances = checkedCount(end.distances + packed.distances.size());
    end.extras = checkedCount(end.extras + packed.extras.size());
    end.palette = checkedCount(end.palette + packed.palette.size());
  }
  data->blocks.reserve(blocks.size() + 1);
  data->words.reserve(end.words);
  data->distances.reserve(end.distances);
  data->extras.reserve(end.extras);
  data->palettes.reserve(end.palette);
  std::vector<bool> owns(std::size_t{std::numeric_limits<RegionLabel>::max()} + 1);
  openvdb::tree::ValueAccessor<openvdb::Int32Tree> tree(*tiles);
  for (PackedBlock& packed : blocks) {
    SegmentedBlock block = packed.block;
    block.words = static_cast<std::uint32_t>(data->words.size());
    block.distances = static_cast<std::uint32_t>(data->distances.size());
    block.extras = static_cast<std::uint32_t>(data->extras.size());
    block.palette = static_cast<std::uint32_t>(data->palettes.size());
    tree.setValueOff(SegmentedData::blockCoord(block.origin),
                     static_cast<std::int32_t>(data->blocks.size()));
    data->blocks.push_back(block);
    data->words.insert(data->words.end(), packed.words.begin(), packed.words.end());
    data->distances.insert(data->distances.end(), packed.distances.begin(), packed.distances.end());
    data->extras.insert(data->extras.end(), packed.extras.begin(), packed.extras.end());
    data->palettes.insert(data->palettes.end(), packed.palette.begin(), packed.palette.end());
    for (const RegionLabel label : packed.owners) owns[label] = true;
    packed = PackedBlock();  // lest the blocks are in memory twice
  }
  data->blocks.push_back(end);
  openvdb::tools::prune(*tiles);
  for (auto it = tiles->cbeginValueAll(); it; ++it)
    if (*it < 0) owns[SegmentedData::labelOfTile(*it)] = true;
  for (std::size_t label = 1; label < owns.size(); ++label)
    if (owns[label]) data->labels.push_back(static_cast<RegionLabel>(label));
  data->blockTree = std::move(tiles);
  data->sheets = std::move(sheets);
  return SegmentedField(data);
}

SegmentedCell::SegmentedCell(SegmentedReader& reader, const Coord& low) {
  for (int c = 0; c < 8; ++c)
    corners_[static_cast<std::size_t>(c)] = reader.nearest(low + cornerOffset(c));
  for (const SegmentedReader::Nearest& near : corners_)
    if (std::find(labels_.begin(), labels_.end(), near.label) == labels_.end())
      labels_.push_back(near.label);
  std::sort(labels_.begin(), labels_.end());
}

}  // namespace levelset
