#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// How far the triangles of a zero set are from the surface that an action stands for, as the
/// regression suite measures it: at most `constant` × voxel × (voxel / radius)^(order − 1), with
/// the least radius of curvature; beside creases `creaseConstant` × voxel.
struct ErrorModel {
  const char* action = "";
  double order = 1;
  double constant = 0;        ///< 0: exact away from creases
  double creaseConstant = 0;  ///< 0: makes no creases
  const char* source = "";    ///< case of the regression suite that measured it, docs/regression.md
};

/// Of an action that the suite measures; of any other the least that a level set promises: first
/// order, with creases.
[[nodiscard]] const ErrorModel& errorModel(const std::string& action);

/// What the models say of a graph as a whole, before anything runs.
struct GraphModel {
  double order = 2;                ///< the least of its actions
  bool makesCreases = false;       ///< does any of them?
  std::vector<const char*> cases;  ///< of the suite, that it rests on
};
/// @param nodes  those that are concerned
[[nodiscard]] GraphModel graphModel(const Graph& graph, const std::vector<std::size_t>& nodes);

/// The voxel size at which the error of what a node makes is `error`, by its model.
/// @param error  world units
/// @return       world units; 0 where the model cannot tell: the surface is flat, or its curvature
///               is known only once it is there
[[nodiscard]] double modelVoxelSize(const Node& node, double error);

}  // namespace pipeline
