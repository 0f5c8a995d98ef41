#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// One action with checked options and its operands.
struct Node {
  const Operator* op = nullptr;
  std::map<std::string, std::string> options;  ///< by full option name; a flag is "true"
  std::vector<std::size_t> inputs;             ///< operands: indices of earlier nodes
  std::map<std::string, std::size_t>
      named;                  ///< by option: index of the node that `@NAME` refers to
  std::string name;           ///< name from --as; empty: none
  Kind kind = Kind::Band;     ///< kind of the result, if there is one
  std::string location;       ///< position in a script; empty: not from a script
  bool voxelFollows = false;  ///< voxel size is not given, and --tolerance will choose it

  [[nodiscard]] bool makes() const { return op->flow == Flow::Makes; }
};

/// The requested computation: nodes that compute values from values. A command line, a script and a
/// JSON file with the same actions give the same graph.
struct Graph {
  std::map<std::string, std::string> globals;  ///< options of the run
  std::vector<Node> nodes;                     ///< each node follows its operands
  std::map<std::size_t, Value>
      given;  ///< by node: values from outside the graph, see givenOperator()
  std::vector<std::size_t> results;  ///< nodes whose values are requested
  std::vector<std::string> renamed;  ///< one sentence for each former word that was used

  /// Adds the sentence for a former word, once.
  void addRenamed(const std::string& written, const std::string& name);
};

/// Operator of nodes whose values are in Graph::given. It never runs, and files cannot refer to it.
[[nodiscard]] const Operator& givenOperator();

/// Checks the operands and options of a node.
/// @return kind of its result
/// @throws levelset::UsageError if the number or the kinds of operands do not fit, or as
///         Operator::validate
[[nodiscard]] Kind checkNode(const Node& node, const std::vector<Node>& before);

/// Leaves the voxel size to --tolerance, if the node takes one and none is given. Call this before
/// checkNode().
void leaveVoxelOpen(Node& node);

/// Finds the needed nodes: the requested results, the nodes that write, draw, print or check, and
/// all nodes that these depend on. If there are neither results nor such nodes, all nodes are
/// needed.
/// @return one flag per node
[[nodiscard]] std::vector<char> neededNodes(const Graph& graph);

/// Finds, for each node, the last earlier node that writes a file it reads. The node must wait
/// until that writer has run.
/// @return one node index per node; empty: no writer
[[nodiscard]] std::vector<std::optional<std::size_t>> findWritersRead(
    const Graph& graph, const std::vector<char>& needed);

/// Finds the nodes that read a file which a later node writes. After that writer, the input is
/// lost.
/// @return one flag per node
[[nodiscard]] std::vector<char> findOverwritten(const Graph& graph,
                                                const std::vector<char>& needed);

/// Decides if a node reads standard input or a pipe, which can be read only once.
[[nodiscard]] bool readsOnce(const Node& node);

/// Counts, for each node, how often needed nodes take its value.
[[nodiscard]] std::vector<std::size_t> countUses(const Graph& graph,
                                                 const std::vector<char>& needed);

}  // namespace pipeline
