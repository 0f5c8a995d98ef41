#include "levelset/segmented/thin_parts.h"

#include <tbb/parallel_for.h>

#include <array>
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

/// Adds the thin places at the grid points of a block.
void findThin(const SegmentedData& data, const SegmentedBlock& block,
              std::vector<LostPlace>& places) {
  SegmentedReader reader(data);
  std::array<RegionLabel, SegmentedData::kVoxels> labels;
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) labels[n] = data.labelAt(block, n);
  constexpr std::array<std::uint32_t, 3> kStrides = {64, 8, 1};
  const float* distances = &data.distances[block.distances];
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    if (!(data.words[block.words + (n >> 6)] >> (n & 63) & 1)) continue;
    // Of two crossings less than a voxel apart, one is within half a voxel.
    if (static_cast<double>(*distances++) > data.voxelSize / 2) continue;
    const Coord local = SegmentedData::localOf(n), at = block.origin + local;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t stride = kStrides[static_cast<std::size_t>(axis)];
      if (local[axis] > 0 && labels[n - stride] == labels[n]) continue;
      if (local[axis] < 7 && labels[n + stride] == labels[n]) continue;
      Coord low = at, high = at;
      low[axis] -= 1;
      high[axis] += 1;
      const SegmentedReader::Nearest near = reader.nearest(at), below = reader.nearest(low),
                                     above = reader.nearest(high);
      if (below.label == near.label || above.label == near.label) continue;
      const double down = crossingOf(reader, at, near, low, below),
                   up = crossingOf(reader, at, near, high, above);
      if (down + up >= 1 || !isThinAround(data, reader, at, near.label)) continue;
      V3d p(at[0], at[1], at[2]);
      p[axis] += (up - down) / 2;
      places.push_back({near.label, down + up, p});
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

}  // namespace levelset
