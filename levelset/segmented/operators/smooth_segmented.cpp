#include "levelset/segmented/operators/smooth_segmented.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "levelset/error.h"
#include "levelset/progress.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/interface_flow_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"

namespace levelset {
namespace {

constexpr double kDefaultStep = 0.5;    // voxels²
constexpr double kJunctionStep = 0.25;  // voxels², where regions meet
constexpr double kLongestFlowStep = 4;  // voxels²
constexpr double kBandsDone = 0.1;      // progress

void checkSmooth(const SegmentedField& field, double time, const SmoothSegmentedOptions& options) {
  if (!(time >= 0) || !std::isfinite(time))
    throw UsageError(fmt::format("the time is {}; give a number of at least 0", time));
  if (options.steps && *options.steps == 0)
    throw UsageError("the number of steps is 0; give at least 1");
  if (field.isEmpty())
    throw InvalidInput("the segmentation has no interface; give one with a region");
  requireNoSheets(field);
  const std::vector<RegionLabel> labels = field.labels();
  for (const RegionLabel label : options.fixed)
    if (label != kVoid && !std::binary_search(labels.begin(), labels.end(), label))
      throw UsageError(
          fmt::format("region {} is to be fixed, but the segmentation has no such region; give "
                      "labels that it has",
                      label));
}

/// Volumes of the regions of a mesh, world units³.
std::map<RegionLabel, double> volumesOfMesh(const SegmentedField& field,
                                            const SegmentedMeshOptions& mesh) {
  std::map<RegionLabel, double> volumes;
  for (const RegionMeasure& region : measureSegmented(field, mesh).regions)
    if (region.label != kVoid) volumes[region.label] = region.volume;
  return volumes;
}

/// Makes up for the volumes that the first step has changed. Redistancing rounds the edges of the
/// given regions, so their volumes are known from their mesh only. Later steps have the edges of
/// the flow, which are exact. The errors of both meshes cancel, since the interfaces have hardly
/// moved.
void restoreVolumes(const SegmentedField& field, InterfaceFlow& flow,
                    const SegmentedMeshOptions& mesh) {
  std::map<RegionLabel, double> missing = volumesOfMesh(field, mesh);
  const double voxel = std::pow(field.voxelSize(), 3);
  for (const auto& [label, volume] :
       volumesOfMesh(fieldOfBands(flow.bands(), field.halfWidth(), mesh.progress), mesh))
    missing[label] -= volume;
  for (auto& [label, volume] : missing) volume /= voxel;
  flow.addVolumes(missing);
}

}  // namespace

SmoothSegmentedResult smoothSegmented(const SegmentedField& field, double time,
                                      const SmoothSegmentedOptions& options) {
  checkSmooth(field, time, options);
  SmoothSegmentedResult result;
  if (time == 0) {
    result.field = field;
    return result;
  }
  std::vector<RegionLabel> all = field.labels();
  all.push_back(kVoid);
  const auto isHeld = [&](RegionLabel label) {
    return std::find(options.fixed.begin(), options.fixed.end(), label) != options.fixed.end();
  };
  if (std::all_of(all.begin(), all.end(), isHeld)) {
    result.field = field;
    return result;
  }
  const double inVoxels = time / (field.voxelSize() * field.voxelSize());
  constexpr double kMostSteps = 1e9;
  // Grid points beside two other regions.
  const bool hasJunctions = !field.shared()->extras.empty();
  const double defaultSteps = inVoxels / (hasJunctions ? kJunctionStep : kDefaultStep);
  if (!options.steps && defaultSteps > kMostSteps)
    throw UsageError(
        fmt::format("a time of {:.4g} takes {:.2g} steps; give a shorter time or use larger voxels",
                    time, defaultSteps));
  result.steps =
      options.steps.value_or(static_cast<std::size_t>(std::max(1.0, std::ceil(defaultSteps))));
  const double step = inVoxels / static_cast<double>(result.steps);
  if (step > kLongestFlowStep)
    throw UsageError(fmt::format(
        "a step of {:.4g} is longer than {:.4g}, four voxels squared; give at least {:.0f} steps",
        time / static_cast<double>(result.steps),
        kLongestFlowStep * field.voxelSize() * field.voxelSize(),
        std::ceil(inVoxels / kLongestFlowStep)));

  RegionBands bands = regionBands(field, InterfaceFlow::halfWidthFor(step, hasJunctions),
                                  options.maxMemory, subProgress(options.progress, 0, kBandsDone));
  std::vector<char> isFixed;
  for (const RegionLabel label : bands.labels) isFixed.push_back(isHeld(label));
  InterfaceFlow flow(std::move(bands), std::move(isFixed), step, hasJunctions, options.keepsVolumes,
                     options.maxMemory);
  const double count = static_cast<double>(result.steps);
  for (std::size_t n = 0; n < result.steps; ++n) {
    const double done = static_cast<double>(n) / count, next = static_cast<double>(n + 1) / count;
    const std::vector<RegionLabel> vanished = flow.advance(
        subProgress(options.progress, kBandsDone + 0.8 * done, kBandsDone + 0.8 * next));
    for (const RegionLabel label : vanished) result.vanished.push_back({label, next * time});
    if (flow.bands().bands.size() < 2)
      throw InvalidInput(fmt::format(
          "all regions vanish before the time {:.4g}; give a shorter time", next * time));
    if (n == 0 && options.keepsVolumes && result.steps > 1) {
      const double at = kBandsDone + 0.8 * next;
      restoreVolumes(
          field, flow,
          {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, at, at)});
    }
  }
  result.volumeError = flow.volumeError();
  result.field = fieldOfBands(flow.bands(), field.halfWidth(),
                              subProgress(options.progress, kBandsDone + 0.8, 1));
  return result;
}

}  // namespace levelset
