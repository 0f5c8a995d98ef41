#pragma once

#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct CheckItem {
  std::string name;  ///< for example "positive background"
  bool passed = false;
  std::string detail;  ///< fault and position if the check failed, else empty; the residual check
                       ///< always fills it
};

struct CheckReport {
  std::vector<CheckItem> items;  ///< the nine level-set checks, then the eikonal residual;
                                 ///< one item only for a default-constructed solid
  double eikonalMean = 0;        ///< mean of ||∇φ| − 1| over the band
  double eikonalMax = 0;
  [[nodiscard]] bool passed() const;
};

/// Runs the nine checks of openvdb::tools::checkLevelSet, one item each, and checks the eikonal
/// residual of the band. The residual fails when its mean exceeds 0.1. Below a half width of two
/// voxels the residual is not measured.
///
/// Two checks differ from OpenVDB's, which reject valid bands. A half width of one voxel suffices.
/// Beside an edge of the solid the one-sided slopes differ, and any slope between them may be
/// correct.
[[nodiscard]] CheckReport check(const NarrowBand& solid, const Progress& progress = {});

}  // namespace levelset
