#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"

/// Values that are asked for, as Python holds them. Everything here is called under the
/// interpreter's lock.
namespace python {

class Lazy;
using LazyPtr = std::shared_ptr<Lazy>;

/// A node of a graph that grows, and its value once that is known. The value stays as long as
/// somebody may still ask for it: a Python object, or a node that is not computed yet.
class Lazy {
 public:
  /// @param node  its `inputs` and `named` are not read
  Lazy(pipeline::Node node, std::vector<LazyPtr> inputs, std::map<std::string, LazyPtr> named);
  /// A value that was made elsewhere.
  explicit Lazy(pipeline::Value value);
  ~Lazy();
  Lazy(const Lazy&) = delete;
  Lazy& operator=(const Lazy&) = delete;

  [[nodiscard]] pipeline::Kind kind() const { return node_.kind; }
  [[nodiscard]] const pipeline::Node& node() const { return node_; }
  [[nodiscard]] const std::optional<pipeline::Value>& value() const { return value_; }
  /// It was computed, though the value may have been let go since.
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
  /// Empties the lists of what it takes, into `all`.
  void moveInputs(std::vector<LazyPtr>& all);

  pipeline::Node node_;
  std::vector<LazyPtr> inputs_;
  std::map<std::string, LazyPtr> named_;
  std::optional<pipeline::Value> value_;
  bool isSettled_ = false;
  std::size_t holders_ = 0;  ///< Python objects
  std::size_t waiting_ = 0;  ///< times that nodes which are not settled take it
};

/// What has to be computed for some values: a graph, up to what is known.
class Request {
 public:
  enum class Depth {
    Unknown,  ///< what is known is given
    Whole     ///< for files: all, as it was written
  };
  explicit Request(const std::vector<LazyPtr>& results, Depth depth = Depth::Unknown);

  [[nodiscard]] const pipeline::Graph& graph() const { return graph_; }
  /// For the runner; needs no lock.
  void keep(std::size_t node, const pipeline::Value& value);
  /// Hands the values out. @param isDone  did all of it run?
  void settle(bool isDone);

 private:
  void add(Lazy& lazy, Depth depth);

  pipeline::Graph graph_;
  std::vector<LazyPtr> nodes_;
  std::map<const Lazy*, std::size_t> numbers_;
  std::vector<char> isKept_;  ///< by node: who may ask for it once this has run?
  std::vector<std::optional<pipeline::Value>> values_;
};

}  // namespace python
