#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/values/value.h"

namespace pipeline {

/// What a run with --tolerance does with the nodes of a graph that are needed. Numbers of nodes, in
/// order.
struct ToleranceParts {
  std::vector<std::size_t> chosen;  ///< their voxel size follows from the tolerance
  std::vector<std::size_t> fixed;   ///< theirs was given
  std::vector<std::size_t> once;    ///< values that no voxel size has a part in, as meshes of files
  /// Of those, also where a cache makes them `again`.
  std::vector<std::size_t> constant;
  std::vector<std::size_t> again;    ///< values that are made at every voxel size that is tried
  std::vector<std::size_t> ends;     ///< what writes, draws, prints or checks
  std::vector<std::size_t> outputs;  ///< of `again`: level sets and meshes whose error is judged
  std::vector<std::size_t> lasting;  ///< values that `ends` take
};

/// @throws levelset::UsageError where there is nothing to choose or nothing to judge, where a
///         length counts in the voxels to be chosen, and where an action writes on its way
[[nodiscard]] ToleranceParts toleranceParts(const Graph& graph);

/// Lengths that count in voxels, so that the surface itself changes with their size: sentences.
[[nodiscard]] std::vector<std::string> voxelLengths(const Graph& graph,
                                                    const ToleranceParts& parts);

/// Some nodes of a graph.
struct PartGraph {
  Graph graph;
  std::vector<std::size_t> origin;  ///< by node: its number in the whole
};

/// @param keep   in order, with all that they take but what `given` tells
/// @param given  by number in the whole; only those in `keep` count
[[nodiscard]] PartGraph partGraph(const Graph& graph, const std::vector<std::size_t>& keep,
                                  const std::map<std::size_t, Value>& given);

/// Sets the voxel size of `chosen`, and makes those that were given `coarsening` times as large.
void setVoxels(Graph& graph, const ToleranceParts& parts, double voxel, double coarsening);
/// Sets --resolution of `chosen`.
void setResolution(Graph& graph, const ToleranceParts& parts, int resolution);

/// "@NAME", or the action.
[[nodiscard]] std::string nameOf(const Node& node);

}  // namespace pipeline
