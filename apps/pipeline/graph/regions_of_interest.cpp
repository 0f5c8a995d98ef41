#include "apps/pipeline/graph/regions_of_interest.h"

#include <algorithm>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/refusal.h"

namespace pipeline {
namespace {

using Imath::Box3d;
using Imath::V3d;

/// Distance from the cut of a band, in voxels, beyond which a distance transform gives the bits of
/// the complete band. It extends the band in the blocks of 8³ grid points beside the cut.
constexpr double kCutReach = 20;

/// Decides if an option of a node is a percentage of the diagonal of its first operand. A cropped
/// operand would have another diagonal, so the node needs operands with their complete box.
bool asksForSize(const Node& node) {
  return std::any_of(node.op->params.begin(), node.op->params.end(), [&](const Param& param) {
    if (param.type != ParamType::Length && param.type != ParamType::Lengths) return false;
    const auto given = node.options.find(param.name);
    const std::string& text = given == node.options.end() ? param.fallback : given->second;
    return text.find('%') != std::string::npos;
  });
}

/// Finds, for each node, if its value is a distance, with a slope of 1. Only then does a narrower
/// band contain all voxels within its half width of the surface.
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

/// Returns the region of interest of one operand of a node. It is the complete value if the
/// operator gives none, or if the plan of an operand or of the result is unknown.
/// @param of   region of interest of the result of the node
/// @param own  plan of the result
RegionOfInterest readOf(const Node& node, std::size_t operand, const RegionOfInterest& of,
                        const std::vector<std::optional<Plan>>& plans,
                        const std::optional<Plan>& own) {
  if (!node.op->regionOfInterest) return {};
  Invocation planned(*node.op, node.options);
  for (const std::size_t input : node.inputs) {
    if (!plans[input]) return {};
    planned.operands.emplace_back(*plans[input]);
  }
  if (node.makes() && node.kind == Kind::Band) {
    if (!own) return {};
    planned.planned = own;
  }
  RegionOfInterest read;
  try {
    read = node.op->regionOfInterest(planned, operand, of);
  } catch (const levelset::Error& error) {
    rethrowAs(node.op->name, error, node.location);
  }
  if (asksForSize(node)) read.region = levelset::kEverywhere;
  return read;
}

/// Removes a restriction that saves nothing: a half width as large as that of the band, and a box
/// that is empty or contains the complete band. Keeps the complete half width of a value that is no
/// distance.
/// @param leastHalfWidth  voxels; a smaller half width is raised to it
RegionOfInterest simplified(RegionOfInterest roi, const Plan& plan, bool isDistance,
                            double leastHalfWidth) {
  double& width = roi.halfWidth;
  width = std::max(leastHalfWidth, width);
  if (!isDistance || width >= plan.halfWidth) width = RegionOfInterest().halfWidth;
  Box3d& region = roi.region;
  const V3d rim(plan.halfWidth * plan.voxelSize);
  const Box3d all(plan.bounds.min - rim, plan.bounds.max + rim);
  const bool isAll =
      !plan.bounds.isEmpty() && region.intersects(all.min) && region.intersects(all.max);
  if (region.isEmpty() || isAll) region = levelset::kEverywhere;
  return roi;
}

}  // namespace

std::vector<RegionOfInterest> regionsOfInterest(const Graph& graph, const std::vector<char>& runs,
                                                const std::vector<std::optional<Plan>>& plans,
                                                double leastHalfWidth, const Box3d& part) {
  const std::vector<char> isDistance = findDistances(graph);
  const bool isPart = !levelset::isEverywhere(part);
  std::vector<std::optional<RegionOfInterest>> regions(graph.nodes.size());
  for (const std::size_t result : graph.results) regions[result] = RegionOfInterest{.region = part};
  for (std::size_t i = graph.nodes.size(); i-- > 0;) {
    const Node& node = graph.nodes[i];
    if (!runs[i]) continue;
    if (regions[i] && node.kind == Kind::Band && plans[i])
      regions[i] = simplified(*regions[i], *plans[i], isDistance[i] != 0, leastHalfWidth);
    else
      regions[i] = RegionOfInterest{};
    const auto ask = [&](std::size_t input, const RegionOfInterest& roi) {
      if (regions[input])
        regions[input]->join(roi);
      else
        regions[input] = roi;
    };
    for (std::size_t k = 0; k < node.inputs.size(); ++k) {
      RegionOfInterest read = readOf(node, k, *regions[i], plans, plans[i]);
      if (isPart && node.kind == Kind::Band && plans[node.inputs[k]])
        read.region = levelset::grown(
            read.region, kCutReach * node.op->distancePasses * plans[node.inputs[k]]->voxelSize);
      ask(node.inputs[k], read);
    }
    for (const auto& [option, input] : node.named) ask(input, {});
  }
  std::vector<RegionOfInterest> all(graph.nodes.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    if (regions[i]) all[i] = *regions[i];
  return all;
}

Plan restricted(Plan plan, const RegionOfInterest& roi) {
  plan.halfWidth = std::min(plan.halfWidth, roi.halfWidth);
  if (plan.bounds.isEmpty()) return plan;
  // The estimate assumes that the surface is distributed evenly over its bounding box.
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::max(plan.bounds.min[axis], roi.region.min[axis]),
                 high = std::min(plan.bounds.max[axis], roi.region.max[axis]),
                 side = plan.bounds.max[axis] - plan.bounds.min[axis];
    if (side > 0) share *= std::clamp((high - low) / side, 0.0, 1.0);
  }
  plan.area *= share;
  return plan;
}

}  // namespace pipeline
