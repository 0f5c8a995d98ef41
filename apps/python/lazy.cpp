#include "apps/python/lazy.h"

#include <fmt/core.h>

namespace python {

using pipeline::Node;
using pipeline::Value;

Lazy::Lazy(Node node, std::vector<LazyPtr> inputs, std::map<std::string, LazyPtr> named)
    : node_(std::move(node)), inputs_(std::move(inputs)), named_(std::move(named)) {
  for (const LazyPtr& input : inputs_) ++input->waiting_;
  for (const auto& [option, input] : named_) ++input->waiting_;
}

Lazy::Lazy(Value value) : value_(std::move(value)), isSettled_(true) {
  node_.op = &pipeline::givenOperator();
  node_.kind = value_->kind();
}

Lazy::~Lazy() {
  leaveInputs();
  // The inputs are released without recursion, because a chain may be longer than the stack allows.
  std::vector<LazyPtr> open;
  moveInputs(open);
  while (!open.empty()) {
    const LazyPtr last = std::move(open.back());
    open.pop_back();
    if (last.use_count() > 1) continue;
    last->leaveInputs();
    last->moveInputs(open);
  }
}

void Lazy::moveInputs(std::vector<LazyPtr>& all) {
  for (LazyPtr& input : inputs_) all.push_back(std::move(input));
  for (auto& [option, input] : named_) all.push_back(std::move(input));
  inputs_.clear();
  named_.clear();
}

void Lazy::letGo() {
  if (holders_ == 0 && waiting_ == 0) value_.reset();
}

/// Marks the node as settled, and releases its inputs, which it does not need again.
void Lazy::leaveInputs() {
  if (isSettled_) return;
  isSettled_ = true;
  const auto leave = [](Lazy& input) {
    --input.waiting_;
    input.letGo();
  };
  for (const LazyPtr& input : inputs_) leave(*input);
  for (const auto& [option, input] : named_) leave(*input);
}

void Lazy::settle(std::optional<Value> value) {
  if (isSettled_) return;
  value_ = std::move(value);
  leaveInputs();
  letGo();
}

Request::Request(const std::vector<LazyPtr>& results, Depth depth) {
  // Lists each node after its inputs, without recursion, because a chain may be longer than the
  // stack allows.
  std::vector<std::pair<LazyPtr, bool>> open;
  for (auto it = results.rbegin(); it != results.rend(); ++it) open.emplace_back(*it, false);
  while (!open.empty()) {
    const auto [lazy, isReady] = open.back();
    if (numbers_.contains(lazy.get())) {
      open.pop_back();
      continue;
    }
    const bool isLeaf = depth == Depth::Unknown && lazy->value_;
    if (isReady || isLeaf) {
      open.pop_back();
      add(*lazy, depth);
      nodes_.push_back(lazy);
      continue;
    }
    open.back().second = true;
    for (const auto& [option, input] : lazy->named_) open.emplace_back(input, false);
    for (auto it = lazy->inputs_.rbegin(); it != lazy->inputs_.rend(); ++it)
      open.emplace_back(*it, false);
  }
  for (const LazyPtr& result : results) graph_.results.push_back(numbers_.at(result.get()));
  const std::vector<std::size_t> uses =
      countUses(graph_, std::vector<char>(graph_.nodes.size(), 1));
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    isKept_.push_back(nodes_[i]->holders_ > 0 || nodes_[i]->waiting_ > uses[i]);
  values_.resize(nodes_.size());
}

void Request::add(Lazy& lazy, Depth depth) {
  const std::size_t number = graph_.nodes.size();
  numbers_.emplace(&lazy, number);
  Node node = lazy.node_;
  if (depth == Depth::Unknown && lazy.value_) {
    node.op = &pipeline::givenOperator();
    node.options.clear();
    graph_.given.emplace(number, *lazy.value_);
  } else {
    for (const LazyPtr& input : lazy.inputs_) node.inputs.push_back(numbers_.at(input.get()));
    for (const auto& [option, input] : lazy.named_) {
      const std::size_t of = numbers_.at(input.get());
      const std::string& name = graph_.nodes[of].name;
      node.options[option] = "@" + (name.empty() ? fmt::format("{}", of) : name);
      node.named[option] = of;
    }
    // Names must be unique within a graph file.
    for (const Node& other : graph_.nodes)
      if (depth == Depth::Whole && other.name == node.name) node.name.clear();
  }
  graph_.nodes.push_back(std::move(node));
}

void Request::keep(std::size_t node, const Value& value) {
  if (isKept_[node]) values_[node] = value;
}

void Request::settle(bool isDone) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    // With a cache, a run may complete without the value of a node, if the values derived from it
    // are in the cache.
    const bool isMissing = isKept_[i] && !values_[i] && graph_.nodes[i].makes();
    if (isDone ? !isMissing : values_[i].has_value()) nodes_[i]->settle(std::move(values_[i]));
  }
}

}  // namespace python
