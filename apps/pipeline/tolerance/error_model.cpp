#include "apps/pipeline/tolerance/error_model.h"

#include <algorithm>
#include <cmath>

#include "apps/pipeline/registry/invocation.h"

namespace pipeline {
namespace {

constexpr ErrorModel kUnmeasured{1, 0.7, levelset::kCreaseError, ""};

/// Least radius of curvature of a node's result, world units; 0 or less: its options do not
/// determine it.
double leastRadius(const Node& node) {
  if (!node.op->leastRadius) return 0;
  Invocation probe(*node.op, node.options);
  return node.op->leastRadius(probe);
}

}  // namespace

const ErrorModel& errorModel(const Operator& op) {
  return op.errorModel ? *op.errorModel : kUnmeasured;
}

std::string optionWithoutModel(const Node& node) {
  struct Unmodelled {
    const char *action, *option, *value;
  };
  constexpr Unmodelled kAll[] = {{"reinitialize", "method", "pde"}, {"morph", "method", "speed"}};
  for (const Unmodelled& one : kAll) {
    if (node.op->name != one.action) continue;
    const auto given = node.options.find(one.option);
    if (given != node.options.end() && given->second == one.value)
      return std::string("--") + one.option + " " + one.value;
  }
  return {};
}

GraphModel graphModel(const Graph& graph, const std::vector<std::size_t>& nodes) {
  GraphModel all;
  for (const std::size_t i : nodes) {
    const ErrorModel& model = errorModel(*graph.nodes[i].op);
    all.order = std::min(all.order, model.order);
    all.makesCreases = all.makesCreases || model.creaseConstant > 0;
    const auto isSame = [&](const char* name) { return std::string(name) == model.source; };
    if (*model.source && std::none_of(all.cases.begin(), all.cases.end(), isSame))
      all.cases.push_back(model.source);
  }
  return all;
}

double modelVoxelSize(const Node& node, double error) {
  const ErrorModel& model = errorModel(*node.op);
  if (!(model.constant > 0)) return 0;
  if (model.order == 1) return error / model.constant;
  const double radius = leastRadius(node);
  return radius > 0 ? std::sqrt(error * radius / model.constant) : 0;
}

}  // namespace pipeline
