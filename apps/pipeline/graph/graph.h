#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// An action, its parameters checked, and what it takes.
struct Node {
  const Operator* op = nullptr;
  std::map<std::string, std::string> options;  ///< by full name; a flag is "true"
  std::vector<std::size_t> inputs;             ///< its operands: numbers of nodes before it
  std::map<std::string, std::size_t> named;    ///< by option: the node of its `@NAME`
  std::string name;                            ///< --as; empty: none
  Kind kind = Kind::Band;                      ///< of its result, if it makes one
  std::string location;                        ///< where it was written, if in a script
  bool voxelFollows = false;  ///< --tolerance is to tell the voxel size that it was not given

  [[nodiscard]] bool makes() const { return op->flow == Flow::Makes; }
};

/// Values that are made of values: what is asked for, not yet computed. However it was written, as
/// a chain, as a file, as JSON, the same graph comes of it.
struct Graph {
  std::map<std::string, std::string> globals;  ///< options of the run as a whole
  std::vector<Node> nodes;                     ///< each behind what it takes
  std::map<std::size_t, Value> given;          ///< by node: what was made elsewhere (givenOperator)
  std::vector<std::size_t> results;  ///< nodes whose values are asked for, used by others or not
};

/// Of nodes whose values Graph::given holds. Nothing runs it, and no file can name it.
[[nodiscard]] const Operator& givenOperator();

/// Checks what a node takes, and tells the kind of what it makes.
/// @throws levelset::UsageError for operands that are too many, too few or of kinds that it does
/// not
///         take, and as Operator::validate
[[nodiscard]] Kind checkNode(const Node& node, const std::vector<Node>& before);

/// Leaves the voxel size of a node open, for --tolerance to tell: of one that needs it and gives
/// none. Before checkNode().
void leaveVoxelOpen(Node& node);

/// By node: is it needed for the results that are asked for, or for what the graph does outside
/// itself, that is for what it writes, draws, prints or checks? Where there is nothing of either
/// kind, everything is.
[[nodiscard]] std::vector<char> neededNodes(const Graph& graph);

/// By node: the last one before it that writes what it reads, if any does. Until that has run, what
/// the file holds is something else.
[[nodiscard]] std::vector<std::optional<std::size_t>> findWritersRead(
    const Graph& graph, const std::vector<char>& needed);

/// By node: does one behind it write what it reads? Once that has run, it is not to be read again.
[[nodiscard]] std::vector<char> findOverwritten(const Graph& graph,
                                                const std::vector<char>& needed);

/// Does it read what can be read once only, standard input or a pipe?
[[nodiscard]] bool readsOnce(const Node& node);

/// By node: by how many others that are needed its value is taken.
[[nodiscard]] std::vector<std::size_t> countUses(const Graph& graph,
                                                 const std::vector<char>& needed);

}  // namespace pipeline
