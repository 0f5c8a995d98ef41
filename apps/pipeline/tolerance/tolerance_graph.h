#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/values/value.h"

namespace pipeline {

/// Roles of the needed nodes of a graph in a run with --tolerance. Each list contains node indices
/// in ascending order.
struct ToleranceParts {
  std::vector<std::size_t> chosen;  ///< nodes whose voxel size the tolerance determines
  std::vector<std::size_t> fixed;   ///< nodes with a given voxel size
  /// Nodes whose values do not depend on voxel sizes, such as meshes read from files.
  std::vector<std::size_t> once;
  /// The same nodes as `once`. With a cache, `once` is empty, and these nodes are in `again` too.
  std::vector<std::size_t> constant;
  std::vector<std::size_t> again;  ///< nodes that are computed at each voxel size that is tried
  std::vector<std::size_t> ends;   ///< nodes that write, draw, print or check
  /// Nodes of `again` whose error is compared with the tolerance: level sets and meshes that `ends`
  /// or no node reads.
  std::vector<std::size_t> outputs;
  std::vector<std::size_t> lasting;  ///< nodes whose values are operands of `ends` or of no node
};

/// Assigns the needed nodes of a graph to their roles.
/// @throws levelset::UsageError if every node has a given voxel size, or no result has an error
///         estimate
/// @throws levelset::UsageError if a node without a given voxel size has a length in voxels, or an
///         action writes files beside its result
[[nodiscard]] ToleranceParts toleranceParts(const Graph& graph);

/// Returns a warning for each length in voxels: the exact surface then depends on the voxel size.
[[nodiscard]] std::vector<std::string> voxelLengths(const Graph& graph,
                                                    const ToleranceParts& parts);

/// A graph that consists of some nodes of another graph.
struct PartGraph {
  Graph graph;
  std::vector<std::size_t> origin;  ///< for each node, its index in the original graph
};

/// Extracts some nodes of a graph.
/// @param keep   indices in ascending order; contains the operands of each node without given value
/// @param given  values by index in the original graph; those outside `keep` are ignored
[[nodiscard]] PartGraph partGraph(const Graph& graph, const std::vector<std::size_t>& keep,
                                  const std::map<std::size_t, Value>& given);

/// Sets the voxel size of the nodes in ToleranceParts::chosen to `voxel` times `coarsening`.
/// Multiplies the voxel sizes that the user gave by `coarsening`.
void setVoxels(Graph& graph, const ToleranceParts& parts, double voxel, double coarsening);
/// Sets --resolution of the nodes in ToleranceParts::chosen.
void setResolution(Graph& graph, const ToleranceParts& parts, int resolution);

/// Name of a node's result in messages: "@NAME" if --as names it, otherwise the name of the action.
[[nodiscard]] std::string nameOf(const Node& node);

}  // namespace pipeline
