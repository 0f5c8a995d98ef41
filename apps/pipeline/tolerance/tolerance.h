#pragma once

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// Runs a graph so that its results are off by no more than `--tolerance` of its globals tells.
/// Voxel sizes that its nodes leave out are chosen: a first one by the error models, from which the
/// graph is run, without what it writes, at ever better ones. How far a result is off is told by
/// Richardson's extrapolation from runs with voxels twice and four times as large. What it writes
/// is written once, from the best run.
///
/// The error is the two-sided Hausdorff distance of surfaces: of the triangles that `mesh` makes of
/// a level set, or of the mesh that is the result. What lies beside creases that the field cannot
/// hold is told apart and not judged.
///
/// Fills the report, RunReport::tolerance too.
/// @throws as run(); levelset::UsageError where there is nothing to choose a voxel size for, or no
///         surface in the end; levelset::NumericalError, after the best result was written, where
///         the tolerance was not reached
void runToTolerance(const Graph& graph, const RunSettings& settings, RunReport& report);

}  // namespace pipeline
