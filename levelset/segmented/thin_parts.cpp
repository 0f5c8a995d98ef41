#include "levelset/segmented/thin_parts.h"

#include <tbb/parallel_for.h>

#include <array>
#include <bit>
#include <cmath>
#include <map>

#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;

/// Distance of a grid point from the interface on the edge to a neighbour, as a part of the edge.
double crossingOf(SegmentedReader& reader, const Coord& at, const SegmentedReader::Nearest& near,
                  const Coord& next, const SegmentedReader::Nearest& other) {
  const double u = static_cast<double>(reader.distanceTo(at, near, other.label)),
               v = static_cast<double>(reader.distanceTo(next, other, near.label));
  return u + v > 0 ? u / (u + v) : 0.5;
}

/// Returns true when no grid point of the region up to two voxels away is half a voxel deep.
bool isThinAround(const SegmentedData& data, SegmentedReader& reader, const Coord& at,
                  RegionLabel region) {
  constexpr int kAround = 2;
  for (int x = -kAround; x <= kAround; ++x)
    for (int y = -kAround; y <= kAround; ++y)
      for (int z = -kAround; z <= kAround; ++z) {
        const SegmentedReader::Nearest near = reader.nearest(at.offsetBy(x, y, z));
        if (near.label == region && static_cast<double>(near.distance) >= data.voxelSize / 2)
          return false;
      }
  return true;
}

/// Voxels of a row of 64 whose region may end on both sides along an axis, a bit for each. Voxels
/// at the faces of the block count as if it ended beyond.
using EndMasks = std::array<std::uint64_t, 3>;

/// @param isEqual  bool(voxel, voxel): have the same label
template <typename IsEqual>
EndMasks endMasks(std::uint32_t row, const IsEqual& isEqual) {
  EndMasks masks{};
  for (std::uint32_t b = 0; b < 64; ++b) {
    const std::uint32_t n = 64 * row + b;
    const auto put = [&](std::size_t axis, std::uint32_t at, std::uint32_t stride) {
      const bool ends =
          (at == 0 || !isEqual(n, n - stride)) && (at == 7 || !isEqual(n, n + stride));
      masks[axis] |= std::uint64_t{ends} << b;
    };
    put(0, row, 64);
    put(1, b >> 3, 8);
    put(2, b & 7, 1);
  }
  return masks;
}
/// The same for blocks of two labels, from the bits of their labels.
EndMasks endMasksOfBits(const std::uint64_t* bits, std::uint32_t row) {
  constexpr std::uint64_t kFirstY = 0xff, kLastY = kFirstY << 56, kFirstZ = 0x0101010101010101u,
                          kLastZ = kFirstZ << 7;
  const std::uint64_t own = bits[row], below = row > 0 ? bits[row - 1] : ~own,
                      above = row < 7 ? bits[row + 1] : ~own;
  return {(own ^ below) & (own ^ above),
          ((own ^ (own << 8)) | kFirstY) & ((own ^ (own >> 8)) | kLastY),
          ((own ^ (own << 1)) | kFirstZ) & ((own ^ (own >> 1)) | kLastZ)};
}

/// Adds the place of a grid point, if its region is thin along an axis there.
void addIfThin(const SegmentedData& data, SegmentedReader& reader, const Coord& at, int axis,
               std::vector<LostPlace>& places) {
  Coord low = at, high = at;
  low[axis] -= 1;
  high[axis] += 1;
  const SegmentedReader::Nearest near = reader.nearest(at);
  // If two crossings are less than a voxel apart, one of them is within half a voxel.
  if (static_cast<double>(near.distance) > data.voxelSize / 2) return;
  const SegmentedReader::Nearest below = reader.nearest(low), above = reader.nearest(high);
  if (below.label == near.label || above.label == near.label) return;
  const double down = crossingOf(reader, at, near, low, below),
               up = crossingOf(reader, at, near, high, above);
  if (down + up >= 1 || !isThinAround(data, reader, at, near.label)) return;
  V3d p(at[0], at[1], at[2]);
  p[axis] += (up - down) / 2;
  places.push_back({near.label, down + up, p});
}

/// Adds the thin places at the grid points of a block.
void findThin(const SegmentedData& data, const SegmentedBlock& block,
              std::vector<LostPlace>& places) {
  SegmentedReader reader(data);
  const std::uint64_t* words = &data.words[block.words];
  for (std::uint32_t row = 0; row < 8; ++row) {
    const EndMasks masks = block.bits == 1
                               ? endMasksOfBits(words + SegmentedData::kLabelWord, row)
                               : endMasks(row, [&](std::uint32_t a, std::uint32_t b) {
                                   return data.labelAt(block, a) == data.labelAt(block, b);
                                 });
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::uint64_t mask = masks[axis] & words[row]; mask; mask &= mask - 1) {
        const auto n = 64 * row + static_cast<std::uint32_t>(std::countr_zero(mask));
        addIfThin(data, reader, block.origin + SegmentedData::localOf(n), static_cast<int>(axis),
                  places);
      }
  }
}

/// Counts a place. Of equally thin ones, the first counts.
void addPlace(const SegmentedData& data, const LostPlace& place, bool isLost,
              std::map<RegionLabel, ThinPart>& parts) {
  ThinPart& part = parts[place.label];
  const double thickness = place.thickness * data.voxelSize;
  if (part.places == 0 || thickness < part.thickness) {
    part.thickness = thickness;
    part.position = toImath(data.transform->indexToWorld(toVdb(place.position)));
  }
  part.label = place.label;
  part.isLost = part.isLost || isLost;
  ++part.places;
}

}  // namespace

std::vector<ThinPart> thinParts(const SegmentedField& field, std::span<const LostPlace> lost) {
  if (field.isEmpty()) return {};
  const SegmentedData& data = *field.shared();
  std::vector<std::vector<LostPlace>> thin(data.blockCount());
  tbb::parallel_for(std::size_t{0}, data.blockCount(),
                    [&](std::size_t b) { findThin(data, data.blocks[b], thin[b]); });
  std::map<RegionLabel, ThinPart> parts;
  for (const std::vector<LostPlace>& places : thin)
    for (const LostPlace& place : places) addPlace(data, place, false, parts);
  SegmentedReader reader(data);
  for (const LostPlace& place : lost) {
    const auto round = [](double x) { return static_cast<int>(std::lround(x)); };
    const Coord at(round(place.position.x), round(place.position.y), round(place.position.z));
    if (isThinAround(data, reader, at, place.label)) addPlace(data, place, true, parts);
  }
  std::vector<ThinPart> result;
  for (const auto& [label, part] : parts) result.push_back(part);
  return result;
}

std::vector<ThinPart> thinParts(const SegmentedField& field) {
  return thinParts(field, {});
}

}  // namespace levelset
