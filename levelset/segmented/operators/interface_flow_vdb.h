#pragma once

// Steps of the motion of interfaces by mean curvature. Includes OpenVDB: for .cpp files only.

#include <cstddef>
#include <map>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/operators/region_bands_vdb.h"

namespace levelset {

/// Diffusion-generated motion of a partition [Esedoglu10].
class InterfaceFlow {
 public:
  /// @param isFixed  for each region: it does not move
  /// @param step     duration of a step, voxels²
  /// @param hasJunctions  three regions meet: takes the kernel that keeps angles of 120°
  InterfaceFlow(RegionBands bands, std::vector<char> isFixed, double step, bool hasJunctions,
                bool keepsVolumes, std::size_t maxMemory);

  /// Half width of the bands that steps of this length need, voxels.
  [[nodiscard]] static double halfWidthFor(double step, bool hasJunctions);

  /// Takes a step.
  /// @return labels of the regions that have vanished, ascending
  std::vector<RegionLabel> advance(const Progress& progress);

  /// Makes the next steps keep the volumes of the present regions and what is missing of them.
  /// @param missing  by label, voxels
  void addVolumes(const std::map<RegionLabel, double>& missing);

  [[nodiscard]] const RegionBands& bands() const { return bands_; }
  /// Largest relative error of a volume that was to be kept, over all steps. It does not count the
  /// errors of redistancing, for which the next step makes up.
  [[nodiscard]] double volumeError() const { return volumeError_; }

 private:
  /// Volumes of the present regions, voxels.
  [[nodiscard]] std::vector<double> volumes() const;

  RegionBands bands_;
  std::vector<char> isFixed_;
  std::vector<double> volumes_;    ///< to keep, voxels; empty: none
  std::vector<double> reached_;    ///< by the last step before its redistancing, voxels
  std::vector<double> constants_;  ///< added to the distances, world units
  double step_;                    ///< voxels²
  bool hasJunctions_;
  std::size_t maxMemory_;
  double volumeError_ = 0;
};

}  // namespace levelset
