#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"

namespace pipeline {

using levelset::ErrorModel;

/// Returns the error model of an action. An action that the regression suite does not measure gets
/// a cautious model: first order, with creases.
[[nodiscard]] const ErrorModel& errorModel(const Operator& op);

/// Returns the option for which an action has no error model, such as "--method pde"; empty: none
/// was given. Such methods exist for comparison.
[[nodiscard]] std::string optionWithoutModel(const Node& node);

/// Error model of a graph, known before anything runs.
struct GraphModel {
  double order = 2;                ///< lowest convergence order of the actions
  bool makesCreases = false;       ///< true if one of the actions creates creases
  std::vector<const char*> cases;  ///< regression cases that measured the models
};
/// Combines the error models of some nodes of a graph.
/// @param nodes  indices of these nodes
[[nodiscard]] GraphModel graphModel(const Graph& graph, const std::vector<std::size_t>& nodes);

/// Returns the voxel size at which a node's result has the error `error`, by the error model of its
/// action.
/// @param error  world units
/// @return       world units; 0 if the model gives none: the result is exact away from creases, or
///               its curvature is unknown before it is computed
[[nodiscard]] double modelVoxelSize(const Node& node, double error);

}  // namespace pipeline
