#pragma once

// Steps of the motion of interfaces by mean curvature. Includes OpenVDB: for .cpp files only.

#include <cstddef>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/operators/region_bands_vdb.h"

namespace levelset {

/// Diffusion-generated motion of a partition [Esedoglu10].
class InterfaceFlow {
 public:
  /// @param isFixed  for each region: it does not move
  /// @param step     duration of a step, voxels²
  InterfaceFlow(RegionBands bands, std::vector<char> isFixed, double step, bool keepsVolumes,
                std::size_t maxMemory);

  /// Half width of the bands that steps of this length need, voxels.
  [[nodiscard]] static double halfWidthFor(double step);

  /// Takes a step.
  /// @return labels of the regions that have vanished, ascending
  std::vector<RegionLabel> advance(const Progress& progress);

  [[nodiscard]] const RegionBands& bands() const { return bands_; }
  /// Largest relative error of a volume that was to be kept, over all steps. It does not count the
  /// errors of redistancing.
  [[nodiscard]] double volumeError() const { return volumeError_; }

 private:
  RegionBands bands_;
  std::vector<char> isFixed_;
  std::vector<double> volumes_;    ///< to keep, voxels; empty: none
  std::vector<double> constants_;  ///< added to the distances, world units
  std::vector<float> kernel_;      ///< half of it, from the centre
  std::size_t maxMemory_;
  double volumeError_ = 0;
};

}  // namespace levelset
