#include "apps/pipeline/graph/region_of_interest.h"

#include <algorithm>

#include "apps/pipeline/registry/invocation.h"

namespace pipeline {
namespace {

using Imath::Box3d;
using Imath::V3d;

/// A share of the operand's size would be one of the part's.
bool asksForSize(const Node& node) {
  return std::any_of(node.op->params.begin(), node.op->params.end(), [&](const Param& param) {
    if (param.type != ParamType::Length && param.type != ParamType::Lengths) return false;
    const auto given = node.options.find(param.name);
    const std::string& text = given == node.options.end() ? param.fallback : given->second;
    return text.find('%') != std::string::npos;
  });
}

/// Is the value a distance, with a slope of 1? Only then a narrower band holds what is beside the
/// surface. By node.
std::vector<char> findDistances(const Graph& graph) {
  std::vector<char> is(graph.nodes.size(), 0);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const Node& node = graph.nodes[i];
    is[i] = node.op->slope == Slope::One ||
            (node.op->slope == Slope::OfOperands &&
             std::all_of(node.inputs.begin(), node.inputs.end(),
                         [&](std::size_t input) { return is[input] != 0; }));
  }
  return is;
}

/// What a node reads of an operand, whose plan is known.
Demand readOf(const Node& node, std::size_t operand, const Demand& of,
              const std::vector<std::optional<Plan>>& plans, const std::optional<Plan>& own) {
  if (!node.op->reads) return {};
  Invocation planned(*node.op, node.options);
  for (const std::size_t input : node.inputs) {
    if (!plans[input]) return {};
    planned.operands.emplace_back(*plans[input]);
  }
  if (node.makes() && node.kind == Kind::Band) {
    if (!own) return {};
    planned.planned = own;
  }
  Demand read = node.op->reads(planned, operand, of);
  if (asksForSize(node)) read.part.region = levelset::kEverywhere;
  return read;
}

/// Without what is no less than all.
Demand simplified(Demand demand, const Plan& plan, bool isDistance, double leastHalfWidth) {
  double& width = demand.part.halfWidth;
  width = std::max(leastHalfWidth, width);
  if (!isDistance || width >= plan.halfWidth) width = levelset::BandPart().halfWidth;
  Box3d& region = demand.part.region;
  const V3d rim(plan.halfWidth * plan.voxelSize);
  const Box3d all(plan.bounds.min - rim, plan.bounds.max + rim);
  const bool isAll =
      !plan.bounds.isEmpty() && region.intersects(all.min) && region.intersects(all.max);
  if (region.isEmpty() || isAll) region = levelset::kEverywhere;
  return demand;
}

}  // namespace

void Demand::join(const Demand& other) {
  part.halfWidth = std::max(part.halfWidth, other.part.halfWidth);
  part.region.extendBy(other.part.region);
}

std::vector<Demand> demandsOf(const Graph& graph, const std::vector<char>& runs,
                              const std::vector<std::optional<Plan>>& plans,
                              double leastHalfWidth) {
  const std::vector<char> isDistance = findDistances(graph);
  std::vector<std::optional<Demand>> demands(graph.nodes.size());
  for (const std::size_t result : graph.results) demands[result] = Demand{};
  for (std::size_t i = graph.nodes.size(); i-- > 0;) {
    const Node& node = graph.nodes[i];
    if (!runs[i]) continue;
    if (demands[i] && node.kind == Kind::Band && plans[i])
      demands[i] = simplified(*demands[i], *plans[i], isDistance[i] != 0, leastHalfWidth);
    else
      demands[i] = Demand{};
    const auto ask = [&](std::size_t input, const Demand& demand) {
      if (demands[input])
        demands[input]->join(demand);
      else
        demands[input] = demand;
    };
    for (std::size_t k = 0; k < node.inputs.size(); ++k)
      ask(node.inputs[k], readOf(node, k, *demands[i], plans, plans[i]));
    for (const auto& [option, input] : node.named) ask(input, {});
  }
  std::vector<Demand> all(graph.nodes.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    if (demands[i]) all[i] = *demands[i];
  return all;
}

Plan demanded(Plan plan, const Demand& demand) {
  plan.halfWidth = std::min(plan.halfWidth, demand.part.halfWidth);
  if (plan.bounds.isEmpty()) return plan;
  // As if the surface were spread evenly over its box.
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::max(plan.bounds.min[axis], demand.part.region.min[axis]),
                 high = std::min(plan.bounds.max[axis], demand.part.region.max[axis]),
                 side = plan.bounds.max[axis] - plan.bounds.min[axis];
    if (side > 0) share *= std::clamp((high - low) / side, 0.0, 1.0);
  }
  plan.area *= share;
  return plan;
}

}  // namespace pipeline
