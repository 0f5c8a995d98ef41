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
  /// @param node  its `inputs` and `named` are not read
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

  void settle(std::optional<pipeline::Value> value);
  void hold() { ++holders_; }
  void release() {
    --holders_;
    letGo();
  }

 private:
  friend class Request;

  void letGo();
  void leaveInputs();
  /// Moves all inputs into `all`.
  void moveInputs(std::vector<LazyPtr>& all);

  pipeline::Node node_;
  std::vector<LazyPtr> inputs_;
  std::map<std::string, LazyPtr> named_;
  std::optional<pipeline::Value> value_;
  bool isSettled_ = false;
  std::size_t holders_ = 0;  ///< number of Python objects
  std::size_t waiting_ = 0;  ///< number of uses as input of unsettled nodes
};

/// The graph to compute some values, down to known values.
class Request {
 public:
  enum class Depth {
    Unknown,  ///< stops at known values
    Whole     ///< complete graph, for files
  };
  explicit Request(const std::vector<LazyPtr>& results, Depth depth = Depth::Unknown);

  [[nodiscard]] const pipeline::Graph& graph() const { return graph_; }
  /// Values for the runner. Needs no lock.
  void keep(std::size_t node, const pipeline::Value& value);
  /// Stores the computed values in the nodes. @param isDone  the run was complete
  void settle(bool isDone);

 private:
  void add(Lazy& lazy, Depth depth);

  pipeline::Graph graph_;
  std::vector<LazyPtr> nodes_;
  std::map<const Lazy*, std::size_t> numbers_;
  std::vector<char> isKept_;  ///< by node: its value may be requested after the run
  std::vector<std::optional<pipeline::Value>> values_;
};

}  // namespace python
