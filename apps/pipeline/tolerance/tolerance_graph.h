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
  std::vector<std::size_t> once;    ///< values independent of voxel sizes, such as meshes of files
  /// The same nodes as `once`; with a cache, `once` is empty and they are in `again` too.
  std::vector<std::size_t> constant;
  std::vector<std::size_t> again;  ///< values computed at each voxel size that is tried
  std::vector<std::size_t> ends;   ///< nodes that write, draw, print or check
  std::vector<std::size_t>
      outputs;  ///< part of `again`: level sets and meshes with an error estimate
  std::vector<std::size_t> lasting;  ///< values that `ends` take or that no node takes
};

/// Assigns the nodes of a graph to their roles.
/// @throws levelset::UsageError if no voxel size is open, or no result has an error estimate
/// @throws levelset::UsageError if a length counts in the open voxel size, or an action writes
/// files
///         beside its result
[[nodiscard]] ToleranceParts toleranceParts(const Graph& graph);

/// Returns a warning for each length in voxels: the exact surface then depends on the voxel size.
[[nodiscard]] std::vector<std::string> voxelLengths(const Graph& graph,
                                                    const ToleranceParts& parts);

/// A graph of some nodes of another graph.
struct PartGraph {
  Graph graph;
  std::vector<std::size_t> origin;  ///< for each node, its index in the original graph
};

/// Extracts some nodes of a graph.
/// @param keep   indices in ascending order; contains the operands of each node without given value
/// @param given  values by index in the original graph; those outside `keep` are ignored
[[nodiscard]] PartGraph partGraph(const Graph& graph, const std::vector<std::size_t>& keep,
                                  const std::map<std::size_t, Value>& given);

/// Sets the voxel size of the chosen nodes to `voxel` times `coarsening`. Multiplies the given
/// voxel sizes by `coarsening`.
void setVoxels(Graph& graph, const ToleranceParts& parts, double voxel, double coarsening);
/// Sets --resolution of the chosen nodes.
void setResolution(Graph& graph, const ToleranceParts& parts, int resolution);

/// Name of a result: "@NAME", or the action.
[[nodiscard]] std::string nameOf(const Node& node);

}  // namespace pipeline
