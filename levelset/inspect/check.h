#pragma once

#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct CheckItem {
  std::string name;  ///< "positive background"
  bool passed = false;
  std::string detail;  ///< what was found where, when it failed
};

struct CheckReport {
  std::vector<CheckItem> items;  ///< the nine level-set checks, then the eikonal residual
  double eikonalMean = 0;        ///< mean of ||∇φ| − 1| over the band
  double eikonalMax = 0;
  [[nodiscard]] bool passed() const;
};

/// The nine checks of openvdb::tools::checkLevelSet, one item each, and the eikonal residual of the
/// band (fails when its mean passes 0.1). They differ from OpenVDB where those fault sound bands: a
/// half width of one voxel is enough, and beside an edge of the solid, where one-sided slopes
/// differ, any between them may be the right one.
[[nodiscard]] CheckReport check(const NarrowBand& solid, const Progress& progress = {});

}  // namespace levelset
