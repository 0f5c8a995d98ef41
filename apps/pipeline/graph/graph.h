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
  /// Values as text, by full option name; a flag is "true".
  std::map<std::string, std::string> options;
  std::vector<std::size_t> inputs;  ///< operands: indices of earlier nodes
  std::map<std::string, std::size_t>
      named;                  ///< by option name: index of the node that `@NAME` refers to
  std::string name;           ///< name from --as; empty: none
  Kind kind = Kind::Band;     ///< kind of the result, if there is one
  std::string location;       ///< position in a script, "FILE, line 4"; empty: not from a script
  bool voxelFollows = false;  ///< true: no voxel size is given, and --tolerance will choose it

  [[nodiscard]] bool makes() const { return op->flow == Flow::Makes; }
};

/// The requested computation: nodes that compute values from values. A command line, a script and a
/// JSON file with the same actions give the same graph.
struct Graph {
  /// Global options of the run, by name without dashes.
  std::map<std::string, std::string> globals;
  std::vector<Node> nodes;  ///< each node follows its operands
  std::map<std::size_t, Value>
      given;  ///< by index of the node: values from outside the graph, see givenOperator()
  std::vector<std::size_t> results;  ///< indices of nodes whose values the caller requests
  /// For each former name of an action or option in the input, a sentence with its new name.
  std::vector<std::string> renamed;

  /// Adds a sentence to `renamed` if the input has `written`, the former name of `name`. Adds each
  /// sentence once.
  void addRenamed(const std::string& written, const std::string& name);
};

/// Operator of nodes whose values are in Graph::given. It never runs, and graph files cannot
/// contain it.
[[nodiscard]] const Operator& givenOperator();

/// Checks the operands and options of a node.
/// @param before  all earlier nodes
/// @return kind of the result of the node
/// @throws levelset::UsageError if the number or the kinds of operands do not fit, or if
///         Operator::validate rejects the options
[[nodiscard]] Kind checkNode(const Node& node, const std::vector<Node>& before);

/// Marks the voxel size of a node as chosen by --tolerance, if its action has the options --voxel
/// and --resolution, they apply, and neither is given. Call this before checkNode().
void leaveVoxelOpen(Node& node, const std::vector<Node>& before);

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

/// Finds the nodes that read a file which a later node writes. After the later node has run, the
/// original content of the file is lost.
/// @return one flag per node
[[nodiscard]] std::vector<char> findOverwritten(const Graph& graph,
                                                const std::vector<char>& needed);

/// Decides if a node reads standard input or a pipe, which can be read only once.
[[nodiscard]] bool readsOnce(const Node& node);

/// Counts, for each node, how often needed nodes take its value.
[[nodiscard]] std::vector<std::size_t> countUses(const Graph& graph,
                                                 const std::vector<char>& needed);

}  // namespace pipeline
