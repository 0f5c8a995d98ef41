#include "levelset/segmented/operators/edit_segmented.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/hidden_distances_vdb.h"
#include "levelset/segmented/operators/pack_partition_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;

SegmentedField edit(const SegmentedField& field, const NarrowBand& solid, RegionLabel label,
                    const EditSegmentedOptions& options) {
  if (!(options.gap >= 0) || options.gap > 0.5)
    throw UsageError(fmt::format("the gap is {} voxels; give 0 to 0.5", options.gap));
  if (field.isEmpty())
    throw InvalidInput("the segmentation has no interface; give one with a region");
  requireNoSheets(field);
  EditedSpace space;
  space.label = label;
  if (options.over) {
    requireLabels(field, *options.over);
    space.over = *options.over;
  } else {
    space.over = field.labels();
    space.over.push_back(kVoid);
  }
  std::erase(space.over, label);
  std::sort(space.over.begin(), space.over.end());
  const NarrowBand band = onGridOfField(field, solid, options.maxMemory);
  requireMemory(2 * static_cast<double>(field.memoryUse() + band.memoryUse()),
                memoryLeft(options.maxMemory));
  space.tree = &vdb(band).tree();
  space.maxMemory = options.maxMemory;
  if (label != kVoid) space.gap = static_cast<float>(options.gap * field.voxelSize());
  return editSpace(field, space, options.progress);
}

}  // namespace

SegmentedField addSolid(const SegmentedField& field, const NarrowBand& solid, RegionLabel label,
                        const EditSegmentedOptions& options) {
  if (label == kVoid)
    throw UsageError("label 0 is the void; give a label from 1 to 65535, or cut the solid out");
  return edit(field, solid, label, options);
}

SegmentedField cut(const SegmentedField& field, const NarrowBand& solid,
                   const EditSegmentedOptions& options) {
  return edit(field, solid, kVoid, options);
}

namespace {

/// Partition in which regions have new labels.
class Relabelling {
 public:
  Relabelling(const SegmentedField& field, const std::map<RegionLabel, RegionLabel>& labels)
      : data_(*field.shared()), labels_(labels) {
    std::map<RegionLabel, std::vector<RegionLabel>> sources;
    sources[kVoid].push_back(kVoid);
    for (const RegionLabel label : field.labels()) sources[newLabel(label)].push_back(label);
    sources_ = std::move(sources);
  }

  /// Computes the distances to the regions that are made of several ones.
  void measure(const SegmentedField& field, std::size_t maxMemory) {
    for (const auto& [label, sources] : sources_) {
      if (sources.size() < 2) continue;
      NarrowBand stored = storedBandOfAll(field, sources);
      if (stored.isEmpty()) continue;
      merged_.emplace(label, redistance(std::move(stored), {.halfWidth = field.halfWidth() + 1,
                                                            .maxMemory = maxMemory}));
    }
  }

  [[nodiscard]] SegmentedField run(const Progress& progress) {
    openvdb::Int32Tree::Ptr tiles =
        copyTiles(data_, [&](RegionLabel label) { return newLabel(label); });
    std::vector<OwnedBlock> blocks(data_.blockCount());
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
      OwnedBlock& block = blocks[b];
      block.block = SegmentedData::blockCoord(data_.blocks[b].origin);
      block.owners.resize(SegmentedData::kVoxels);
      for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
        block.owners[n] = newLabel(data_.labelAt(data_.blocks[b], n));
      block.shorten();
      if (keepsLabels(b)) block.kept = packedBlockOf(data_, b);
    });
    const auto distances = [&](std::size_t b, std::uint32_t n, RegionLabel own,
                               const std::vector<RegionLabel>& others, std::vector<float>& result) {
      distancesOf(data_.blocks[b].origin + SegmentedData::localOf(n), own, others, result);
    };
    SegmentedField result = packPartition(data_.transform->copy(), data_.halfWidth,
                                          std::move(tiles), std::move(blocks), distances, progress);
    requireRegion(result);
    return result;
  }

 private:
  [[nodiscard]] RegionLabel newLabel(RegionLabel label) const {
    const auto found = labels_.find(label);
    return found == labels_.end() ? label : found->second;
  }
  [[nodiscard]] bool keepsLabels(std::size_t block) const {
    const auto first = data_.palettes.begin() + data_.blocks[block].palette,
               last = data_.palettes.begin() + data_.blocks[block + 1].palette;
    return std::all_of(first, last, [&](RegionLabel label) { return newLabel(label) == label; });
  }

  void distancesOf(const Coord& at, RegionLabel own, const std::vector<RegionLabel>& others,
                   std::vector<float>& result) const {
    SegmentedReader reader(data_);
    const SegmentedReader::Nearest near = reader.nearest(at);
    result.clear();
    float least = data_.background;
    for (const RegionLabel other : others) {
      float distance = data_.background;
      for (const RegionLabel source : sources_.at(other))
        distance = std::min(distance, storedDistance(reader, at, near, source));
      result.push_back(std::max(0.0f, distance));
      least = std::min(least, result.back());
    }
    const auto merged = merged_.find(own);
    if (least < data_.background || merged == merged_.end()) return;
    // The interface with a former neighbour hid the next one.
    const float depth = std::abs(vdb(merged->second).tree().getValue(at));
    if (depth < data_.background)
      result[nearestOwner(at, others, [&](const Coord& p) { return newLabel(reader.label(p)); })] =
          depth;
  }

  const SegmentedData& data_;
  const std::map<RegionLabel, RegionLabel>& labels_;
  std::map<RegionLabel, std::vector<RegionLabel>> sources_;  ///< old labels by new label, ascending
  std::map<RegionLabel, NarrowBand> merged_;                 ///< by new label
};

}  // namespace

SegmentedField relabel(const SegmentedField& field,
                       const std::map<RegionLabel, RegionLabel>& labels,
                       const RelabelOptions& options) {
  std::vector<RegionLabel> old;
  for (const auto& [from, to] : labels) {
    if (from == kVoid)
      throw UsageError("label 0 is the void, which keeps its label; give labels of regions");
    old.push_back(from);
  }
  requireLabels(field, old);
  if (field.isEmpty()) return field;
  requireNoSheets(field);
  requireMemory(3 * static_cast<double>(field.memoryUse()), memoryLeft(options.maxMemory));
  Relabelling relabelling(field, labels);
  relabelling.measure(field, options.maxMemory);
  return relabelling.run(options.progress);
}

}  // namespace levelset
