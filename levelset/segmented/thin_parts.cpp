#include "levelset/segmented/thin_parts.h"

#include <tbb/parallel_for.h>

#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;

/// Distance of a grid point from the interface on the edge to a neighbour, as a part of the edge.
double crossingOf(SegmentedReader& reader, const Coord& at, const SegmentedReader::Nearest& near,
                  const Coord& next, const SegmentedReader::Nearest& other) {
  const double u = static_cast<double>(reader.distanceTo(at, near, other.label)),
               v = static_cast<double>(reader.distanceTo(next, other, near.label));
  return u + v > 0 ? u / (u + v) : 0.5;
}

void addThinParts(const SegmentedData& data, const SegmentedBlock& block, ThinTally& tally) {
  SegmentedReader reader(data);
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    const std::int64_t index = data.distanceIndex(block, n);
    if (index < 0) continue;
    // Of two crossings less than a voxel apart, one is within half a voxel.
    if (static_cast<double>(data.distances[static_cast<std::size_t>(index)]) > 0.5 * data.voxelSize)
      continue;
    const Coord at = block.origin + SegmentedData::localOf(n);
    const SegmentedReader::Nearest near = reader.nearest(at);
    for (int axis = 0; axis < 3; ++axis) {
      Coord low = at, high = at;
      low[axis] -= 1;
      high[axis] += 1;
      const SegmentedReader::Nearest below = reader.nearest(low), above = reader.nearest(high);
      if (below.label == near.label || above.label == near.label) continue;
      const double down = crossingOf(reader, at, near, low, below),
                   up = crossingOf(reader, at, near, high, above);
      if (down + up >= 1) continue;
      openvdb::Vec3d p = at.asVec3d();
      p[axis] += (up - down) / 2;
      tally.add(near.label,
                {1, false, (down + up) * data.voxelSize, toImath(data.transform->indexToWorld(p))});
    }
  }
}

}  // namespace

void ThinTally::add(RegionLabel label, const Place& place) {
  ThinPart& part = parts_[label];
  if (part.places == 0 || place.thickness < part.thickness) {
    part.thickness = place.thickness;
    part.position = place.position;
  }
  part.label = label;
  part.places += place.places;
  part.isLost = part.isLost || place.isLost;
}

void ThinTally::add(const ThinTally& other) {
  for (const auto& [label, part] : other.parts_)
    add(label, {part.places, part.isLost, part.thickness, part.position});
}

std::vector<ThinPart> ThinTally::list() const {
  std::vector<ThinPart> result;
  for (const auto& [label, part] : parts_) result.push_back(part);
  return result;
}

ThinTally thinParts(const SegmentedField& field) {
  ThinTally all;
  if (field.isEmpty()) return all;
  const SegmentedData& data = *field.shared();
  std::vector<ThinTally> tallies(data.blockCount());
  tbb::parallel_for(std::size_t{0}, data.blockCount(),
                    [&](std::size_t b) { addThinParts(data, data.blocks[b], tallies[b]); });
  for (const ThinTally& tally : tallies) all.add(tally);
  return all;
}

}  // namespace levelset
