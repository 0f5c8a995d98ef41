#include <tbb/parallel_for.h>

#include <Imath/ImathBox.h>

#include <cmath>
#include <set>
#include <utility>

#include "levelset/distance/redistance.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/hidden_distances_vdb.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

using openvdb::Coord;

SegmentedField withHiddenDistances(const SegmentedField& field, RegionLabel region,
                                   const std::vector<Coord>& blocks, std::size_t maxMemory) {
  const SegmentedData& data = *field.shared();
  const std::set<Coord> wanted(blocks.begin(), blocks.end());
  // A copy of the field, the packed result and the owner of each voxel.
  requireMemory(
      2 * static_cast<double>(field.memoryUse()) +
          static_cast<double>(sizeof(RegionLabel) * SegmentedData::kVoxels * data.blockCount()),
      memoryLeft(maxMemory));
  Imath::Box3d box;
  for (const Coord& block : wanted)
    for (int corner = 0; corner < 8; ++corner) {
      const openvdb::Vec3d at(8.0 * block[0] + (corner & 4 ? 8 : 0),
                              8.0 * block[1] + (corner & 2 ? 8 : 0),
                              8.0 * block[2] + (corner & 1 ? 8 : 0));
      box.extendBy(toImath(data.transform->indexToWorld(at)));
    }
  const NarrowBand band =
      redistance(storedBand(field, region),
                 {.halfWidth = data.halfWidth + 1, .region = box, .maxMemory = maxMemory});
  std::vector<OwnedBlock> owned(data.blockCount());
  tbb::parallel_for(std::size_t{0}, owned.size(), [&](std::size_t b) {
    OwnedBlock& block = owned[b];
    block.block = SegmentedData::blockCoord(data.blocks[b].origin);
    block.owners.resize(SegmentedData::kVoxels);
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
      block.owners[n] = data.labelAt(data.blocks[b], n);
    block.shorten();
    if (!wanted.contains(block.block)) block.kept = packedBlockOf(data, b);
  });
  const auto distances = [&](std::size_t b, std::uint32_t n, RegionLabel own,
                             const std::vector<RegionLabel>& others, std::vector<float>& result) {
    SegmentedReader reader(data);
    const Coord at = data.blocks[b].origin + SegmentedData::localOf(n);
    const SegmentedReader::Nearest near = reader.nearest(at);
    result.clear();
    float least = data.background;
    for (const RegionLabel other : others) {
      result.push_back(std::max(0.0f, storedDistance(reader, at, near, other)));
      least = std::min(least, result.back());
    }
    // Just below the background: not known, see packPartition().
    if (own != region || least < std::nextafter(data.background, 0.0f)) return;
    const float depth = std::abs(vdb(band).tree().getValue(at));
    if (depth < data.background)
      result[nearestOwner(at, others, [&](const Coord& p) { return reader.label(p); })] = depth;
  };
  return packPartition(data.transform->copy(), data.halfWidth,
                       copyTiles(data, [](RegionLabel label) { return label; }), std::move(owned),
                       distances, {});
}

}  // namespace levelset
