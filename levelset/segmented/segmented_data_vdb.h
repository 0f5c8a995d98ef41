#pragma once

// Data of segmented fields. Includes OpenVDB, so include it from .cpp files only.

#include <openvdb/tree/ValueAccessor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/segmented/local/sheet_data.h"
#include "levelset/segmented/segmented_field.h"
#include "levelset/vdb.h"

namespace levelset {

/// Distance from a grid point to the interface between its region and another one.
struct SegmentedExtra {
  std::uint16_t voxel = 0;  ///< offset in the block, z fastest, as in OpenVDB's leaves
  RegionLabel label = kVoid;
  float distance = 0;  ///< world units, ≥ 0
};

/// Block of 8³ grid points that holds several labels or distances. Its arrays are parts of those of
/// SegmentedData.
struct SegmentedBlock {
  openvdb::Coord origin;
  /// First of the words: 8 of the mask of active voxels; one with the counts of active voxels
  /// before these words, 9 bits each; 8 × bits of the codes of labels; for palettes of more than
  /// two labels the codes of neighbours, by active voxel.
  std::uint32_t words = 0;
  std::uint32_t distances = 0;  ///< first distance, by active voxel
  std::uint32_t extras = 0;     ///< first extra, by voxel and label
  std::uint32_t palette = 0;    ///< first label of the palette
  std::uint16_t paletteSize = 0;
  std::uint16_t bits = 1;  ///< bits of a code, which is an index in the palette: 1, 2, 4, 8 or 16
};

/// Compact blocks below a coarse tree. Distances of active voxels follow each other without holes;
/// labels are indices in a palette of the block. A leaf of OpenVDB, which holds all 8³ floats,
/// takes several times the memory.
struct SegmentedData {
  static constexpr int kBlock = 8;
  static constexpr std::uint32_t kVoxels = 512;
  static constexpr std::uint32_t kLabelWord = 9;  ///< first word of the labels of a block

  openvdb::math::Transform::Ptr transform;
  double voxelSize = 0, halfWidth = 0;  ///< half width in voxels
  float background = 0;                 ///< half width in world units
  /// By block coordinate, index coordinates / 8: the number of a block, or tile(label) for blocks
  /// with one label and no distances.
  openvdb::Int32Tree::ConstPtr blockTree;
  std::vector<SegmentedBlock> blocks;  ///< by x, y, z, and one more for the ends of the arrays
  std::vector<std::uint64_t> words;
  std::vector<float> distances;
  std::vector<SegmentedExtra> extras;
  std::vector<RegionLabel> palettes;
  std::vector<RegionLabel> labels;  ///< that own a grid point, ascending, without the void
  /// Crossings of all surfaces of a field with sheets; else null.
  std::shared_ptr<const SheetData> sheets;

  [[nodiscard]] static std::int32_t tile(RegionLabel label) { return -1 - std::int32_t{label}; }
  [[nodiscard]] static RegionLabel labelOfTile(std::int32_t value) {
    return static_cast<RegionLabel>(-1 - value);
  }
  [[nodiscard]] static openvdb::Coord blockCoord(const openvdb::Coord& c) {
    return {c[0] >> 3, c[1] >> 3, c[2] >> 3};
  }
  [[nodiscard]] static std::uint32_t offsetOf(const openvdb::Coord& c) {
    return static_cast<std::uint32_t>(((c[0] & 7) << 6) | ((c[1] & 7) << 3) | (c[2] & 7));
  }
  [[nodiscard]] static openvdb::Coord localOf(std::uint32_t offset) {
    return {static_cast<int>(offset >> 6), static_cast<int>(offset >> 3 & 7),
            static_cast<int>(offset & 7)};
  }
  /// As std::popcount(), which calls a function where the machine may lack the instruction.
  [[nodiscard]] static std::uint64_t countBits(std::uint64_t x) {
    x -= x >> 1 & 0x5555555555555555u;
    x = (x & 0x3333333333333333u) + (x >> 2 & 0x3333333333333333u);
    x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return x * 0x0101010101010101u >> 56;
  }
  [[nodiscard]] std::size_t blockCount() const { return blocks.empty() ? 0 : blocks.size() - 1; }
  [[nodiscard]] std::size_t memoryUse() const;

  /// Index of the distance of a voxel in `distances`; −1 for an inactive one.
  [[nodiscard]] std::int64_t distanceIndex(const SegmentedBlock& block, std::uint32_t voxel) const {
    const std::uint64_t* mask = &words[block.words];
    const std::uint32_t word = voxel >> 6, bit = voxel & 63;
    if (!(mask[word] >> bit & 1)) return -1;
    const std::uint64_t before = word == 0 ? 0 : mask[8] >> (9 * (word - 1)) & 511;
    const auto rank =
        static_cast<std::int64_t>(before + countBits(mask[word] & ((std::uint64_t{1} << bit) - 1)));
    return std::int64_t{block.distances} + rank;
  }
  [[nodiscard]] RegionLabel labelAt(const SegmentedBlock& block, std::uint32_t voxel) const {
    return palettes[block.palette + codeAt(block, kLabelWord, voxel)];
  }
  /// Region across the nearest interface of an active voxel.
  /// @param distance  distanceIndex() of the voxel
  [[nodiscard]] RegionLabel neighbourAt(const SegmentedBlock& block, std::uint32_t voxel,
                                        std::int64_t distance) const {
    if (block.paletteSize == 2)
      return palettes[block.palette + 1 - codeAt(block, kLabelWord, voxel)];
    const auto rank = static_cast<std::uint32_t>(distance - block.distances);
    return palettes[block.palette + codeAt(block, kLabelWord + 8u * block.bits, rank)];
  }

 private:
  [[nodiscard]] std::uint32_t codeAt(const SegmentedBlock& block, std::uint32_t first,
                                     std::uint32_t index) const {
    const std::uint32_t at = index * block.bits;
    const std::uint64_t word = words[block.words + first + (at >> 6)];
    return static_cast<std::uint32_t>(word >> (at & 63)) & ((1u << block.bits) - 1);
  }
};

/// Reads single grid points. Caches the block of the last one; use one per thread.
class SegmentedReader {
 public:
  explicit SegmentedReader(const SegmentedData& data) : data_(data), tree_(*data.blockTree) {}

  /// Number of the block of a grid point, or the value of its tile; see SegmentedData::blockTree.
  [[nodiscard]] std::int32_t blockOf(const openvdb::Coord& at) {
    const openvdb::Coord coord = SegmentedData::blockCoord(at);
    if (!isCached_ || coord != coord_) {
      coord_ = coord;
      value_ = tree_.getValue(coord);
      isCached_ = true;
    }
    return value_;
  }
  [[nodiscard]] RegionLabel label(const openvdb::Coord& at) {
    const std::int32_t block = blockOf(at);
    if (block < 0) return SegmentedData::labelOfTile(block);
    return data_.labelAt(blockAt(block), SegmentedData::offsetOf(at));
  }

  struct Nearest {
    float distance;         ///< to the nearest interface, world units; the background far from it
    RegionLabel label;      ///< label of the grid point
    RegionLabel neighbour;  ///< across that interface; the same label far from it
  };
  [[nodiscard]] Nearest nearest(const openvdb::Coord& at) {
    const std::int32_t block = blockOf(at);
    if (block < 0) {
      const RegionLabel label = SegmentedData::labelOfTile(block);
      return {data_.background, label, label};
    }
    const SegmentedBlock& found = blockAt(block);
    const std::uint32_t voxel = SegmentedData::offsetOf(at);
    const RegionLabel label = data_.labelAt(found, voxel);
    const std::int64_t index = data_.distanceIndex(found, voxel);
    if (index < 0) return {data_.background, label, label};
    return {data_.distances[static_cast<std::size_t>(index)], label,
            data_.neighbourAt(found, voxel, index)};
  }
  /// Distance to the interface between the region of a grid point and another one, world units. The
  /// background where none is stored.
  [[nodiscard]] float distanceTo(const openvdb::Coord& at, RegionLabel other) {
    const Nearest near = nearest(at);
    return near.neighbour == other ? near.distance : extraAt(at, other);
  }
  [[nodiscard]] float distanceTo(const openvdb::Coord& at, const Nearest& near, RegionLabel other) {
    return near.neighbour == other ? near.distance : extraAt(at, other);
  }

 private:
  [[nodiscard]] const SegmentedBlock& blockAt(std::int32_t block) const {
    return data_.blocks[static_cast<std::size_t>(block)];
  }
  [[nodiscard]] float extraAt(const openvdb::Coord& at, RegionLabel other);

  const SegmentedData& data_;
  openvdb::tree::ValueAccessor<const openvdb::Int32Tree> tree_;
  openvdb::Coord coord_;
  std::int32_t value_ = 0;
  bool isCached_ = false;
};

/// Values of the grid points of a block before it is packed.
struct SegmentedBlockValues {
  openvdb::Coord origin;
  std::array<RegionLabel, SegmentedData::kVoxels> labels;
  /// Distance to the nearest interface, world units. From the background on, the voxel is inactive.
  std::array<float, SegmentedData::kVoxels> distances;
  std::array<RegionLabel, SegmentedData::kVoxels> neighbours;  ///< used for active voxels only
  std::vector<SegmentedExtra> extras;                          ///< by voxel and label
};

/// Block with its arrays.
struct PackedBlock {
  SegmentedBlock block;
  std::vector<std::uint64_t> words;
  std::vector<float> distances;
  std::vector<SegmentedExtra> extras;
  std::vector<RegionLabel> palette;
  std::vector<RegionLabel> owners;  ///< labels of its voxels
};
/// Packs a block near one interface only.
/// @param phi  signed distance to it, negative in the region `inside`
[[nodiscard]] PackedBlock packTwoRegions(const openvdb::Coord& origin, const float* phi,
                                         RegionLabel inside, RegionLabel outside, float background);
[[nodiscard]] PackedBlock packBlock(const SegmentedBlockValues& values, float background);

/// Puts blocks together to a field.
/// @param blocks  by x, y, z
/// @param tiles   SegmentedData::tile() of the label by block coordinate; values at the blocks are
///                ignored
/// @param halfWidth  voxels
/// @param sheets   for the same blocks; null for a field without sheets
/// @throws ResourceLimit when a count exceeds 32 bits
[[nodiscard]] SegmentedField assembleSegmented(openvdb::math::Transform::Ptr transform,
                                               double halfWidth, openvdb::Int32Tree::Ptr tiles,
                                               std::vector<PackedBlock> blocks,
                                               std::shared_ptr<const SheetData> sheets = nullptr);

/// Distances of the 8 corners of a grid cell, to interpolate them.
class SegmentedCell {
 public:
  /// @param low  corner with the smallest coordinates
  SegmentedCell(SegmentedReader& reader, const openvdb::Coord& low);

  [[nodiscard]] bool isUniform() const { return labels_.size() == 1; }
  /// Labels of the corners, ascending.
  [[nodiscard]] const std::vector<RegionLabel>& labels() const { return labels_; }
  [[nodiscard]] const SegmentedReader::Nearest& corner(int c) const {
    return corners_[static_cast<std::size_t>(c)];
  }
  /// Corner c has the offset 1 along x for bit 2 of c, along y for bit 1, along z for bit 0.
  [[nodiscard]] static openvdb::Coord cornerOffset(int c) { return {c >> 2, c >> 1 & 1, c & 1}; }

 private:
  std::array<SegmentedReader::Nearest, 8> corners_;
  std::vector<RegionLabel> labels_;
};

}  // namespace levelset
