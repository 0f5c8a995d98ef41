#include "levelset/segmented/segment_solids.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "levelset/csg/csg_vdb.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/segmented/solids_partition_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

std::vector<RegionLabel> checkedLabels(std::size_t count, const SegmentSolidsOptions& options) {
  std::vector<RegionLabel> labels = options.labels;
  if (labels.empty()) {
    if (count > 65535)
      throw UsageError(fmt::format("{} solids are more than there are labels, 65535", count));
    for (std::size_t i = 1; i <= count; ++i) labels.push_back(static_cast<RegionLabel>(i));
    return labels;
  }
  if (labels.size() != count) {
    throw UsageError(
        fmt::format("{} labels are given for {} solids; give one for each", labels.size(), count));
  }
  std::vector<RegionLabel> sorted = labels;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.front() == kVoid)
    throw UsageError("a solid has the label 0, which is the void; use labels from 1 to 65535");
  const auto repeated = std::adjacent_find(sorted.begin(), sorted.end());
  if (repeated != sorted.end()) {
    throw UsageError(fmt::format(
        "two solids have the label {}; unite them first, or use different labels", *repeated));
  }
  return labels;
}

void checkSegmentSolids(std::span<const NarrowBand> solids, const SegmentSolidsOptions& options) {
  if (solids.empty()) throw UsageError("there are no solids; name at least one");
  if (!(options.halfWidth >= 2) || !std::isfinite(options.halfWidth)) {
    throw UsageError(fmt::format("the half width is {} voxels; a segmented field needs at least 2",
                                 options.halfWidth));
  }
  if (!(options.gap >= 0) || options.gap > 0.5)
    throw UsageError(fmt::format("the gap is {} voxels; give 0 to 0.5", options.gap));
  double bytes = 0;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    requireSolid(solids[i]);
    if (solids[i].isEmpty())
      throw InvalidInput(fmt::format("operand {} has no surface; leave it out", i + 1));
    bytes += static_cast<double>(solids[i].memoryUse());
  }
  requireMemory(2 * bytes, options.maxMemory);
}

}  // namespace

SegmentSolidsResult segmentSolids(std::span<const NarrowBand> solids,
                                  const SegmentSolidsOptions& options) {
  checkSegmentSolids(solids, options);
  std::vector<RegionLabel> labels = checkedLabels(solids.size(), options);
  SegmentSolidsResult result;

  // === One grid
  std::vector<NarrowBand> operands(solids.begin(), solids.end());
  for (std::size_t i = 0; i < operands.size(); ++i) {
    if (operands[i].halfWidth() >= options.halfWidth * (1 - 1e-6)) continue;
    result.notes.push_back(
        fmt::format("operand {} was widened from a half width of {:.6g} to {:.6g} voxels", i + 1,
                    operands[i].halfWidth(), options.halfWidth));
    operands[i] = redistance(std::move(operands[i]),
                             {.halfWidth = options.halfWidth, .maxMemory = options.maxMemory});
  }
  bringToOneGrid(operands, options.maxMemory, result.notes);
  report(options.progress, 0.1);

  // === Partition
  PartitionOfSolids parts = partitionSolids(operands, labels, options.halfWidth, options.gap,
                                            subProgress(options.progress, 0.1, 0.9));
  result.field = assembleSegmented(vdb(operands.front()).transform().copy(), options.halfWidth,
                                   parts.tiles, std::move(parts.blocks));

  // === Report
  const std::vector<RegionLabel> owners = result.field.labels();
  std::sort(labels.begin(), labels.end());
  std::set_difference(labels.begin(), labels.end(), owners.begin(), owners.end(),
                      std::back_inserter(result.vanished));
  result.thinParts = thinParts(result.field, parts.lost);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
