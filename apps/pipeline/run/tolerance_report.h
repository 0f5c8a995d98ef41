#pragma once

#include <string>
#include <vector>

namespace pipeline {

/// Requested and achieved error of one result. Lengths are world units.
struct ToleranceOutput {
  std::string name;         ///< "@NAME", or the action that computed the result
  double requested = 0;     ///< largest error that the user accepts
  double achieved = 0;      ///< estimate: two-sided Hausdorff distance, away from creases
  bool isMeasured = false;  ///< `achieved` is measured against the exact surface, not estimated
  double crease = 0;        ///< error estimate near creases that the field cannot represent
  double creaseShare = 0;   ///< fraction of the surface that counts as near a crease
  double order = 0;         ///< convergence order that the error estimate assumes
  [[nodiscard]] bool isReached() const { return achieved <= requested; }
};

/// A voxel size that was tried, and its outcome.
struct ToleranceRound {
  double voxelSize = 0;                  ///< world units
  double seconds = 0;                    ///< wall time, including the coarser runs of this round
  std::vector<ToleranceOutput> outputs;  ///< empty if the round failed
  std::string failure;                   ///< error message of the failure
};

/// Outcome of a run with `--tolerance`.
struct ToleranceReport {
  std::string written;  ///< tolerance as the user wrote it
  /// Voxel size that the error models predict before the first run, world units; 0: no model
  /// applies.
  double modelVoxelSize = 0;
  std::vector<std::string> models;  ///< regression cases that measured these error models
  double voxelSize = 0;             ///< voxel size of the result, world units
  std::vector<ToleranceOutput> outputs;
  std::vector<ToleranceRound> rounds;
  std::string limit;  ///< reason why refinement stopped early; empty: it did not
  [[nodiscard]] bool isReached() const {
    for (const ToleranceOutput& output : outputs)
      if (!output.isReached()) return false;
    return true;
  }
};

}  // namespace pipeline
