#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"

namespace pipeline {

using levelset::ErrorModel;

/// The error model of an action. An action that the suite does not measure gets the least that a
/// level set promises: first order, with creases.
[[nodiscard]] const ErrorModel& errorModel(const Operator& op);

/// Error model of a graph, known before anything runs.
struct GraphModel {
  double order = 2;                ///< lowest order of the actions
  bool makesCreases = false;       ///< true if one of the actions makes creases
  std::vector<const char*> cases;  ///< cases of the suite that measured the models
};
/// @param nodes  the nodes to consider
[[nodiscard]] GraphModel graphModel(const Graph& graph, const std::vector<std::size_t>& nodes);

/// The voxel size at which a node's result has the error `error`, by the model of its action.
/// @param error  world units
/// @return       world units; 0 where the model gives none: the surface is flat, or its curvature
///               is not known before the result is computed
[[nodiscard]] double modelVoxelSize(const Node& node, double error);

}  // namespace pipeline
