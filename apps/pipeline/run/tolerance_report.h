#pragma once

#include <string>
#include <vector>

namespace pipeline {

/// What was asked of one result, and what was reached. Lengths are world units.
struct ToleranceOutput {
  std::string name;         ///< "@NAME", or the action that made it
  double requested = 0;     ///< largest error asked for
  double achieved = 0;      ///< estimate: two-sided Hausdorff distance, away from creases
  bool isMeasured = false;  ///< against the exact surface, and not estimated
  double crease = 0;        ///< estimate of the same beside creases that the field cannot hold
  double creaseShare = 0;   ///< of the surface, that counts as beside a crease
  double order = 0;         ///< at which the error falls, as used
  [[nodiscard]] bool isReached() const { return achieved <= requested; }
};

/// One voxel size that was tried.
struct ToleranceRound {
  double voxelSize = 0;
  double seconds = 0;                    ///< wall time, its coarser runs included
  std::vector<ToleranceOutput> outputs;  ///< empty where it failed
  std::string failure;                   ///< the sentence of what refused it
};

/// Of a run with `--tolerance`.
struct ToleranceReport {
  std::string written;        ///< as it was asked for
  double modelVoxelSize = 0;  ///< what the error models picked before anything ran; 0: could not
  std::vector<std::string> models;  ///< cases of the regression suite that those rest on
  double voxelSize = 0;             ///< of the result
  std::vector<ToleranceOutput> outputs;
  std::vector<ToleranceRound> rounds;
  std::string limit;  ///< what kept it from going on; empty: nothing
  [[nodiscard]] bool isReached() const {
    for (const ToleranceOutput& output : outputs)
      if (!output.isReached()) return false;
    return true;
  }
};

}  // namespace pipeline
