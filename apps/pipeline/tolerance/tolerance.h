#pragma once

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// Runs a graph so that the error of its results is at most the global option `--tolerance`.
/// Chooses the voxel sizes that nodes leave out. The error models give the first voxel size;
/// further runs refine or coarsen it. Richardson extrapolation from runs with voxels twice and four
/// times as large estimates the error. Files are written once, from the best run.
///
/// The error is the two-sided Hausdorff distance of surfaces. The surface of a level set is the
/// mesh that `mesh` computes. Errors near creases that the field cannot represent are reported
/// separately and do not count.
///
/// Fills the report, including RunReport::tolerance.
/// @throws levelset::Error as run()
/// @throws levelset::UsageError if no node leaves its voxel size open, or no result has a surface
/// @throws levelset::NumericalError if the tolerance was not reached; the best result was written
void runToTolerance(const Graph& graph, const RunSettings& settings, RunReport& report);

}  // namespace pipeline
