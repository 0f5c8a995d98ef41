#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"

/// Lazy values behind Python objects. All functions are called under the interpreter's lock, unless
/// stated otherwise.
namespace python {

class Lazy;
using LazyPtr = std::shared_ptr<Lazy>;

/// A node of a growing graph, and its value once computed. The value is kept as long as a Python
/// object or a node that is not yet computed may request it.
class Lazy {
 public:
  /// @param node  action and options; its members `inputs` and `named` are ignored
  Lazy(pipeline::Node node, std::vector<LazyPtr> inputs, std::map<std::string, LazyPtr> named);
  /// Wraps a value that was computed elsewhere.
  explicit Lazy(pipeline::Value value);
  ~Lazy();
  Lazy(const Lazy&) = delete;
  Lazy& operator=(const Lazy&) = delete;

  [[nodiscard]] pipeline::Kind kind() const { return node_.kind; }
  [[nodiscard]] const pipeline::Node& node() const { return node_; }
  [[nodiscard]] const std::optional<pipeline::Value>& value() const { return value_; }
  /// True when the value was computed, also if it has been released since.
  [[nodiscard]] bool isSettled() const { return isSettled_; }
  void setName(std::string name) { node_.name = std::move(name); }

  /// Stores the computed value, and releases the inputs.
  void settle(std::optional<pipeline::Value> value);
  /// Counts the Python objects that refer to this node, with release().
  void hold() { ++holders_; }
  void release() {
    --holders_;
    letGo();
  }

 private:
  friend class Request;

  /// Releases the value if no Python object and no unsettled node can request it.
  void letGo();
  void leaveInputs();
  /// Moves all inputs into `all`.
  void moveInputs(std::vector<LazyPtr>& all);

  pipeline::Node node_;
  std::vector<LazyPtr> inputs_;
  std::map<std::string, LazyPtr> named_;
  std::optional<pipeline::Value> value_;
  bool isSettled_ = false;
  std::size_t holders_ = 0;  ///< number of Python objects that refer to this node
  std::size_t waiting_ = 0;  ///< number of uses as input of nodes that are not yet computed
};

/// The graph that computes some lazy values. It begins at values that are already computed.
class Request {
 public:
  enum class Depth {
    Unknown,  ///< nodes whose values are already computed are inputs and are not computed again
    Whole     ///< all nodes, also those that are already computed; for graph files
  };
  explicit Request(const std::vector<LazyPtr>& results, Depth depth = Depth::Unknown);

  [[nodiscard]] const pipeline::Graph& graph() const { return graph_; }
  /// Receives the value of a node from the runner. Needs no interpreter lock.
  void keep(std::size_t node, const pipeline::Value& value);
  /// Stores the received values in the lazy values.
  /// @param isDone  true if the run ended without an error
  void settle(bool isDone);

 private:
  void add(Lazy& lazy, Depth depth);

  pipeline::Graph graph_;
  std::vector<LazyPtr> nodes_;  ///< lazy value of each node of `graph_`, by node index
  std::map<const Lazy*, std::size_t>
      numbers_;               ///< index in `graph_` of the node of each lazy value
  std::vector<char> isKept_;  ///< for each node: its value may be requested after the run
  std::vector<std::optional<pipeline::Value>> values_;
};

}  // namespace python
